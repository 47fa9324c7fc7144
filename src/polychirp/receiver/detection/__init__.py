"""The range-rate map of a frame, its floor, thresholds, and the rejection of side lobes.

- `range_rate_map`: the map over ramps of any slopes, by direct sums: `log_range_rate_map`, `Grid`.
- `residual_map`: the same map, computed again fast after each subtraction: `ResidualMap`.
- `threshold`: thresholds on the map: `log_threshold_above_floor`, `mean_threshold`.
- `floor_correlation`: correlation of a cell with the floor, which changes the threshold.
- `sidelobe_rejection`: refuses peaks of stronger points: `without_cross_pairs`, `reject_sidelobes`.
- `cfar`, `cfar_kernel`: CFAR for chirp sequences: `CfarWindow`, `ordered_statistic`.
"""
