"""From dechirped samples of one frame to detections.

The subpackages and modules in reading order; other packages may use the names beside them:

- `mitigation`: reduction of interference in the samples: `AnyMitigation` and its methods.
- `signal_model`: signals of moving points, spectra, and codes of the transmitting elements.
- `detection`: CFAR thresholds: `cfar.CfarWindow`.
- `estimation`: azimuths in motion, and the bound on errors: `cramer_rao.cramer_rao_bound`.
- `angle`: azimuths and elevations of points: `directions`, `doa`, `beamform`; `ambiguity`.
- `clustering`: several points of one body as one detection: `Body`, `merged`.
- `settings`: what all receivers share.
- `coherent`: all samples in phase, for ramps of any slopes: `chain.CoherentReceiver`.
- `range_doppler`: Fourier transforms, for equal chirps: `chain.RangeDoppler`.
- `decoding`: codes within ramps are removed first: `chain.Decoding`.
- `stepped`: two sequences of steps of constant frequency: `chain.MfskReceiver`.
- `alternatives`: the receiver as the paper describes it, for triangles: `PaperReceiver`.
- `selection`: the receivers of a study file, and the choice of one: `AnyReceiver`, `receiver_for`.
- `mimo`: the virtual array of several transmitting elements: `virtual_array`, `virtual_parts`,
  `azimuths_in_motion`, `element_streams`.
- `attribution`: powers of detections and floor, for each part of the samples: `detected`,
  `part_amplitudes`, `floor_rise`.
- `overview`: spectra and maps of a frame or of a part of it, for figures.
"""
