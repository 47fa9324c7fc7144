"""Mirror images in large plates, such as road and walls.

* `plates`: one reflection (`mirror_paths`);
* `double_plates`: two reflections, corners included (`corner_paths`);
* `images`: image points and reflection coefficients, for these two.

Tracers use `mirror_paths` and `corner_paths`.
"""
