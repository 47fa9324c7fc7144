"""Detection probability of a point over its SNR, and the false-alarm rate, for a study's receiver.

The modules in reading order; others may use the names beside them:

- `plan`: which radar, receivers, SNRs and numbers of trials: `RocPlan`, `roc_plan`.
- `yardsticks`: cells, error limits and the ideal detector that fit a receiver.
- `frames`: frames of drawn points in the radar's noise.
- `trial`: the receivers on one frame: `RocRecord`.
- `summary`: estimates with intervals: `RocSummary`, `CurvePoint`, `NoiseRow`.
- `run`: all trials on workers, logged and resumed: `run_roc`.
"""
