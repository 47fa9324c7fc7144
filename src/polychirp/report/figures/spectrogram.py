r"""Figure 4: the spectrogram of a schedule, in closed form.

A frame fills 1 GHz for 48 ms, which takes fifty million samples for a picture of half a million
cells. The short-time Fourier transform of a linear chirp with a Gaussian window is a Gaussian
integral, so every cell of the picture is computed in closed form, the ends of ramps included.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray
from polychirp.errors import CapabilityError
from polychirp.model.ramp import RampSchedule
from polychirp.report.figures.drawing import Column, Drawing, new_figure, styled

WINDOW_SHARE: Final = 1.0 / 2400.0
"""Standard deviation of the Gaussian window as a share of the time drawn; chosen: half a cell of
the picture in time, in which a ramp crosses some cells in frequency."""

MOST_RAMPS: Final = 48
"""Greatest number of ramps that are drawn unless a span is given; chosen: more would merge."""

WINDOW_REACH: Final = 6.0
"""Standard deviations beyond which the window is neglected (e^{-18} in amplitude)."""


def short_time_spectrum(
    schedule: RampSchedule, *, time: FloatArray, frequency: FloatArray, window: float
) -> ComplexArray:
    r"""Short-time Fourier transform of the signal of a schedule, ``(frequency, time)``, s.

    .. math:: S(t, f) = \int e^{-(u-t)^2/2\sigma^2}\, e^{j2\pi[\varphi(u) - f(u-t)]}\,du

    with φ of `RampSchedule`. On a ramp it is a difference of two complex error functions, computed
    by Faddeeva's function so that nothing overflows.

    Parameters
    ----------
    time : s, ``(time,)``
    frequency : Hz, radio frequency, ``(frequency,)``
    window : s, standard deviation σ of the Gaussian window

    Examples
    --------
    >>> tone = RampSchedule(start_time=[0.0], duration=[1.0], start_frequency=[1e3], slope=[0.0],
    ...     start_phase=[0.0], sweep=[0])
    >>> s = short_time_spectrum(tone, time=np.array([0.5]), frequency=np.array([1e3]), window=0.01)
    >>> float(abs(s[0, 0]) / (0.01 * np.sqrt(2 * np.pi)))  # the window's area
    1.0
    """
    total = np.zeros((frequency.size, time.size), dtype=np.complex128)
    for ramp in range(schedule.num_ramps):
        first, last = schedule.start_time[ramp], schedule.end_time[ramp]
        near = (time > first - WINDOW_REACH * window) & (time < last + WINDOW_REACH * window)
        if np.any(near):
            total[:, near] += _ramp_spectrum(schedule, ramp, time[near], frequency, window)
    return total


def _ramp_spectrum(
    schedule: RampSchedule, ramp: int, time: FloatArray, frequency: FloatArray, window: float
) -> ComplexArray:
    """Part of one ramp: its phasor at each ``time`` times ∫ exp(−p s² + 2qs) ds, s = u − t."""
    slope, elapsed = schedule.slope[ramp], time - schedule.start_time[ramp]
    at_time = schedule.start_frequency[ramp] + slope * elapsed
    phase = (
        schedule.start_phase[ramp]
        + schedule.start_frequency[ramp] * elapsed
        + 0.5 * slope * elapsed**2
    )
    p = 1.0 / (2.0 * window**2) - 1j * np.pi * slope
    q = 1j * np.pi * (at_time[None, :] - frequency[:, None])
    left, right = -elapsed, schedule.duration[ramp] - elapsed
    integral = _scaled_erf(p, q, right) - _scaled_erf(p, q, left)
    turn = np.exp(2j * np.pi * (phase % 1.0))
    return np.asarray(0.5 * np.sqrt(np.pi / p) * turn * integral)


def _scaled_erf(p: complex, q: ComplexArray, s: FloatArray) -> NDArray[np.complex128]:
    """exp(q²/p)·erf(√p s − q/√p), computed without erf, which may overflow."""
    from scipy.special import wofz

    root = np.sqrt(p)
    z = root * s - q / root
    sign = np.where(z.real >= 0.0, 1.0, -1.0)
    return np.asarray(
        sign * (np.exp(q**2 / p) - np.exp(-p * s**2 + 2.0 * q * s) * wofz(1j * sign * z))
    )


@styled
def spectrogram(
    schedule: RampSchedule,
    *,
    title: str,
    band: tuple[float, float] | None = None,
    span: tuple[float, float] | None = None,
) -> Drawing:
    """Spectrogram of a schedule down to 40 dB below its maximum; its data are the ramps.

    Parameters
    ----------
    title : text above the axes
    band : lowest and highest frequency drawn, Hz; `band_of` the schedule if absent
    span : first and last time drawn, s; the first `MOST_RAMPS` of the schedule if absent

    Raises
    ------
    CapabilityError
        The ramps carry a code, whose chips are not in this spectrogram.
    """
    if schedule.code is not None:
        raise CapabilityError(
            "the spectrogram of ramps shows no chips, and these ramps carry a code; the figure "
            "'spectrogram' shows the received samples"
        )
    low, high = band or band_of(schedule)
    first, last = span or (schedule.start_time[0], schedule.end_time[:MOST_RAMPS][-1])
    time = np.linspace(first, last, 1400)
    frequency = np.linspace(low, high, 420)
    power = np.abs(
        short_time_spectrum(
            schedule, time=time, frequency=frequency, window=WINDOW_SHARE * (last - first)
        )
    )
    level = 20.0 * np.log10(np.maximum(power / power.max(), 1e-3))

    figure = new_figure(11.0, 3.7)
    axes = figure.add_subplot()
    axes.grid(visible=False)
    image = axes.imshow(
        level,
        extent=(time[0] * 1e3, time[-1] * 1e3, low / 1e9, high / 1e9),
        origin="lower",
        aspect="auto",
        vmin=-40.0,
        vmax=0.0,
        interpolation="antialiased",
    )
    axes.set(title=title, xlabel="Time (ms)", ylabel="Frequency (GHz)")
    figure.colorbar(image, ax=axes, label="Power (dB)", pad=0.01, ticks=[-40, -30, -20, -10, 0])
    return Drawing(figure=figure, data=_ramps(schedule))


def band_of(*schedules: RampSchedule) -> tuple[float, float]:
    """Lowest and highest frequency of schedules, with a margin of 6 % of the band, Hz."""
    low = min(min(s.start_frequency.min(), s.stop_frequency.min()) for s in schedules)
    high = max(max(s.start_frequency.max(), s.stop_frequency.max()) for s in schedules)
    margin = 0.06 * (high - low)
    return float(low - margin), float(high + margin)


def span_of(*schedules: RampSchedule) -> tuple[float, float]:
    """First and last time of schedules, s."""
    return min(s.start_time[0] for s in schedules), max(s.end_time[-1] for s in schedules)


def _ramps(schedule: RampSchedule) -> dict[str, Column]:
    return {
        "sweep": schedule.sweep.astype(np.float64),
        "start_time_ms": schedule.start_time * 1e3,
        "duration_ms": schedule.duration * 1e3,
        "start_frequency_ghz": schedule.start_frequency / 1e9,
        "stop_frequency_ghz": schedule.stop_frequency / 1e9,
        "slope_ghz_per_ms": schedule.slope / 1e12,
    }
