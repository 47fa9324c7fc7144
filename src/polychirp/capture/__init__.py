"""Recorded converter samples become an `IfFrame`: NumPy arrays and TI's raw files."""
