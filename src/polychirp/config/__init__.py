"""Study files: TOML to and from the dataclasses, and the schema of what may be written."""
