"""Waves bent around the edges of bodies."""
