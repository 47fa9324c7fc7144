"""Comparison of detections with the truth, and statistics over trials.

The modules in reading order; others may use the names beside them:

- `association`: pairs of targets and detections: `Gate`, `associate`.
- `ghosts`: the cause of every detection: `Nature`, `natures`, `dominated_by_interference`.
- `compare`: the score of one radar in one trial: `compare`.
- `mitigation`: measures of mitigation: `signal_to_disturbance`, `error_vector_magnitude`,
  `share_touched`.
- `statistics`: estimates over trials with confidence intervals: `Estimate`, `proportion`,
  `mean_count`, `poisson_mean`, `rms`, `ratio_difference`, `rms_difference`, `wilson`.
- `ideal_detector`: detection probability of the ideal coherent detector: `ideal_detection`,
  `cell_threshold`, `needed_snr`.
- `closed_forms`: probabilities of ghosts and of interference, to compare estimates with.
"""
