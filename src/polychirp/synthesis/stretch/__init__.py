"""The fast synthesis engine: dechirped samples in closed form, path by path or in batches.

Others may use `engine.Stretch` alone. In reading order:

* `engine`: `Stretch`, the steps of a contribution
* `ramp_overlaps`: pairs of ramps that overlap; `work_units`: the samples that they reach
* `kernel_records`, `kernel_tables`: records and tables that compiled kernels take
* `chirp_response`: the filter's response to a chirp, tabulated
* `path_kernels`, `chirp_kernels`, `filter_kernels`: sums link by link, one chirp, the filter
* `path_batches`, `batch_kernels`: many links of a pair of ramps at once
* `ramp_edges`, `ramp_edge_kernels`: the same where ramps begin and end
* `nufft`, `nufft_kernels`, `chirp_response_kernels`: sums of tones, and tables by them

Modules of kernels need numba and are imported where they are called.
"""
