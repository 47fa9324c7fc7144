"""The scenarios and statistics of the paper, and their results.

The modules in reading order; others may use the names beside them:

- `results`: values for the report, and the statements of the paper: `PaperResults`.
- `scenarios`: scenarios A, B and C: `paper_study`, `run_paper`.
- `statistics`: trials for figures 12 and 13: `statistics_plan`, `run_statistics`.
- `stored_statistics`: 60 to 300 trials of each point, computed earlier: `read_statistics`.
"""
