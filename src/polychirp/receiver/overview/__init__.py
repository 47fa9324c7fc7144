"""Spectra and maps of a frame or of a part of its samples, for figures; no detection.

The modules; other packages use the functions beside them:

- `range_response`: power over range from all ramps together, and the map of means of logarithms
  that it is made of: `range_response`, `log_range_rate_map`.
- `sums`: power over range and range rate, and of beams, for three kinds of ramps.
- `range_rate`: power over range and range rate, for ramps of any kind: `range_rate_map`; its
  greatest value over range rates: `range_profile`.
- `range_azimuth`: power over range and azimuth: `range_azimuth_map`.
- `spectrogram`: power over time and beat: `spectrogram`.
- `pooling`: maps with fewer cells: `pooled`, `group_means`.
"""
