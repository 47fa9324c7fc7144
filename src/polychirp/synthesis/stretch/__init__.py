"""The fast synthesis engine: dechirped samples in closed form, path by path or in batches.

Other packages use only `engine.Stretch`. In reading order:

* `engine`: `Stretch`, the steps of a contribution
* `ramp_overlaps`: pairs of ramps that overlap; `work_units`: the samples that they contribute to
* `kernel_records`, `kernel_tables`: records and tables that are arguments of compiled kernels
* `chirp_response`: the filter's response to a chirp, tabulated
* `path_kernels`, `chirp_kernels`, `filter_kernels`: sums link by link, one chirp, filter tables
* `path_batches`, `batch_kernels`: many links of a pair of ramps at once
* `near_corners`, `near_corner_kernels`: all links, where ramps begin and end near the band
* `ramp_edges`, `ramp_edge_kernels`: many links at once, where they do so far out of band
* `nufft`, `nufft_kernels`, `chirp_response_kernels`: sums of tones, and tables made by them

Modules of kernels need numba and are imported where they are called.
"""
