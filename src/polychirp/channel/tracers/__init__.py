"""The ray tracers that a study may name, and interpolation of their paths in time.

`composite` joins all mechanisms of the package, `free_space` is the exact reference without
surfaces, and `sionna` adapts Sionna RT as an independent check. `path_interpolation` gives the
paths at all times of a frame, with few traces. Others use the classes `Composite`, `FreeSpace` and
`SionnaRt`, and the function `interpolate_paths`. (`PointVehicles` has a room of its own.)
"""
