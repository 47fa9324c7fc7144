"""Models of IF samples: one point on a ramp, points over a frame, and codes of the transmitters.

- `grid`: axes of a map over range and range rate: `Grid`.
- `power_spectra`: windowed power spectra of the ramps: `power_spectra`, `spectrum_size`.
- `point_signal`: beat, phase and amplitude of a moving point: `beat_phase`, `path_of`,
  `fit_amplitudes`, `matched_amplitudes`, `hann_weights`.
- `unit_signal`: the compiled signal of one point on one ramp.
- `transmit_codes`: blocks of sweeps on which the codes are orthogonal: `code_blocks`.
- `equal_ramps`: reason why ramps are not equal: `unequal`; refusal of codes: `refuse_code`.
- `turning`: loss of samples that are added while a motion turns their phase: `turning_loss`.
- `frame_model`: beats and phases of points on the ramps of one frame: `FrameModel`.
"""
