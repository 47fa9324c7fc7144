"""The tracer `PointVehicles`: a vehicle is a box that blocks rays, with a few points that echo.

`tracer` holds the specification that a study names. It uses `paths` (line of sight, mirrors and
echoes), `scattering_points` (places and cross sections of the points, with `VehicleModel`) and
`occlusion_boxes` (points that boxes and plates hide). Other packages use `tracer.PointVehicles`;
tests and tools may use `scattering_points` and `occlusion_boxes`.
"""
