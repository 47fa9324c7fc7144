"""The direct path between two radars, and echoes of point scatterers and of moving parts.

* `line_of_sight`: direct paths without obstacles;
* `point_scatterers`: echoes of points without obstacles (other subpackages use `echoes_over`);
* `occluded`: both with shadows, and with losses in sheets and leaves;
* `moving_parts`: echoes of bodies whose parts move within a frame: walkers, wheels, riders.

Tracers use `visible_line_of_sight`, `visible_point_echoes` and `visible_part_echoes`, or functions
without obstacles.
"""
