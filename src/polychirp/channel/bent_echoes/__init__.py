"""Echoes of bodies by waves that bend around a vehicle in front of them.

`paths` traces these echoes and states the equations. It uses `outlines` (edges of the vehicle in
the way), `two_edges` (field behind two parallel edges), `edge_waves` (lengths, directions and
amplitudes of the waves) and `bent_views` (facets that the waves illuminate). Other packages use
`paths.bent_echoes`.
"""
