"""Materials and the waves at their surfaces.

* `library`: the known materials of ``materials.toml``, one source per row (`known_materials`,
  `material_table`, `check_materials`);
* `fresnel`: reflection and transmission of half-spaces, sheets and conductors; roughness;
* `reflection_table`: reflection coefficients tabulated for kernels.

All public names are for the whole package `channel`; other packages use `library`.
"""
