"""Stored runs in the formats of other tools; each file is written by the library that defines it.

The modules in reading order; others use `formats`:

- `formats`: the formats by name, and `export`.
- `columns`: detections, targets, paths and ramps as tables.
- `stamps`: times as seconds and nanoseconds.
- `csv_tables`, `matlab`, `hdf5`, `netcdf`, `sigmf_samples`, `osi`, `rosbag`: one format each.
- `dataset_files`: datasets of frames in HDF5 and MATLAB files.
- `whole_file`: files of an export are written all or not at all, in place of those of earlier runs.
"""
