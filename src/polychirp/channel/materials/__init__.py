"""Materials and the waves at their surfaces.

* `library`: the known materials of ``materials.toml``, each with its source (`known_materials`,
  `material_table`, `check_materials`);
* `fresnel`: reflection and transmission of half-spaces, sheets and conductors; roughness;
* `reflection_table`: reflection coefficients tabulated for compiled kernels.

The whole package `channel` may use all public names; other packages use `library`.
"""
