"""Receivers beside the default one.

- `triangular_pairing`: range and range rate from an up- and a down-beat: `range_and_rate`.
- `paper_receiver`: the receiver as the paper describes it, for comparison: `PaperReceiver`.
"""
