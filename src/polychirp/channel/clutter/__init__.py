"""Echoes with random phases: many weak paths over points that represent rough surfaces and leaves.

* `rough_plates`: road and walls by Lambert's law (`diffuse_paths`);
* `foliage`: crowns of trees (`foliage_paths`);
* `random_scatterers`: paths over such points, for these two modules.

Tracers use `diffuse_paths` and `foliage_paths`.
"""
