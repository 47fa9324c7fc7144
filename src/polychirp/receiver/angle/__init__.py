"""Azimuths from the phases along the antenna array.

- `beamform`: phase-shift beams: `steering`, `beamform`, `orthogonal_sines`.
- `doa`: estimators of the direction of arrival: `root_music`, `bartlett`, `capon`.
"""
