"""A run on disk: one Zarr 3 group with samples, parts, paths, detections, truth and provenance.

.. code-block:: text

    run.zarr                          attributes: format, version, provenance, names of victims,
    │                                 radars and actors
    └── victim-0                      attributes: name, antenna array, high-pass, part, the names
        │                             of the parts, and neglected, V
        ├── samples                   V (channel, ramp, fast)
        ├── parts                     V (part, channel, ramp, fast)
        ├── times/first …             s (ramp); attribute rate, 1/s
        ├── schedule/start_time …     (ramp)
        ├── paths/delay …             (path), (bounce); attributes reference_time, s, frequency, Hz
        ├── detections/range …        (detection); attributes time, s, and num_unresolved
        ├── truth/range …             (target), place_range (place); attributes time, s, and name
        ├── placement/box_centre …    (body, xyz); radar_position …, (xyz); attributes time, s, name
        └── score/range_error …       (target), power, nature, body, radar (detection)

Every array names its axes and its unit. Every axis has a coordinate, an array of its own name: the
names of parts, targets, bodies, angles and x, y, z; seconds after a ramp's first sample for
``fast``; numbers for all others. So xarray opens a run with coordinates:
``xarray.open_datatree("run.zarr", engine="zarr")``.

The modules; others use the names beside them:

- `layout`: names, units and version of what is stored.
- `groups`: all arrays of a victim with their axes, units and coordinates: `groups_of`.
- `save`: `save_run`.
- `load`: `load_run`, `StoredRun`, `StoredVictim`, `stored_hash`.
"""
