"""Whole experiments: what is varied, run, kept and compared."""
