"""Motion of a point from phases over the whole frame; its errors reach the Cramér–Rao bound.

Beats measure the range rate to a few cm/s. The phase from ramp to ramp measures it a hundred times
better, but with an ambiguity of half a wavelength per ramp interval. So beats are used first, and
phases refine the motion if the beats resolve this ambiguity and one motion fits all phases.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import reordered
from polychirp.model.if_frame import SampleTimes
from polychirp.receiver.estimation.azimuth_rate import ramp_weights
from polychirp.receiver.estimation.coherence_test import best_corrections
from polychirp.receiver.signal_model.frame_model import FrameModel
from polychirp.receiver.signal_model.point_signal import beat_sensitivity, path_of, path_slopes
from polychirp.receiver.signal_model.unit_signal import unit_signal_into

ONE_POINT_SHARE = 0.8
"""Least share of a point's power, less the noise in it, that adds up in phase over all ramps if the
point counts as one point. Chosen: points with less are tried as pairs of points in one cell."""

ALIAS_MARGIN = 3.0
"""Least distance from a range rate to the midpoint between it and its nearest alias, in standard
deviations of the rate from beats. Chosen: three, so that a wrong alias is rare."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Readings:
    """Mean and first moment in time of each ramp's samples, after each point's phase is removed.

    All samples have equal weight.

    Parameters
    ----------
    value : mean of the samples with the point's phase removed, ``(point, channel, ramp)``
    slope : mean of these samples times their time from ``middle``, s, ``(point, channel, ramp)``
    count : number of samples, ``(ramp,)``
    spread : mean square time of the samples from ``middle``, s², ``(ramp,)``
    middle : mean time of the ramp's samples, s, ``(ramp,)``
    """

    value: ComplexArray
    slope: ComplexArray
    count: FloatArray
    spread: FloatArray
    middle: FloatArray

    def turned(self, turn: ComplexArray) -> Self:
        """The readings times phasors ``turn``, ``(point, 1, ramp)``."""
        return replace(self, value=self.value * turn, slope=self.slope * turn)

    def of(self, point: int) -> Self:
        """The readings of the point with this number alone."""
        return replace(
            self, value=self.value[point : point + 1], slope=self.slope[point : point + 1]
        )


def read_points(
    samples: ComplexArray,
    present: BoolArray,
    times: SampleTimes,
    *,
    phases: FloatArray,
    amplitude: ComplexArray,
) -> Readings:
    """Readings of every point, from samples from which all other points are subtracted.

    The side lobes of the other points are subtracted with them, so that no window is needed and all
    samples have equal weight.

    Parameters
    ----------
    samples : of the frame, ``(channel, ramp, fast)``
    present : mask of the samples that are used, ``(ramp, fast)``
    phases : `beat_phase` of each point, ``(point, ramp, 3)``
    amplitude : of each point, ``(point, channel, ramp)``
    """
    count = np.maximum(np.sum(present, axis=1), 1).astype(np.float64)
    ticks = np.arange(present.shape[1])
    centre = np.sum(present * ticks, axis=1) / count
    spread = np.sum(present * (ticks - centre[:, None]) ** 2, axis=1) / count
    value, slope = _read(samples, present, phases, amplitude, centre, times.rate)
    return Readings(
        value=amplitude + value / count,
        slope=slope / count / times.rate,
        count=count,
        spread=spread / times.rate**2,
        middle=times.first + centre / times.rate,
    )


