r"""ESPRIT (Roy and Kailath 1989): directions from two equal parts of an array, shifted by δ.

Every element of the second part is δ to the left of, or above, its partner in the first one. With
:math:`E_s` the signal subspace of the snapshots, and its rows of both parts,

.. math:: E_2 = E_1 \Psi, \qquad \Psi = T\,\mathrm{diag}(e^{-j2\pi\delta u_k})\,T^{-1},

Ψ by least squares. An array with a shift along both axes gives a Ψ for each with the same T, which
are the eigenvectors of a weighted sum of both: so the cosines of one wave are paired (Rouquette and
Najim, IEEE Trans. Signal Process. 49 (2001) 237).

One wave on a uniform line of N elements has an error of :math:`\sqrt{N(N+1)/6(N-1)}` times the
Cramér–Rao bound: 1.05 for 4, 1.31 for 8, 1.54 for 12, since Ψ weighs all pairs equally.
"""

from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.errors import CapabilityError
from polychirp.receiver.angle.elements import SAME_PLACE, Elements

LEAST_SHARE = 1.0 / 3.0
"""Least number of pairs over that of elements; chosen: with fewer, most of the array is not used.
A row of four above a row of eight, all half a wavelength apart, has just as many."""

WEIGHT_OF_SECOND_AXIS = 0.7
"""Weight of the second axis in the sum whose eigenvectors pair the cosines. Chosen unequal to 1, so
that waves with exchanged cosines differ in the sum."""


class Shift(NamedTuple):
    """Length of a shift, wavelengths, and numbers of the channels of both parts, ``(pair,)``."""

    length: float
    first: IntArray
    second: IntArray


def shift_along(elements: Elements, axis: int) -> Shift | None:
    """The shortest shift along an axis with `LEAST_SHARE` of pairs; None if there is none.

    >>> elements = Elements(place=[[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]])
    >>> shift_along(elements, 1)
    Shift(length=0.5, first=array([0, 1]), second=array([2, 3]))
    """
    apart = elements.place - elements.place[:, None]  # (first, second, axis)
    is_along = (np.abs(apart[..., 1 - axis]) <= SAME_PLACE) & (apart[..., axis] > SAME_PLACE)
    lengths = np.sort(apart[is_along][:, axis])
    least = LEAST_SHARE * len(elements.place)
    for length in lengths[np.diff(lengths, prepend=-1.0) > SAME_PLACE]:
        first, second = np.nonzero(is_along & (np.abs(apart[..., axis] - length) <= SAME_PLACE))
        if first.size >= least:
            return Shift(float(length), first, second)
    return None


def esprit(snapshots: ComplexArray, elements: Elements, *, num_waves: int) -> FloatArray:
    """Direction cosines of the waves, ``(detection, wave, 2)``; zero along an axis without extent.

    Parameters
    ----------
    snapshots : ``(detection, channel, snapshot)``

    Raises
    ------
    CapabilityError
        The array has no shift along one of its axes, or fewer pairs than there are waves.
    """
    vectors, _, _ = np.linalg.svd(elements.both_ways(snapshots), full_matrices=False)
    signal = vectors[..., :num_waves]
    if signal.shape[-1] < num_waves:
        raise CapabilityError(
            f"ESPRIT tells {num_waves} waves apart from as many snapshots or more, and there are "
            f"{snapshots.shape[-1]}"
        )
    shifts = {axis: _need_shift(elements, axis, num_waves) for axis in elements.axes}
    turns = [
        np.linalg.pinv(signal[:, shift.first]) @ signal[:, shift.second]
        for shift in shifts.values()
    ]
    together = sum(w * turn for w, turn in zip((1.0, WEIGHT_OF_SECOND_AXIS), turns, strict=False))
    _, basis = np.linalg.eig(together)
    out = np.zeros((len(snapshots), num_waves, 2))
    for (axis, shift), turn in zip(shifts.items(), turns, strict=True):
        turned = np.diagonal(np.linalg.solve(basis, turn @ basis), axis1=1, axis2=2)
        out[..., axis] = -np.angle(turned) / (2.0 * np.pi * shift.length)
    return out


def _need_shift(elements: Elements, axis: int, num_waves: int) -> Shift:
    shift = shift_along(elements, axis)
    if shift is None or shift.first.size < num_waves:
        raise CapabilityError(
            "ESPRIT needs a part of the array that equals another one, shifted "
            f"{('sideways', 'upwards')[axis]}, with as many elements as waves and a third of all; "
            "the estimator 'bartlett' reads any array"
        )
    return shift
