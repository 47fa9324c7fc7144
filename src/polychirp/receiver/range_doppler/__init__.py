"""The usual chain for equal chirps: Fourier transforms over range and range rate, then CFAR.

- `transforms`: windowed transforms of the samples; which ramps they can read: `unfit`.
- `peaks`: maxima of a map between its cells.
- `side_lobes`: what strong points, and gaps in their samples, leave elsewhere in a map.
- `overlapping`: two targets in one cell of a code.
- `unfolding`: range rates beyond a code's span, and the virtual array's channels.
- `fold_ambiguity`: whether an array and its code tell these range rates apart.
- `subframes`: ramps in runs of different intervals; which frames the receiver can read.
- `association`, `combination`: range rates that the folds of all subframes agree on.
- `chain`: all of these in order: `RangeDoppler`.
"""
