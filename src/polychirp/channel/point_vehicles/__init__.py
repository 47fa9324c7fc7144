"""The tracer `PointVehicles`: vehicles are boxes that hide and a few points that echo.

`tracer` holds the specification that a study names. It uses `paths` (line of sight, mirrors and
echoes), `scattering_points` (places and cross sections of the points, with `VehicleModel`) and
`occlusion_boxes` (points that boxes and plates hide). Other packages use `tracer.PointVehicles`;
`scattering_points` and `occlusion_boxes` are open to tests and tools.
"""
