"""Interfered frames with their parts, and measures of what methods of mitigation give back.

The modules in reading order; others use the names beside them:

- `hand_frames`: frames of points and chirps without a channel: `hand_frame`, `ChirpSequence`.
- `published`: signals of the literature: `tu_delft`, `arim`, `toth`, `ARIM_CELLS`.
"""
