"""Alignment of a recording with its reference: sample rate, carrier, delay, frequency offset."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.correlation.ambiguity import ambiguity
from polychirp.correlation.base import correlate
from polychirp.correlation.lobes import lobes
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband

PEAK_OVERSAMPLING: Final = 8
"""Lags per sample at which the peak is searched. Chosen: accuracy of the delay against time."""

MOST_SHIFTS: Final = 20_001
"""Greatest number of Doppler shifts that are tried. Chosen: it limits the time of a search."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Aligned:
    """A recording aligned with its reference.

    Parameters
    ----------
    signal : the recording, with the length, sample rate and carrier of the reference
    delay : s, delay that was removed
    frequency_offset : Hz, offset that was removed
    """

    signal: Baseband
    delay: float
    frequency_offset: float = 0.0


def comparable(signal: Baseband, reference: Baseband) -> Baseband:
    """The signal at the reference's sample rate and carrier.

    `InputError` is raised if the carriers differ by at least the mean of the sample rates, so that
    the bands of the two signals do not overlap.
    """
    gap = abs(signal.centre_frequency - reference.centre_frequency)
    reach = 0.5 * (signal.sample_rate + reference.sample_rate)
    if gap >= reach:
        raise InputError(
            f"carriers of {signal.centre_frequency / 1e9:g} and "
            f"{reference.centre_frequency / 1e9:g} GHz are farther apart than what the samples "
            f"cover ({reach / 1e6:g} MHz): the two share no frequency; compare basebands instead"
        )
    if gap == 0.0:
        return signal.resampled(reference.sample_rate)
    wide = 2.0 * max(gap + 0.5 * signal.sample_rate, 0.5 * reference.sample_rate)
    tuned = signal.resampled(wide).retuned(reference.centre_frequency)
    return tuned.resampled(reference.sample_rate)


def at_baseband(signal: Baseband) -> Baseband:
    """The same samples without a carrier, so that basebands can be compared."""
    return replace(signal, centre_frequency=0.0)


def aligned(signal: Baseband, reference: Baseband, *, greatest_offset: float = 0.0) -> Aligned:
    """Find the reference in a recording, and remove its delay and frequency offset.

    The peak of the ambiguity function is searched up to ± ``greatest_offset`` Hz. For a single ramp
    an offset f is nearly equivalent to a delay of −f/slope: along this ridge the peak falls by only
    f/bandwidth. A triangle separates the two. `InputError` is raised if rates or carriers differ,
    or the offset would need more than `MOST_SHIFTS` shifts.

    >>> draw = np.random.default_rng(1).standard_normal(500) + 0j
    >>> reference = Baseband(samples=draw, sample_rate=1e6)
    >>> late = Baseband(samples=np.concatenate([np.zeros(40), draw]), sample_rate=1e6)
    >>> round(aligned(late, reference).delay * 1e6, 6)
    40.0
    """
    offset = _offset(signal, reference, greatest_offset) if greatest_offset > 0 else 0.0
    turned = _turned(signal, reference, offset)
    place = lobes(correlate(turned, reference, oversampling=PEAK_OVERSAMPLING)).lag
    return Aligned(
        signal=replace(reference, samples=turned.at(reference.time + place)),
        delay=place,
        frequency_offset=offset,
    )


def _turned(signal: Baseband, reference: Baseband, offset: float) -> Baseband:
    if offset == 0.0:
        return signal
    time = signal.time - reference.start_time
    return replace(signal, samples=signal.samples * np.exp(-2j * np.pi * offset * time))


def _offset(signal: Baseband, reference: Baseband, greatest: float) -> float:
    """Doppler shift of the ambiguity function's peak, Hz: on half a cell, then by a parabola."""
    step = 0.5 / reference.duration
    count = int(np.ceil(greatest / step))
    if 2 * count + 1 > MOST_SHIFTS:
        raise InputError(
            f"a search for an offset of up to {greatest:g} Hz would try {2 * count + 1} shifts, "
            f"{step:.3g} Hz apart; search for less than {0.5 * MOST_SHIFTS * step:.3g} Hz"
        )
    shifts = step * np.arange(-count, count + 1)
    reach = max(signal.duration, reference.duration) + abs(signal.start_time - reference.start_time)
    best = np.array(
        [
            np.abs(ambiguity(signal, reference, doppler=shift, greatest_lag=reach).amplitude).max()
            for shift in shifts[:, None]
        ]
    )
    top = int(np.argmax(best))
    if not 0 < top < shifts.size - 1:
        return float(shifts[top])
    left, middle, right = best[top - 1 : top + 2]
    bend = left - 2.0 * middle + right
    return float(shifts[top] + (0.5 * step * (left - right) / bend if bend else 0.0))
