"""CFAR thresholds for maps of chirp sequences, and for spectra in time and frequency.

- `cfar`: windows of training cells, and thresholds from them: `CfarWindow`, `ordered_statistic`.
- `cfar_kernel`: the compiled count of training cells below a level.
"""
