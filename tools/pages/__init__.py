"""Programs that measure the numbers of docs/validation and write its pages."""
