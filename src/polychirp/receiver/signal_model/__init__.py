"""Models of IF samples: one point on a ramp, points over a frame, and the points' spectra.

- `point_signal`: beat, phase and amplitude of a moving point: `beat_phase`, `path_of`,
  `fit_amplitudes`, `matched_amplitudes`, `hann_weights`.
- `frame_model`: the same for the ramps and the front end of one frame: `FrameModel`.
- `spectral_fit`: fits of points to bins of spectra, faster than to samples: `Band`, `band_of`.
"""
