r"""Samples of a `RampSchedule`, for the converter of a transmitting radio."""

import numpy as np

from polychirp.errors import InputError
from polychirp.model.baseband import Baseband
from polychirp.model.ramp import RampSchedule

MOST_SAMPLES = 200_000_000
"""Greatest number of samples of one signal; more are taken for a mistake in rate or duration."""


def band_edges(schedule: RampSchedule) -> tuple[float, float]:
    """Lowest and highest frequency of a schedule, Hz, with the band of its code."""
    low, high = schedule.occupied
    return float(low.min()), float(high.max())


def played(
    schedule: RampSchedule, *, sample_rate: float, centre_frequency: float | None = None
) -> Baseband:
    r"""Baseband samples of a schedule, from the start of its first ramp to the end of its last one.

    .. math:: s(t) = a(t)\,e^{j2\pi(\varphi(t) - f_c t)}

    with φ of `RampSchedule`, its chips a of `RampCode`, 1 without a code, and the carrier
    :math:`f_c`, by default the middle of the band. Chips are sampled as they are: what their
    spectrum has beyond the sample rate is folded into it. Between ramps s is zero. A ramp does not
    include the instant of its end. `InputError` is raised if the band exceeds ± half the sample
    rate about the carrier, or there are too many samples.

    >>> ramp = RampSchedule(start_time=[0.0], duration=[1e-4], start_frequency=[3.95e9],
    ...     slope=[1e12], start_phase=[0.0], sweep=[0])
    >>> played(ramp, sample_rate=130e6).num_samples
    13000
    """
    low, high = band_edges(schedule)
    centre = 0.5 * (low + high) if centre_frequency is None else centre_frequency
    reach = max(high - centre, centre - low)
    if 2.0 * reach > sample_rate * (1 + 1e-9):
        raise InputError(
            f"a band of {low / 1e9:.6g} to {high / 1e9:.6g} GHz about {centre / 1e9:.6g} GHz needs "
            f"{2 * reach / 1e6:.4g} MS/s, not {sample_rate / 1e6:.4g}; raise the sample rate or "
            "narrow the band"
        )
    begin, end = float(schedule.start_time[0]), float(schedule.end_time[-1])
    count = int(np.ceil((end - begin) * sample_rate * (1 - 1e-12)))
    if count > MOST_SAMPLES:
        raise InputError(
            f"{(end - begin) * 1e3:.4g} ms at {sample_rate / 1e6:.4g} MS/s are {count:.3g} "
            f"samples, more than {MOST_SAMPLES:.3g}; play fewer sweeps or lower the sample rate"
        )
    out = np.zeros(count, dtype=np.complex128)
    for ramp in range(schedule.num_ramps):
        _add(out, schedule, ramp, begin, sample_rate, centre)
    return Baseband(samples=out, sample_rate=sample_rate, centre_frequency=centre, start_time=begin)


def _add(
    out: np.ndarray, schedule: RampSchedule, ramp: int, begin: float, rate: float, centre: float
) -> None:
    start = float(schedule.start_time[ramp])
    # differences below a thousandth of a sample (chosen) are taken as rounding errors
    first, last = (
        int(np.ceil((moment - begin) * rate - 1e-3))
        for moment in (start, float(schedule.end_time[ramp]))
    )
    last = min(last, out.size)
    into = np.arange(first, last) / rate + (begin - start)
    turns = (float(schedule.start_phase[ramp]) - centre * start) % 1.0
    beat = float(schedule.start_frequency[ramp]) - centre
    bend = 0.5 * float(schedule.slope[ramp])
    out[first:last] = np.exp(2j * np.pi * (turns + (beat + bend * into) * into))
    if schedule.code is not None:
        out[first:last] *= schedule.code.sent(ramp, into + 1e-3 / rate)
