"""The direct path between two radars, and echoes of point scatterers.

* `line_of_sight`: direct paths in an empty world;
* `point_scatterers`: echoes of points in an empty world (`echoes_over` serves other rooms);
* `occluded`: both with shadows, and with losses in sheets and leaves.

Tracers use `visible_line_of_sight` and `visible_point_echoes`, or the functions for empty worlds.
"""
