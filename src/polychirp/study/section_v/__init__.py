"""The correlation experiment of section V of the paper.

The modules in reading order; others may use the names beside them:

- `cases`: the pairs of waveforms, computed and modelled: `run_correlation`.
- `operands`: two signals of any origin, made comparable: `Operand`, `paired`.
"""
