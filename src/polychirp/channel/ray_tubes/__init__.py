"""Reflections between bodies: ray tubes that are traced over several bounces."""
