"""Azimuths that change within a frame, and the bound on the errors of all estimates.

- `azimuth_rate`: azimuth and its rate in terms of the motion: `sine_basis`, `snapshots_at_start`.
- `cramer_rao`: the Cramér–Rao bound of range, range rate and azimuth: `cramer_rao_bound`.
"""
