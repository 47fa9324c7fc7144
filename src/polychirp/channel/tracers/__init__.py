"""The ray tracers that a study may name, and interpolation of their paths in time.

`composite` joins all mechanisms of the package, `free_space` is the exact reference without
surfaces, and `sionna` adapts Sionna RT as an independent check. `path_interpolation` computes the
paths at all times of a frame from few traces, whose times `part_traces` chooses. Other packages use
`Composite`, `FreeSpace`, `SionnaRt` and `interpolate_paths`. The tracer `PointVehicles` is in
`channel.point_vehicles`.
"""
