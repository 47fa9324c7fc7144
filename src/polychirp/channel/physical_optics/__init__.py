"""Echoes of meshed bodies: near-field physical optics, facet by facet.

`paths` traces echoes of one body, seen directly and in mirrors. It uses `views` (radars as a body
sees them), `illumination` (facets that views see) with `horizon`, `view_losses`, `incident_waves`
and `kernels` (shadow tests and geometry of facets); `facet_integral`, `corner_terms` and
`delay_cells` (terms of facets, and their sums in cells of path length); `power_estimate` (cells of
echoes in mirrors that are too weak); and `cell_paths` (paths from the sums). Other rooms may use
all public names of `paths` and `views`, and the constants and vector functions of `kernels` and
`facet_integral`.
"""
