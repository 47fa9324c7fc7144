"""The ray tracers that a study may name, and interpolation of their paths in time."""
