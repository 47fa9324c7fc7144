"""Closed forms of mutual interference, to compare simulations with.

Each form states its source and its assumptions; [closed forms](docs/validation/closed-forms.md)
compares all of them with the numbers of their sources, with draws on their own assumptions, and
some with this simulator's channel. The modules in reading order:

- `link_budget`: powers of an echo and of another radar, and noise raised by chirps.
- `overlap`: probabilities that signals meet in time and band.
- `synchronous`: ghosts of radars with equal ramps, by their starts and clocks.
- `suppression`: gain of a target over interference of another slope.
- `roads`: interference of all radars of a road.
- `access`: number of radars that a road has room for.
"""
