"""Burg's extrapolation from both sides of a gap, along the ramp or from ramp to ramp."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, IntArray
from polychirp.errors import CapabilityError, InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.base import Mitigated, refuse_frame
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.mitigation.patches import Patch, Place, gaps_and_ends, patched
from polychirp.receiver.signal_model.equal_ramps import unequal
from polychirp.units import Between

SEGMENT_FACTOR = 40
"""Greatest number of good samples beside a gap that a model uses, over its order. Chosen: mostly
all samples up to the next gap. Rameez, Dahl and Pettersson ask for more than 2. On the signal of TU
Delft, 4, 8, 16 and 40 give 10.1, 12.2, 13.8 and 14.4 dB at order 60; 14.9 dB are published."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Burg(BurstRepair):
    r"""Replace each gap by predictions from both sides, which are faded into each other.

    The model :math:`\hat x_n = -\sum_{k=1}^{P} a_k x_{n-k}` of the good samples before a gap is
    continued into it, that of the samples behind it backward. Of G missing samples the n-th is the
    sum of the former weighted by :math:`1 - (n + \tfrac12)/G` and of the latter weighted by
    :math:`(n + \tfrac12)/G` (Rameez, Dahl and Pettersson 2020). Coefficients are those of Burg's
    recursion (Marple 1987), whose models never grow; all channels share them. At an end of the ramp
    there is one prediction. Fewer than 2 P good samples between two gaps join them; a gap without
    2 P good samples on any side stays blank.

    "ramp" works along each ramp. "ramps" works on the samples of one number on all ramps, for which
    the ramps must be equal, and is the better one if bursts hit few ramps but much of these. A
    model takes 8 P N real multiplications with N good samples per channel, and each missing sample
    8 P per channel and 4 P² once. `Autoregression` fits both sides at once.

    Parameters
    ----------
    order : P, number of samples from which the next one is predicted
    along : "ramp" or "ramps"
    """

    kind: Literal["burg"] = "burg"
    order: Annotated[int, Between(greatest=1024)] = 32
    along: Literal["ramp", "ramps"] = "ramp"

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.order < 1:
            raise InputError("the order of Burg's model must be 1 or more")

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Refuse ramps that it cannot repair.

        Raises
        ------
        CapabilityError
            It works from ramp to ramp, and the ramps are not equal; or its detector cannot read
            them.
        """
        BurstRepair.refuse(self, schedule, times=times, is_real=is_real, num_channels=num_channels)
        reason = unequal(schedule) if self.along == "ramps" else ""
        if reason:
            raise CapabilityError(
                "the mitigation 'burg' along 'ramps' needs equal ramps, and of this schedule "
                f"{reason}; along 'ramp' works"
            )

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with predictions in place of the bursts."""
        refuse_frame(self, frame)
        hit = self.hit(frame)
        patches: list[Patch] = []
        if self.along == "ramp":
            for k in np.flatnonzero(hit.any(axis=1)):
                length = int(frame.times.num_samples[k])
                line = frame.samples[:, k, :length]
                patches += self._patches(line, hit[k, :length], int(k))
        else:
            ramps = np.arange(frame.schedule.num_ramps)
            for n in np.flatnonzero(hit.any(axis=0)):
                patches += [
                    Patch(
                        missing=_turned(patch.missing, ramps, int(n)),
                        known=_turned(patch.known, ramps, int(n)),
                        matrix=patch.matrix,
                    )
                    for patch in self._patches(frame.samples[:, :, n], hit[:, n], int(n))
                ]
        return patched(frame, hit, patches)

    def _patches(self, line: ComplexArray, hit: BoolArray, number: int) -> Iterator[Patch]:
        """Patches of one line of samples ``(channel, place)``."""
        order, least = self.order, 2 * self.order
        for missing in gaps_and_ends(hit, least - 1):
            first, last = int(missing[0]), int(missing[-1])
            inside = np.arange(first, last + 1)
            known: list[IntArray] = []
            maps: list[ComplexArray] = []
            before = _good_run(hit, first, -1, SEGMENT_FACTOR * order)
            if before.size >= least:
                model = burg_model(line[:, before[::-1]], order)
                maps.append(continuation(model, inside.size))
                known.append(before[:order][::-1])
            after = _good_run(hit, last, 1, SEGMENT_FACTOR * order)
            if after.size >= least:
                model = burg_model(line[:, after[::-1]], order)
                maps.append(continuation(model, inside.size)[::-1])
                known.append(after[:order][::-1])
            if not maps:
                continue
            if len(maps) == 2:
                share = ((np.arange(inside.size) + 0.5) / inside.size)[:, None]
                maps = [(1.0 - share) * maps[0], share * maps[1]]
            yield Patch(
                missing=(number, missing),
                known=(number, np.concatenate(known)),
                matrix=np.concatenate(maps, axis=1)[missing - first],
            )


def burg_model(samples: ComplexArray, order: int) -> ComplexArray:
    """Coefficients 1, a₁ … a_P of Burg's recursion, common to all channels.

    Parameters
    ----------
    samples : ``(channel, place)``, in the order of the prediction

    Examples
    --------
    One coefficient predicts a tone.

    >>> tone = np.exp(0.5j * np.arange(20))[None]
    >>> float(np.angle(-burg_model(tone, 1)[1]))
    0.500000
    """
    forward, backward = samples[:, 1:], samples[:, :-1]
    model = np.ones(1, dtype=np.complex128)
    for _ in range(order):
        energy = np.sum(np.abs(forward) ** 2) + np.sum(np.abs(backward) ** 2)
        reflection = -2.0 * np.vdot(backward, forward) / max(float(energy), 1e-300)
        longer = np.append(model, 0.0)
        model = longer + reflection * longer[::-1].conj()
        forward, backward = (
            forward[:, 1:] + reflection * backward[:, 1:],
            backward[:, :-1] + reflection.conjugate() * forward[:, :-1],
        )
    return model


def continuation(model: ComplexArray, length: int) -> ComplexArray:
    """Matrix from the last P samples, in order, to the ``length`` samples that follow.

    >>> continuation(np.array([1, -1j]), 3).round(12).ravel()
    array([ 0.+1.j, -1.+0.j,  0.-1.j])
    """
    order = model.size - 1
    rows = np.zeros((order + length, order), dtype=np.complex128)
    rows[:order] = np.eye(order)
    weight = -model[:0:-1]
    for n in range(length):
        rows[order + n] = weight @ rows[n : n + order]
    return rows[order:]


def _good_run(hit: BoolArray, end: int, step: int, most: int) -> IntArray:
    """Numbers of the good samples from beside ``end`` on, nearest first, up to the next hit one."""
    side = hit[end + 1 : end + 1 + most] if step > 0 else hit[:end][::-1][:most]
    length = int(np.argmax(side)) if side.any() else side.size
    return end + step * np.arange(1, length + 1)


def _turned(place: Place, ramps: IntArray, number: int) -> Place:
    """Place of a line along the ramps as a place of the frame."""
    return ramps[place[1]], number
