"""Link budgets: signals between two radars, at which power and delay.

In reading order:

* `links`: `Links` of the traced paths of a transmitter and a victim, antennas included
* `leakage`: links of a radar to itself, and `all_links` of both kinds
* `thermal_noise`: density and samples of the victim's noise
* `interferer_culling`: `audible_radars`, the interferers that cannot be left out
"""
