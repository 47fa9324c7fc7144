r"""Strong points outside of the receiver's limits, which the search must subtract.

A point at range R leaves, at a range x resolution cells away, its coherent power times
:math:`(\pi x)^{-2}`. Where that exceeds the noise within the limits, the search must reach as far
as the point: then it is found, subtracted, and left out as one beyond the limits. A ghost of a
radar whose ramps start a little earlier has a negative range. The ghost of a radar with another
clock may have a range rate beyond the greatest speed, but beats within the map on all rising or on
all falling ramps; it counts where it stands out of the noise of single ramps, after the points
within the limits are subtracted: until then, beats of two of them may look like those of one.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import inlined, reordered
from polychirp.receiver.coherent.coherent_map import MapLimits
from polychirp.receiver.coherent.noise import medians
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.spectra import BINS_PER_SAMPLE

BINS_PER_BEAT = BINS_PER_SAMPLE // 2
"""Number of bins of `Spectra` in one of the power spectra here, which have two per beat cell."""

MARGIN = 4.0
"""Cells behind the outermost strong point to which the search reaches; chosen: its main lobe is
within them."""

LEAST_EXCESS = 0.5
"""Power over the median of all ranges, less one, up to which it counts as noise; chosen: five
deviations of the mean over 32 ramps and four channels."""

HANN_LOSS = 1.5
"""Power of a point in all samples of a ramp over that in its bin with Hann's window."""

GREATEST_SPEEDS = 3.0
"""Range rate, over the greatest speed, up to which fast points are looked for; chosen: a map over
such range rates takes three times as long."""

LEAST_ON_A_RAMP = 500.0
"""Least power of a fast point over the noise of a ramp's spectrum; chosen: ten times as much leaves
false detections of 17 dB, because the beats of one ramp spread over many range rates."""

LEAST_SHARE = 0.05
"""Least power of a fast point over that of the strongest point; chosen: what weaker ones leave is
50 dB below them, and with that mostly below the dynamic range."""

SHARE_OF_RAMPS = 0.8
"""Share of the ramps on which it must have that power; chosen: one half of them, all rising or all
falling, have the beats of another point by chance, and a burst may hide it on some."""

SHARE_OF_KIND = 0.5
"""Share of the rising or of the falling ramps on which a fast point must have that power after
points within the limits are subtracted; chosen: those that stand for it take less."""

GREATEST_DIFFERENCE = 2.0
"""Mean power on rising over that on falling ramps, or the inverse, of a fast point at most; chosen:
most pairs of beats of two points differ by more."""


def with_strong_points(
    seen: Observation, power: NDArray[np.float32], limits: MapLimits
) -> MapLimits:
    """The limits, with wider ones of range if there are strong points beyond them.

    ``power`` is that of the samples (`Spectra.hann_power`).
    """
    strong = _strong_ranges(seen, power, limits.range)
    return replace(limits, range=_widened(limits.range, strong))


def with_fast_points(
    seen: Observation, power: NDArray[np.float32], residual: Residual, limits: MapLimits
) -> MapLimits:
    """The limits, with wider ones of range rate if points leave strong ones beyond them.

    ``power`` is that of the samples with the points (`Spectra.hann_power`), and ``residual`` what
    the points leave.
    """
    left = residual.spectra.hann_power(seen, BINS_PER_BEAT)
    noise = np.maximum(medians(left), np.finfo(np.float32).tiny)
    least = np.maximum(LEAST_ON_A_RAMP * noise, LEAST_SHARE * np.max(power, axis=1))
    fast = _fast_rates(seen, power / least[:, None], left / least[:, None], limits.range_rate)
    return replace(limits, range_rate=_widened(limits.range_rate, fast))


def _widened(limits: tuple[float, float], places: FloatArray) -> tuple[float, float]:
    """The limits, or wider ones that hold all places."""
    least, greatest = limits
    return float(np.min(places, initial=least)), float(np.max(places, initial=greatest))


def _strong_ranges(
    seen: Observation, power: NDArray[np.float32], limits: tuple[float, float]
) -> FloatArray:
    """Ranges beyond the limits at which strong points are, with a margin, m.

    The spectra of all ramps show the points, averaged at equal ranges without regard to speeds.
    """
    slope, cell = seen.model.schedule.slope, seen.range_cell
    distance = _ranges_in_band(seen, 0.5 * cell)
    per_range = 2.0 / SPEED_OF_LIGHT * slope * power.shape[1] / seen.model.times.rate
    place = np.rint(distance * per_range[:, None]).astype(np.int64) % power.shape[1]
    profile = np.take_along_axis(power, place, axis=1).mean(axis=0)
    noise = max(float(np.median(profile)), np.finfo(np.float64).tiny)
    excess = np.maximum(profile / noise - 1.0 - LEAST_EXCESS, 0.0)
    total = HANN_LOSS * seen.num_used * len(seen.samples) * excess
    apart = np.maximum(limits[0] - distance, distance - limits[1]) / cell
    is_strong = (apart > 0.0) & (total > (np.pi * np.maximum(apart, 1.0)) ** 2)
    strong = distance[is_strong & ~_folds_within(seen, distance, limits)]
    margin = np.where(strong < limits[0], -MARGIN, MARGIN) * cell
    return np.asarray(strong + margin)


