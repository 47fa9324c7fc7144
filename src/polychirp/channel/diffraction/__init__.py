"""Diffraction at the edges of bodies and plates, of direct paths and of what mirrors reflect.

`paths` traces the direct diffracted paths and states the equations; `mirrored_paths` does so for
waves by way of road and walls. They use `sight_lines` (lines of sight, unfolded at mirrors, and
what obstructs them), `silhouette` (what obstacles block about a line), `half_planes` (blocked
intervals in half-planes), `edge_waves` (waves from edges, summed in cells of path length) and
`edge_paths` (paths from these sums). Other packages use `paths.diffracted_paths`,
`paths.LONGEST_INTERVAL` and `mirrored_paths.diffracted_mirror_paths`.
"""
