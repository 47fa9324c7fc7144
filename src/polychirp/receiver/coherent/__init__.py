"""The coherent receiver: all samples of a frame add up in phase, on ramps of any kind."""
