"""Echoes of meshed bodies: near-field physical optics, facet by facet."""
