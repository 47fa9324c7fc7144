"""Reflections between bodies: ray tubes that are traced over two bounces and more.

Tubes from every transmitter are followed from body to body; the currents where they end radiate to
every receiver. The modules are, in reading order: `paths` (theory, and the function `tube_paths`),
`launch_grid` (directions of the tubes), `refinement` (narrower tubes where they matter),
`intersections` (surfaces that a ray meets), `fields` (a ray and its waves), `propagation` (rays
from surface to surface), `radiation` (currents and their fields), `visibility` (legs to the
receivers), `cell_paths` (paths from contributions). Other subpackages use `paths.tube_paths`.
"""
