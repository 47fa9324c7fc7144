"""Synthesis: from schedules and propagation paths to dechirped samples at the converter."""
