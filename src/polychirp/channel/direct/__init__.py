"""The direct path between two radars, and echoes of point scatterers."""
