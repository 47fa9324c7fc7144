"""Many trials of every point of a grid, run by workers, stopped early, resumed and stored.

The modules in reading order; others may use the names beside them:

- `grid`: the table of a study file, its axes and the seeds of trials: `MonteCarlo`, `Axis`.
- `plan`: a study for every point: `Plan`, `Point`, `check_plan`.
- `records`: the log of finished trials: `TrialRecord`, `read_records`.
- `tasks`: tasks, outcomes and the protocol of executors: `Executor`.
- `executor`, `worker`: processes on this machine: `LocalWorkers`.
- `dask_executor`: a Dask cluster: `DaskWorkers`.
- `stopping`: the early end of points whose detection probability is known well enough.
- `results`: arrays of all trials, and their store: `Results`, `load_results`.
- `summary`: estimates with intervals: `summaries`, `differences`.
- `comparison`: schemes over scenarios, of several studies with one grid: `Cell`, `comparison`.
- `tables`: the estimates and all trials as CSV and Parquet: `flat_row`.
- `run`: all of these in order: `run_plan`.
"""