def coherent_steps(
    readings: Readings, model: FrameModel, *, motion: FloatArray, noise: float
) -> tuple[FloatArray, BoolArray]:
    """Corrections of range R, range rate v and acceleration a, and a mask of the points to correct.

    The corrections, ``(point, 3)``, fit one motion to the phases of all ramps. The mask,
    ``(point,)``, is true where the fit reaches `ONE_POINT_SHARE` and the rate is unambiguous.

    Parameters
    ----------
    motion : R, v, a with which the points were read, ``(point, 3)``
    noise : noise power per sample and channel
    """
    readings = readings.turned(model.high_pass_correction(motion))
    schedule, time = model.schedule, model.time
    steps, is_one = np.zeros((len(motion), 3)), np.zeros(len(motion), dtype=bool)
    frequency = schedule.start_frequency + schedule.slope * (readings.middle - schedule.start_time)
    elapsed = readings.middle - time
    phases = 4.0 * np.pi / SPEED_OF_LIGHT * frequency[:, None] * path_slopes(motion, elapsed)
    beat = 2.0 * np.pi * beat_sensitivity(schedule, model.times, time)
    cubic = _cubic(readings, model, frequency, motion)
    start = _first_guesses(readings, frequency, time)
    weight = readings.count * _amplitude_weights(readings)
    for p, phase in enumerate(phases):

        def change(step: FloatArray, p: int = p) -> FloatArray:
            ways = path_of(np.stack([motion[p] + step, motion[p]]), elapsed)[:2]
            way, rate = 4.0 * np.pi / SPEED_OF_LIGHT * (ways[:, 0] - ways[:, 1])
            return np.stack([frequency * way, schedule.slope * way + frequency * rate])

        def fitted(
            first: FloatArray, p: int = p, phase: FloatArray = phase
        ) -> tuple[FloatArray, float]:
            step = _fit_history(readings, p, phase, beat, first, cubic[p], change, weight[p])
            return step, _share(readings, p, np.exp(-1j * change(step)[0]), noise, weight[p])

        steps[p], share = fitted(start[p])
        if share < ONE_POINT_SHARE:
            straight = _without_acceleration(motion[p], readings, time)
            turned = readings.of(p).turned(np.exp(-1j * change(straight)[0])[None, None])
            again, its_share = fitted(straight + _first_guesses(turned, frequency, time)[0])
            if its_share > share:
                steps[p], share = again, its_share
        is_one[p] = share >= ONE_POINT_SHARE and _is_unambiguous(
            readings, p, beat, frequency, noise
        )
    return steps, is_one


def _without_acceleration(motion: FloatArray, readings: Readings, time: float) -> FloatArray:
    """Step to a motion without acceleration, of equal range and rate in the middle of the frame.

    Beats of weak points may give a wrong acceleration, e.g. 15 m/s². It adds a third derivative of
    range, 3va/R, for which no correction of rate and acceleration compensates: at 10 m and 20 m/s
    its phase at the end of a frame of 50 ms is one cycle.
    """
    half = float(np.mean(readings.middle)) - time
    acceleration = float(motion[2])
    return np.array([-0.5 * half**2, half, -1.0]) * acceleration


def _first_guesses(readings: Readings, frequency: FloatArray, time: float) -> FloatArray:
    """Corrections of (R, v, a) with which most power adds up in phase: ``(point, 3)``."""
    rate, acceleration = best_corrections(readings.value, frequency, readings.middle)
    offset = float(np.mean(readings.middle)) - time
    return np.stack(
        [
            0.5 * acceleration * offset**2 - rate * offset,
            rate - acceleration * offset,
            acceleration,
        ],
        axis=-1,
    )


def _cubic(
    readings: Readings, model: FrameModel, frequency: FloatArray, motion: FloatArray
) -> FloatArray:
    """Mean and tilt of the cubic phase that `beat_phase` neglects: ``(point, 2, ramp)`` rad, rad s.

    The cubic is (b a + f j/3) t³/c cycles at t after a ramp's first sample, with the ramp's slope b
    and frequency f, and the range's third derivative j = −3 v a/R. With t = h + u, u being the time
    from the ramp's middle, the means of the cubic and of the cubic times u (the tilt) follow from
    the means of u² and of u⁴; the latter is 9/5 of the former's square.
    """
    distance, rate, acceleration = path_of(motion, readings.middle - model.time)
    third = model.schedule.slope * acceleration - frequency * rate * acceleration / distance
    half, square = readings.middle - model.times.first, readings.spread
    mean = half**3 + 3.0 * half * square
    tilt = 3.0 * half**2 * square + 1.8 * square**2
    size = 2.0 * np.pi / SPEED_OF_LIGHT * third
    return np.stack([size * mean, size * tilt], axis=1)


def _fit_history(
    readings: Readings,
    p: int,
    phase: FloatArray,
    beat: FloatArray,
    step: FloatArray,
    cubic: FloatArray,
    change: Callable[[FloatArray], FloatArray],
    weight: FloatArray,
) -> FloatArray:
    """Gauss–Newton fit of (R, v, a) to the phases and beats of all ramps.

    ``change`` gives the exact changes of phase, rad, and beat, rad/s, by a step: ``(2, ramp)``.
    """
    value, slope = readings.value[p], readings.slope[p]
    columns = np.column_stack([phase, np.ones(len(phase))])
    beats = np.column_stack([beat, np.zeros(len(beat))])
    normal = (columns.T * weight) @ columns + (beats.T * (weight * readings.spread)) @ beats
    size = 1.0 / np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal * np.outer(size, size)) * np.outer(size, size)
    for _ in range(3):
        turned, beaten = change(step)
        turn = np.exp(-1j * turned)
        mean = (value * turn) @ weight / np.sum(weight)  # every channel has its own phase
        power = float(np.sum(np.abs(mean) ** 2)) + 1e-300
        along = np.angle(mean.conj() @ (value * turn))
        tilt = np.imag(mean.conj() @ (slope * turn)) / power - beaten * readings.spread
        right = columns.T @ (weight * (along - cubic[0])) + beats.T @ (weight * (tilt - cubic[1]))
        step = step + (inverse @ right)[:3]
    return step


