"""Models of the samples: one point, many points over a frame, and their fit in the spectrum."""
