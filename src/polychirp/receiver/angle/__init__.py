"""Azimuths and elevations from the phases of an antenna array's channels.

- `elements`: places of the channels in wavelengths, and the phases of waves: `Elements`.
- `beamform`: phase-shift beams: `steering`, `beamform`, `orthogonal_sines`.
- `beams`: Bartlett's and Capon's beams for elements anywhere.
- `esprit`: directions from two equal parts of an array.
- `doa`: estimators of azimuths on a uniform line: `root_music`, `bartlett`, `capon`.
- `two_waves`: two waves in one snapshot of a line: `two_waves`.
- `ambiguity`: directions that an array cannot tell apart: `unambiguous_window`, `grating_lobes`.
- `directions`: all estimators on all arrays: `directions`, `cosines_of_waves`, `unfit`.
"""
