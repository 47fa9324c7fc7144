"""Mirror images in large plates, such as road and walls.

* `plates`: one reflection (`mirror_paths`);
* `double_plates`: two reflections, corners included (`corner_paths`);
* `ways`: the shortest way over a plate, by its mirror point or over its sides, for `plates`;
* `images`: image points and reflection coefficients, for all of these.

Tracers use `mirror_paths` and `corner_paths`.
"""
