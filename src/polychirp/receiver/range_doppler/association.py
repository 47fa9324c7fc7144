r"""Association of the detections of subframes, and the range rates that their folds agree on.

A target with the range rate v appears in subframe b at :math:`v_b = v` modulo the span
:math:`S_b`, with a variance :math:`\sigma_b^2`. For each candidate v, within half the span of all
subframes together, the logarithm of the likelihood is

.. math:: -\tfrac12 \sum_b \frac{\langle v_b - v\rangle_{S_b}^2}{\sigma_b^2}
          + \text{the same of range, azimuth and power},

with differences folded into :math:`\pm S_b/2`. A target that passes has a radial acceleration a, as
it turns about the radar: :math:`a = v_t^2/R \ge 0` with the speed :math:`v_t` across the line of
sight. Its range rate at the time :math:`t_b` is :math:`v + a\,(t_b - t)`, and a is fitted with v,
from 0 to a limit that depends on the range. This is the Chinese remainder theorem in the form
that bears errors: the maximum over v is sought and not a common multiple (Ferrari, Bérenguer and
Alengrin 1997, IEEE Trans. AES 33, 738; Xia and Wang 2007, IEEE Signal Process. Lett. 14, 247). The
candidates are the detections of the first subframe, each with all of its folds, and the nearest
detection of each other subframe. Ranges are compared where the candidate v moves the target.

A target must be detected in all subframes. Two targets may share a detection in some of them, since
their folded range rates can agree there. So the candidates are taken in order of their likelihood,
and each must explain a detection that none before it explains. A target whose best two candidates
are almost equally likely has an unresolved speed, and is dropped; the number of detections that
belong to no target is counted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.receiver.range_doppler.subframes import wrapped

GREATEST_DISTANCE: Final = 30.0
"""Greatest sum of squares, in variances, of the differences between two subframes, and of the range
rates of all subframes from those of one motion. Chosen: it is above that of all but 5e-6 of the
right associations, with four differences."""

LEAST_MARGIN: Final = 9.0
"""Least difference of two candidates' sums of squares. Chosen: the better is then 90 times as
likely; with less, the range rate is unresolved."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SubframeDetections:
    """Detections of one subframe, each array ``(detection,)``.

    Parameters
    ----------
    time : s, to which the ranges refer
    span : m/s, of the range rates that the subframe tells apart
    beat_range : m, of the beat: the range with the shift by the range rate
    range_rate : m/s, folded
    left : direction cosine to the left, NaN if it is unknown
    level : logarithm of the power
    acceleration : greatest radial acceleration of a target at this range, m/s²
    range_variance, rate_variance, left_variance, level_variance : of the values above
    """

    time: float
    span: float
    beat_range: FloatArray
    range_rate: FloatArray
    left: FloatArray
    level: FloatArray
    acceleration: FloatArray
    range_variance: FloatArray
    rate_variance: FloatArray
    left_variance: FloatArray
    level_variance: float


class Associated(NamedTuple):
    """Targets, with the number of the detection of each subframe, ``(target, subframe)``.

    ``range_rate`` is m/s and ``acceleration`` m/s² ``(target,)``. ``num_unresolved`` is the number
    of detections that belong to no target, in the subframe with most of them.
    """

    member: IntArray
    range_rate: FloatArray
    acceleration: FloatArray
    num_unresolved: int


class _Candidates(NamedTuple):
    """Members ``(candidate, subframe)``, motions and sums of squares ``(candidate,)``."""

    member: IntArray
    range_rate: FloatArray
    acceleration: FloatArray
    distance: FloatArray


def associated(parts: Sequence[SubframeDetections], *, span: float, time: float) -> Associated:
    """The targets that all subframes agree on, most likely first.

    Parameters
    ----------
    span : m/s, of the range rates that are tried, half of it on either side of 0
    time : s, to which the targets' range rates refer
    """
    found = _candidates(parts, span, time)
    order = np.argsort(found.distance, kind="stable")
    taken: list[int] = []
    explained: set[tuple[int, int]] = set()
    for number in order:
        members = set(enumerate(found.member[number].tolist()))
        if not members <= explained:
            taken.append(int(number))
            explained |= members
    kept = [number for number in taken if _is_resolved(found, number, taken)]
    member = found.member[kept]
    left = [
        part.range_rate.size - np.unique(of_part).size
        for part, of_part in zip(parts, member.T, strict=True)
    ]
    return Associated(
        member=member,
        range_rate=found.range_rate[kept],
        acceleration=found.acceleration[kept],
        num_unresolved=max(left, default=0),
    )


