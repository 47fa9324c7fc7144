"""Patches: missing samples of a frame as linear maps of known ones."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, IntArray
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated

Place = tuple[int | IntArray, int | IntArray]
"""Numbers of ramps and of samples: some samples of one ramp, or one sample of some ramps."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patch:
    """Missing samples as a linear map of known samples.

    Parameters
    ----------
    missing, known : places of the samples
    matrix : ``(missing, known)``
    """

    missing: Place
    known: Place
    matrix: ComplexArray


def patched(frame: IfFrame, hit: BoolArray, patches: Sequence[Patch]) -> Mitigated:
    """The frame with patches in place of samples that are hit; others that are hit get weight 0."""
    weight = (frame.times.is_sample & ~hit).astype(np.float64)
    for patch in patches:
        weight[patch.missing] = 1.0
    is_good = weight > 0

    def repair(samples: ComplexArray) -> ComplexArray:
        out = samples * is_good
        for patch in patches:
            out[(..., *patch.missing)] = samples[(..., *patch.known)] @ patch.matrix.T
        return np.asarray(out)

    return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)


def gaps(hit: BoolArray, order: int) -> Iterator[IntArray]:
    """Numbers of the missing samples of each gap that has good samples around it, on one ramp.

    Gaps with fewer than ``order`` good samples between them are one gap; gaps with fewer than that
    between them and an end of the ramp are left out. ``hit`` is the mask of missing samples.

    >>> missing = np.isin(np.arange(12), [0, 4, 6])
    >>> [gap.tolist() for gap in gaps(missing, 2)]
    [[4, 6]]
    """
    missing = np.flatnonzero(hit)
    apart = np.flatnonzero(np.diff(missing) > order) + 1
    for gap in np.split(missing, apart):
        if gap.size and gap[0] >= order and gap[-1] + order < hit.size:
            yield gap


def gaps_and_ends(hit: BoolArray, least: int) -> Iterator[IntArray]:
    """`gaps` and those at an end of the ramp, with ``least`` good samples on one side or on both.

    >>> missing = np.isin(np.arange(12), [0, 5, 7])
    >>> [gap.tolist() for gap in gaps_and_ends(missing, 3)]
    [[0], [5, 7]]
    """
    missing = np.flatnonzero(hit)
    apart = np.flatnonzero(np.diff(missing) > least) + 1
    for gap in np.split(missing, apart):
        if gap.size and (gap[0] >= least or gap[-1] + least < hit.size):
            yield gap
