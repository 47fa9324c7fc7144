"""Diffraction of direct paths at the edges of bodies and plates.

`paths` traces the diffracted paths and states the equations. It uses `silhouette` (what obstacles
block about the line of sight), `half_planes` (blocked intervals in half-planes) and `edge_waves`
(waves from edges, summed in cells of path length). Other packages use `paths.diffracted_paths`
and `paths.LONGEST_INTERVAL`.
"""
