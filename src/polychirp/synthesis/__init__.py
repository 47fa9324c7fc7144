"""Synthesis: from schedules and propagation paths to dechirped samples at the converter.

In reading order:

* `base`: `SynthesisEngine`, the protocol of engines
* `links`: delays and amplitudes between two radars, leakage, thermal noise, audible radars
* `stretch`: `Stretch`, the fast engine; the slow reference engine is in `tests/support/references`
* `impairments`: errors of oscillators, filters and converters
* `received_frame`: `synthesize`, a radar's samples over one frame and their parts
* `sdr`: the link between two software-defined radios
* `unit_phasors`: kernels that compute complex numbers of magnitude 1
"""
