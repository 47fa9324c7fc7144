"""The usual chain for equal chirps: Fourier transforms over range and range rate, then CFAR.

- `transforms`: windowed transforms of the samples; which ramps they can read: `unfit`.
- `peaks`: maxima of a map between its cells.
- `overlapping`: two targets in one cell of a code.
- `unfolding`: range rates beyond a code's span, and the virtual array's channels.
- `subframes`: ramps in runs of different intervals; which frames the receiver can read.
- `association`, `combination`: range rates that the folds of all subframes agree on.
- `chain`: all of these in order: `RangeDoppler`.
"""
