"""Simulate mutual interference between FMCW automotive radars."""
