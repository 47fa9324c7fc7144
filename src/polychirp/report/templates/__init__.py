"""Templates of the report, for Jinja2, and its style sheet."""
