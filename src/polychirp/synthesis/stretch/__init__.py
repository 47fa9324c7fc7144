"""The fast synthesis engine: dechirped samples, path by path or in batches."""
