"""Diffraction of direct paths at the edges of bodies and plates.

`paths` traces them and states the equations. It uses `silhouette` (what obstacles block about the
line of sight), `half_planes` (blocked intervals in half-planes) and `edge_waves` (waves from the
edges, summed in cells of path length).
Other rooms use `paths.diffracted_paths`.
"""