def _is_resolved(found: _Candidates, number: int, taken: Sequence[int]) -> bool:
    """True if no other candidate of the same first detection is almost as likely.

    Candidates that need a detection of another target that was taken do not count.
    """
    others = [other for other in taken if other != number]
    elsewhere = {
        (b, int(found.member[other, b]))
        for other in others
        for b in range(1, found.member.shape[1])
    }
    rivals = np.flatnonzero(
        (found.member[:, 0] == found.member[number, 0])
        & (found.distance < found.distance[number] + LEAST_MARGIN)
    )
    return all(
        int(rival) in (number, *others)
        or any(step in elsewhere for step in enumerate(found.member[rival].tolist()))
        for rival in rivals
    )


def _candidates(parts: Sequence[SubframeDetections], span: float, time: float) -> _Candidates:
    """All folds of the first subframe's detections to which every other subframe has a match."""
    first, *others = parts
    most = math.ceil(0.5 * span / first.span + 0.5)
    rate = first.range_rate[:, None] + first.span * np.arange(-most, most + 1)
    start, fold = np.nonzero(np.abs(rate) <= 0.5 * span)
    rate = rate[start, fold]
    member = [start]
    is_found = np.ones(start.size, dtype=np.bool_)
    rest = np.zeros(start.size)
    for part in others:
        if part.range_rate.size == 0:
            none = rate[:0]
            return _Candidates(np.empty((0, len(parts)), dtype=np.int64), none, none, none)
        of_rate, of_others = _squares(first, part, start, rate)
        total = of_rate + of_others
        best = np.argmin(total, axis=1)
        row = np.arange(start.size)
        is_found &= total[row, best] <= GREATEST_DISTANCE
        rest += of_others[row, best]
        member.append(best)
    together = np.stack(member, axis=1)
    motion = _fitted_motion(parts, together, rate, time)
    is_found &= motion.squares <= GREATEST_DISTANCE
    return _Candidates(
        together[is_found],
        motion.range_rate[is_found],
        motion.acceleration[is_found],
        (motion.squares + rest)[is_found],
    )


def _squares(
    first: SubframeDetections, part: SubframeDetections, start: IntArray, rate: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Squares over variances ``(candidate, detection of part)``: of range rates; of all others."""

    def over(difference: FloatArray, one: FloatArray, other: FloatArray) -> FloatArray:
        return np.asarray(difference**2 / (one[start][:, None] + other))

    late = part.time - first.time
    folded = wrapped(part.range_rate - rate[:, None], part.span)
    folded -= np.clip(folded, 0.0, late * first.acceleration[start][:, None])
    moved = first.beat_range[start] + rate * late
    away = part.beat_range - moved[:, None]
    turned = np.nan_to_num(part.left - first.left[start][:, None])
    louder = part.level - first.level[start][:, None]
    others = (
        over(away, first.range_variance, part.range_variance)
        + over(turned, first.left_variance, part.left_variance)
        + louder**2 / (first.level_variance + part.level_variance)
    )
    return over(folded, first.rate_variance, part.rate_variance), others


class _Motion(NamedTuple):
    """Range rates, accelerations and sums of squares over variances, each ``(candidate,)``."""

    range_rate: FloatArray
    acceleration: FloatArray
    squares: FloatArray


def _fitted_motion(
    parts: Sequence[SubframeDetections], member: IntArray, rate: FloatArray, time: float
) -> _Motion:
    """Most likely range rates near ``rate`` at a time, and radial accelerations in their limits."""
    columns = list(zip(parts, member.T, strict=True))
    off = np.stack([wrapped(part.range_rate[k] - rate, part.span) for part, k in columns])
    weight = np.stack([1.0 / part.rate_variance[k] for part, k in columns])
    total = np.sum(weight, axis=0)
    weight = weight / total
    late = np.array([[part.time - time] for part in parts])
    middle, mean = np.sum(weight * late, axis=0), np.sum(weight * off, axis=0)
    after, above = late - middle, off - mean
    lever = np.sum(weight * after**2, axis=0)
    steepness = np.sum(weight * after * above, axis=0) / np.where(lever > 0.0, lever, 1.0)
    acceleration = np.clip(steepness, 0.0, parts[0].acceleration[member[:, 0]])
    squares = total * np.sum(weight * (above - acceleration * after) ** 2, axis=0)
    return _Motion(rate + mean - acceleration * middle, acceleration, squares)
