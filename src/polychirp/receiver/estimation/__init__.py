"""Range, range rate and azimuth of each detection, refined to the Cramér–Rao bound."""
