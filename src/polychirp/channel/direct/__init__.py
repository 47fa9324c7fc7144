"""The direct path between two radars, and echoes of point scatterers.

* `line_of_sight`: direct paths without obstacles;
* `point_scatterers`: echoes of points without obstacles (other subpackages use `echoes_over`);
* `occluded`: both with shadows, and with losses in sheets and leaves.

Tracers use `visible_line_of_sight` and `visible_point_echoes`, or functions without obstacles.
"""
