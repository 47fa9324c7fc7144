"""Range, range rate and azimuth of points, refined to the Cramér–Rao bound.

- `beat_refinement`: range and rate from the beats of all ramps: `range_and_rate_from_beats`.
- `coherence_test`: tests that a candidate is one moving point: `coherence`, `is_on_both_slopes`.
- `phase_refinement`: motion from the phases of the whole frame: `read_points`, `coherent_steps`.
- `two_targets_per_cell`: two points in one cell: `Pairs`.
- `azimuth_rate`: azimuths that change within the frame: `snapshots_at_start`.
- `cramer_rao`: the bound on the errors of all these estimates: `cramer_rao_bound`.
"""
