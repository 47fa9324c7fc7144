"""Comparison of detections with the truth, and statistics over trials.

The modules in reading order; others may use the names beside them:

- `association`: detections on bodies: `Gate`, `distances_from_bodies`, `associate`.
- `echoes`: own paths with the body that each is of: `Echoes`, `echoes_of`, and those of
  several instants of a frame together: `mean_echoes`.
- `causes`: the one rule for the cause of every detection: `Nature`, `causes`.
- `compare`: the score of one radar in one trial: `compare`.
- `mitigation`: measures of mitigation: `signal_to_disturbance`, `error_vector_magnitude`,
  `sample_sinr`, `share_touched`.
- `burst_detection`: samples that are hit and those that were found: `burst_counts`, `hit_in_truth`.
- `statistics`: estimates over trials with confidence intervals: `Estimate`, `proportion`,
  `mean_count`, `poisson_mean`, `rms`, `ratio_difference`, `rms_difference`, `wilson`.
- `ideal_detector`: detection probability of the ideal coherent detector: `ideal_detection`,
  `cell_threshold`, `needed_snr`.
- `closed_forms`: a room of probabilities and levels of interference, to compare estimates with.
"""