def _folds_within(
    seen: Observation, distance: FloatArray, limits: tuple[float, float]
) -> BoolArray:
    """Mask of ranges whose beats on all ramps are those of a range within the limits.

    On ramps of one steepness S, beats differ by the sampling rate r over cr/2S. A receiver of
    complex samples whose limits reach beyond half of that sees such a range twice in the band.
    """
    steepness = np.abs(seen.model.schedule.slope)
    if np.ptp(steepness) > 0.0:
        return np.zeros(distance.size, dtype=np.bool_)
    span = 0.5 * SPEED_OF_LIGHT * seen.model.times.rate / float(steepness[0])
    slack = MARGIN * seen.range_cell
    folded = distance[:, None] + span * np.array([-1.0, 1.0])
    is_within = (folded > limits[0] - slack) & (folded < limits[1] + slack)
    return np.asarray(np.any(is_within, axis=1))


def _fast_rates(
    seen: Observation,
    power: NDArray[np.float32],
    left: NDArray[np.float32],
    limits: tuple[float, float],
) -> FloatArray:
    """Range rates beyond the limits at which strong points may be, with a margin, m/s.

    ``power`` of strong points is above 1, and so is ``left``, what other points leave of it.
    """
    times, slope = seen.model.times, seen.model.schedule.slope
    stands_out = np.max(left, axis=1) >= 1.0
    kinds = [stands_out[kind] for kind in (slope > 0.0, slope <= 0.0) if np.any(kind)]
    if all(np.mean(kind) < SHARE_OF_KIND for kind in kinds):
        return np.zeros(0)  # no place can stand out on enough ramps
    cell, bins = seen.range_cell, power.shape[1] / times.rate
    step = cell * float(np.min(np.abs(slope)) / np.mean(seen.frequency))
    rate = np.concatenate(
        [end * np.arange(1.0, GREATEST_SPEEDS, step / abs(end)) for end in limits]
    )
    by_range = 2.0 / SPEED_OF_LIGHT * slope
    by_rate = 2.0 / SPEED_OF_LIGHT * (slope * (seen.middle - seen.model.time) + seen.frequency)
    is_there = _stand_out(
        (power, left),
        slope > 0.0,
        (by_range * bins, by_rate * bins),
        (_ranges_in_band(seen, 0.5 * cell), rate),
        (missing_ramps(len(power)), GREATEST_DIFFERENCE),
    )
    fast = rate[is_there]
    return np.asarray(fast + np.sign(fast) * step)


def missing_ramps(count: int) -> int:
    """Greatest number of ``count`` ramps that may not show a fast point."""
    return int((1.0 - SHARE_OF_RAMPS) * count)


def _ranges_in_band(seen: Observation, step: float) -> FloatArray:
    """Ranges whose beats are within the band on all ramps, if the points do not move, m."""
    last = 0.25 * seen.model.times.rate * SPEED_OF_LIGHT
    last /= float(np.max(np.abs(seen.model.schedule.slope)))
    return np.arange(-last, last, step)


@reordered
def _stand_out(
    powers: Any, rises: Any, per_bin: Any, axes: Any, limits: Any
) -> Any:  # pragma: no cover - compiled
    """Mask of the range rates at which a point at any range stands out of enough ramps.

    It does so before points are subtracted, and afterwards on all ramps or on those of one kind.

    Parameters
    ----------
    powers : of the samples and of what points leave, over the least power that stands out, each
        ``(ramp, bin)``
    per_bin : bins per metre and per metre per second, ``(ramp,)``
    axes : ranges, m, and range rates, m/s
    limits : number of ramps that may miss the point, greatest ratio of the powers of rising and
        falling ones
    """
    power, left = powers
    allowed, ratio = limits
    ramps, size = power.shape
    out = np.zeros(axes[1].size, dtype=np.bool_)
    # of falling and of rising ramps: their number, sums of powers, number of those that stand out
    number, before, after, shown = np.zeros(2), np.empty(2), np.empty(2), np.empty(2)
    for k in range(ramps):
        number[1 if rises[k] else 0] += 1.0
    for v in range(axes[1].size):
        for r in range(axes[0].size):
            missed = 0
            before[:], after[:], shown[:] = 0.0, 0.0, 0.0
            for k in range(ramps):
                place = per_bin[0][k] * axes[0][r] + per_bin[1][k] * axes[1][v]
                is_in_band = abs(place) < 0.5 * size
                b, side = int(np.rint(place)) % size, 1 if rises[k] else 0
                missed += not is_in_band or power[k, b] < 1.0
                if missed > allowed:
                    break
                if is_in_band:
                    before[side] += power[k, b]
                    after[side] += left[k, b]
                    shown[side] += left[k, b] >= 1.0
            if missed <= allowed:
                on_all = shown[0] + shown[1] >= ramps - allowed
                out[v] = (
                    out[v]
                    or (on_all and _is_even(after, number, ratio))
                    or (_is_on_one_kind(shown, number) and _is_even(before, number, ratio))
                )
    return out


@inlined
def _is_on_one_kind(shown: Any, number: Any) -> bool:  # pragma: no cover - compiled
    """True if enough of the falling or enough of the rising ramps show a point."""
    falling, rising = SHARE_OF_KIND * number[0], SHARE_OF_KIND * number[1]
    return bool(shown[0] >= max(falling, 1.0) or shown[1] >= max(rising, 1.0))


@inlined
def _is_even(total: Any, number: Any, ratio: float) -> bool:  # pragma: no cover - compiled
    """True if the mean powers of falling and of rising ramps differ by a ratio at most."""
    if min(number[0], number[1]) == 0.0:
        return True
    falling, rising = total[0] / number[0], total[1] / number[1]
    return bool(max(falling, rising) <= ratio * min(falling, rising))
