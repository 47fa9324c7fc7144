"""Comparisons over many frames or studies, whose tables docs/validation shows.

The modules in reading order; each compares and returns rows:

- `diversity`: suppression of interference by families of waveforms: `compare_families`.
- `ghosts`: probability of ghosts, beside closed forms: `measure_ghosts`.
- `impairments`: effect of hardware impairments on scenario C: `compare_impairments`.
- `mitigations`: methods of mitigation on one frame: `compare_mitigations`.
- `mechanisms`: share of each mechanism of the channel: `compare_mechanisms`.
- `gnuradio`, `gnuradio_flow`: the channel model of GNU Radio, as a check: `through_gnuradio`.
"""
