"""Hand-made paths and bodies, for examples and for tests of polychirp and of its plug-ins."""
