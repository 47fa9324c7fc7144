"""The receiver of two interleaved sequences of steps of constant frequency (MFSK).

* `staircase`: the two sequences of a schedule, and the refusal of others: `Staircase`
* `solution`: range and range rate from a beat and a phase, and the pairs that look alike
* `steps`: one value of each step, and the spectra of both sequences: `Steps`
* `step_limits`: frames that cannot be read as they are, and why
* `chain`: `MfskReceiver`, the receiver
"""
