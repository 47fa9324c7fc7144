"""Receivers beside the default one.

- `triangular_pairing`: range and range rate from an up- and a down-beat, and the refusal of ramps
  that are not triangles: `range_and_rate`, `refuse_unpaired`.
- `paper_receiver`: the receiver as the paper describes it, for comparison: `PaperReceiver`.
"""
