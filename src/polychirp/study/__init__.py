"""Whole experiments: studies, their trials and their stored results.

The modules and subpackages in reading order; others may use the names beside them:

- `spec`: a study as one frozen value, its scene and schedules: `Study`, `StudyRadar`, `scene_of`,
  `schedules_of`.
- `traffic`: random traffic of a study: `StudyTraffic`.
- `random_draw`: one street from that traffic: `sample_street`.
- `limits`: what a study cannot do, or does only in part, found before it runs.
- `kernel_parts`, `warm_up`: compilation of the kernels before a study runs: `compile_parts`.
- `margins`: margins within which detections are on a target: `gate_for`, `gates_of`.
- `part_views`: spectra and maps of the parts of a frame: `part_views`, `part_maps`.
- `restored`: specs from the plain values that a result is stored with: `restored`.
- `csv_cells`: cells of tables that spreadsheets read: `safe_cell`.
- `reception`: the signals that one radar receives in one frame: `Reception`.
- `ghost_radars`: the radar that causes each ghost: `radars_of_ghosts`.
- `recent_results`: paths and signals that trials on one street share: `RecentResults`.
- `trial`: all stages in order, from the traffic to the score: `run_trial`, `trace_frame`.
- `check`: problems of a study and resolutions of its radars, before it runs: `check`.
- `provenance`: canonical text and hash of a study, versions: `provenance`, `canonical_json`.
- `store`: a run on disk: `save.save_run`, `load.load_run`.
- `monte_carlo`: many trials over a grid.
- `section_v`: the correlation experiment of the paper.
- `paper`: the scenarios and statistics of the paper.
- `roc`: detection probability over the threshold.
"""
