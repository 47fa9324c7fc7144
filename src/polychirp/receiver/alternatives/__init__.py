"""Receivers beside the default one: as the paper prints it, and for chirp sequences."""
