"""Recorded converter samples become an `IfFrame`: NumPy arrays and TI's raw files.

`ti_profile` reads the chirps of a radar from files of TI's tools (`ChirpProfile`), by means of
`ti_files` (the formats) and `ti_tables` (their contents); `ti_stream` adds the layout of the raw
files that were recorded with them.
"""
