"""Interfered frames with their parts, and measures of what methods of mitigation give back.

The modules in reading order; others use the names beside them:

- `hand_frames`: frames of points and chirps without a channel: `hand_frame`, `ChirpSequence`.
- `engine_frames`: frames of a drawn road and of a study, with the true filter: `ROADS`,
  `road_frame`, `frame_of_study`.
- `street_frames`: frames of traced streets: `STREETS`, `street_frame`.
- `published`: signals of the literature: `tu_delft`, `arim`, `toth`, `ARIM_CELLS`.
- `frame_sets`: named and versioned sets of frames: `FRAME_SETS`, `set_frame`.
- `measures`: a method's result on one frame: `measured_frame`, `measures`.
- `own_methods`: methods by name, a user's too: `METHODS`, `methods_named`.
- `dataset`: frames with their clean twins as Zarr: `DatasetPlan`, `write_dataset`.
- `benchmark`: all methods on a set, and its record: `BenchmarkPlan`, `run_benchmark`,
  `benchmark_record`; `carried_work` takes a user's methods to worker processes.
"""