def _amplitude_weights(readings: Readings) -> FloatArray:
    """Weights of the ramps, 0 … 1, ``(point, ramp)``, by `ramp_weights`.

    They fall with the squared deviation of a ramp's magnitudes from their median over all ramps.
    """
    magnitude = np.abs(readings.value)
    apart = magnitude - np.median(magnitude, axis=2, keepdims=True)
    return ramp_weights(np.sum(apart**2, axis=1) * readings.count)


def _share(
    readings: Readings, p: int, turn: ComplexArray, noise: float, ramp_weight: FloatArray
) -> float:
    """Power that adds up in phase over total power, each less the expected power of its noise."""
    value = readings.value[p]
    weight = ramp_weight / np.sum(ramp_weight)
    own = noise * value.shape[0]  # noise power of one sample, summed over channels
    together = float(np.sum(np.abs((value * turn) @ weight) ** 2))
    together -= own * float(np.sum(weight**2 / readings.count))
    every = float(np.sum(np.abs(value) ** 2 @ weight))
    every -= own * float(np.sum(weight / readings.count))
    return float(together / max(every, 1e-300))


def _is_unambiguous(
    readings: Readings, p: int, beat: FloatArray, frequency: FloatArray, noise: float
) -> bool:
    """True if beats separate the rate from its nearest alias, λ/(2 × longest interval) away."""
    power = np.sum(np.abs(readings.value[p]) ** 2, axis=0) * readings.count * readings.spread
    information = 2.0 / noise * (beat[:, :2].T * power) @ beat[:, :2]
    deviation = float(np.sqrt(np.linalg.inv(information)[1, 1]))
    interval = float(np.max(np.diff(readings.middle), initial=1e-9))
    alias = SPEED_OF_LIGHT / (2.0 * float(np.mean(frequency)) * interval)
    return ALIAS_MARGIN * deviation < 0.5 * alias


@reordered
def _read(  # pragma: no cover - compiled
    samples: Any, present: Any, phases: Any, amplitude: Any, centre: Any, rate: float
) -> Any:
    """Sums of the residual without each point's phase; the same times ticks from ``centre``."""
    channels, ramps, fast = samples.shape
    points = phases.shape[0]
    value = np.zeros((points, channels, ramps), dtype=np.complex128)
    slope = np.zeros((points, channels, ramps), dtype=np.complex128)
    real, imag = np.empty((points, fast)), np.empty((points, fast))
    x, y = np.empty((channels, fast)), np.empty((channels, fast))
    for k in range(ramps):
        # residual x + jy of all channels: the samples less the signals of all points
        for m in range(channels):
            for n in range(fast):
                x[m, n] = samples[m, k, n].real if present[k, n] else 0.0
                y[m, n] = samples[m, k, n].imag if present[k, n] else 0.0
        for p in range(points):
            unit_signal_into(real[p], imag[p], phases[p, k], rate)
            for n in range(fast):
                real[p, n] *= present[k, n]
                imag[p, n] *= present[k, n]
            for m in range(channels):
                a, b = amplitude[p, m, k].real, amplitude[p, m, k].imag
                for n in range(fast):
                    x[m, n] -= a * real[p, n] - b * imag[p, n]
                    y[m, n] -= a * imag[p, n] + b * real[p, n]
        # correlation of the residual with each point's signal, and its first moment in time
        for p in range(points):
            for m in range(channels):
                a, b, c, d = 0.0, 0.0, 0.0, 0.0
                for n in range(fast):
                    re = x[m, n] * real[p, n] + y[m, n] * imag[p, n]
                    im = y[m, n] * real[p, n] - x[m, n] * imag[p, n]
                    a += re
                    b += im
                    c += re * (n - centre[k])
                    d += im * (n - centre[k])
                value[p, m, k] = complex(a, b)
                slope[p, m, k] = complex(c, d)
    return value, slope
