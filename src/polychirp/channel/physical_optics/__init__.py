"""Echoes of meshed bodies: near-field physical optics, facet by facet.

`paths` traces echoes of one body, seen directly and in mirrors. It uses `views` (radars, or their
mirror images, in the body's frame); `illumination` (facets that are visible in a view) with
`horizon`, `view_losses`, `incident_waves` and `kernels` (shadow tests and geometry of facets);
`facet_integral`, `corner_terms`, `term_sums` and `delay_cells` (terms of facets, and their sums in
cells of path length); `flat_faces` and `flat_terms` (flat parts, and the terms of their borders);
`power_estimate` (cells of mirrored echoes that are too weak to compute); and `cell_paths` (paths
from the sums). Other subpackages may use all public names of `paths` and `views`, and the constants
and vector functions of `kernels` and `facet_integral`.
"""
