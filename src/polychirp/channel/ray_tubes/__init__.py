"""Reflections between bodies: ray tubes that are traced over two bounces and more.

Tubes from every transmitter are followed from body to body; the currents where they end radiate to
every receiver. The modules are, in reading order: `paths` (theory, and the function `tube_paths`),
`launch_grid` (directions of the tubes), `refinement` (narrower tubes where they matter),
`flat_parts` (flat parts with sharp edges), `intersections` (surfaces that a ray meets), `fields` (a
ray and its waves), `propagation` (rays from surface to surface), `fresnel_window` (what the edges
of a flat mirror do), `flat_pairs` (waves over two flat parts), `radiation` (currents and their
fields), `visibility` (legs to the receivers), `cell_paths` (paths from contributions). Other
subpackages use `paths.tube_paths`.
"""
