"""Vehicles as a few scattering points each, for hundreds of vehicles at once."""
