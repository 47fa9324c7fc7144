"""Link budgets: power and delay of the signals between two radars.

In reading order:

* `links`: `Links` of the traced paths from a transmitter to a victim, antennas included
* `leakage`: links of a radar to itself, and `all_links`, which joins them to the traced ones
* `thermal_noise`: density and samples of the victim's noise
* `interference_levels`: interference over noise of a frame, and energy while listening, without
  samples
* `interferer_culling`: `audible_radars`, the interferers that cannot be left out
"""
