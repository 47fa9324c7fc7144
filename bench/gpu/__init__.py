"""The channel's kernels on a GPU by CUDA, beside the same kernels on processors."""
