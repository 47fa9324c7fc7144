"""How alike signals are: correlation, ambiguity, their lobes, and what theory expects of chirps."""
