"""Programs for those who develop polychirp; none of them ships in the package."""
