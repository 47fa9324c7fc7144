"""Correlation of baseband signals over delay and Doppler shift, its lobes, and theory for ramps.

`base` defines the correlation of two signals, `lobes` measures its peak, `ambiguity` adds Doppler
shifts, `alignment` finds a reference in a short recording, `search` in a long one, and `theory` has
the closed forms for ramps.
"""
