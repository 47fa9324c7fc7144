"""Claims against truth."""
