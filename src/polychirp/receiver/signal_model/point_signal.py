"""The IF signal of a moving point: its phase and amplitude on every ramp, and its subtraction."""

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule


def beat_phase(
    schedule: RampSchedule, times: SampleTimes, *, motion: FloatArray, time: float
) -> FloatArray:
    r"""Phase of the beat at each ramp's first sample, and its derivatives: ``(point, ramp, 3)``.

    A point at range R at ``time`` :math:`t_0`, receding at v and accelerating at a, has the R(t) of
    `path_of`. At reception time t its round-trip delay is
    :math:`\tau = 2R(t)/(c + \dot R(t))`. With f(t) the transmitted frequency, of slope b, the beat
    has the phase

    .. math:: \varphi(t) - \varphi(t-\tau) = f(t)\,\tau(t) - \tfrac12 b\,\tau(t)^2

    in cycles. On each ramp it is a polynomial of second degree in t: the cubic term of an
    acceleration, b a t³/c, is neglected (1e-4 cycles at b = 3 GHz/ms, 10 m/s² and 1 ms). The last
    axis holds the phase at the first sample, cycles; its slope there, Hz; its curvature, Hz/s.

    Parameters
    ----------
    motion : R in m, v in m/s and a in m/s² at ``time``, ``(point, 3)``
    time : reference time :math:`t_0` of ``motion``, s
    """
    distance, rate, acceleration = path_of(motion, times.first - time)
    drift = 2.0 * rate / (SPEED_OF_LIGHT + rate)
    delay = 2.0 * distance / (SPEED_OF_LIGHT + rate)
    frequency = schedule.start_frequency + schedule.slope * (times.first - schedule.start_time)
    slope = np.broadcast_to(schedule.slope, delay.shape)
    bend = 2.0 * acceleration / SPEED_OF_LIGHT
    return np.stack(
        [
            frequency * delay - 0.5 * slope * delay**2,
            slope * delay + (frequency - slope * delay) * drift,
            2.0 * slope * drift - slope * drift**2 + frequency * bend,
        ],
        axis=-1,
    )


LEAST_RANGE_SHARE = 0.2
"""Least range that `path_of` returns, as a share of the range at the reference time. Chosen: it
keeps the sign of the range for the unphysical motions that a search tries."""


def path_of(motion: FloatArray, elapsed: FloatArray) -> FloatArray:
    r"""Range, range rate and range acceleration of points, ``elapsed`` s after the reference time.

    .. math:: R(t)^2 = R^2 + 2Rv\,\Delta + (v^2 + R a)\,\Delta^2

    ``motion`` ``(point, 3)`` holds R, v and a; Δ is the elapsed time. The formula is exact for
    straight motion at constant velocity, whose speed across the line of sight is :math:`\sqrt{Ra}`.
    For a body that brakes on the line of sight it differs from
    :math:`R + v\Delta + \tfrac12 a\Delta^2` by about v a Δ³/2R: 0.1 mm at 5 m, 10 m/s, 8 m/s² after
    24 ms. Bodies that pass nearby need the formula: at 4 m, with 14 m/s inwards and 14 m/s across,
    the third derivative of R changes the phase by a cycle within a frame of 48 ms. Negative ranges,
    as ghosts of radars that start earlier have, stay negative.

    Returns
    -------
    ``(3, point, …)`` with the axes of ``elapsed``
    """
    ends = (..., *(None,) * np.ndim(elapsed))
    distance, rate, acceleration = (motion[:, i][ends] for i in range(3))
    bend = rate**2 + distance * acceleration
    square = distance**2 + (2.0 * distance * rate + bend * elapsed) * elapsed
    now = np.sqrt(np.maximum(square, (LEAST_RANGE_SHARE * distance) ** 2))
    now = np.copysign(now, distance)
    rate_now = (distance * rate + bend * elapsed) / now
    return np.stack([now, rate_now, (bend - rate_now**2) / now])


def path_slopes(motion: FloatArray, elapsed: FloatArray) -> FloatArray:
    """Derivatives of the range of `path_of` with respect to R, v and a: ``(point, …, 3)``.

    The axes in the middle are those of ``elapsed``.
    """
    ends = (..., *(None,) * np.ndim(elapsed))
    distance, rate, acceleration = (motion[:, i][ends] for i in range(3))
    now = path_of(motion, elapsed)[0]
    by_distance = distance + rate * elapsed + 0.5 * acceleration * elapsed**2
    by_rate = (distance + rate * elapsed) * elapsed
    slopes = np.stack([by_distance, by_rate, 0.5 * distance * elapsed**2], axis=-1)
    return np.asarray(slopes / now[..., None])


def beat_frequency(
    schedule: RampSchedule,
    times: SampleTimes,
    *,
    distance: FloatArray,
    range_rate: FloatArray,
    time: float,
) -> FloatArray:
    """Beat frequency in the middle of each ramp's sampling window, Hz: ``(…, ramp)``.

    The points have ``distance`` m at ``time`` s and a constant ``range_rate`` m/s, both ``(…)``.
    """
    middle = times.first + 0.5 * (times.num_samples - 1) / times.rate
    away = np.asarray(range_rate)[..., None]
    drift = 2.0 * away / (SPEED_OF_LIGHT + away)
    delay = (
        2.0 * (np.asarray(distance)[..., None] + away * (middle - time)) / (SPEED_OF_LIGHT + away)
    )
    frequency = schedule.start_frequency + schedule.slope * (middle - schedule.start_time)
    return np.asarray(schedule.slope * delay * (1.0 - drift) + frequency * drift)


def hann_weights(present: BoolArray | FloatArray) -> FloatArray:
    """Hann window over every ramp times ``present``: weights 0 … 1, ``(ramp, fast)``.

    ``present`` is a mask of the samples or a weight 0 … 1 of each; a ramp's window ends with its
    last sample of a weight above 0.
    """
    length = np.max(np.where(present > 0, np.arange(present.shape[1]) + 1, 0), axis=1)
    n = np.arange(present.shape[1])
    window = np.sin(np.pi * (n + 0.5) / np.maximum(length, 1)[:, None]) ** 2
    return np.asarray(window * present)


def fit_amplitudes(
    samples: ComplexArray, weight: FloatArray, phases: FloatArray, rate: float
) -> tuple[ComplexArray, ComplexArray]:
    r"""Amplitudes of several points at once, and the residual of the samples without them.

    On every ramp and channel they are the weighted least-squares solution of
    :math:`y(t) = \sum_p a_p e^{j2\pi\varphi_p(t)}`, with the phases in cycles. Points with the same
    beat on a ramp share the amplitude there.

    Parameters
    ----------
    samples : ``(channel, ramp, fast)``
    weight : ``(ramp, fast)``, zero where there is no sample
    phases : `beat_phase` of each point, ``(point, ramp, 3)``
    rate : sample rate, 1/s

    Returns
    -------
    amplitude : in the unit of ``samples``, ``(point, channel, ramp)``
    residual : ``(channel, ramp, fast)``, zero where there is no sample
    """
    amplitude = np.empty((len(phases), *samples.shape[:2]), dtype=np.complex128)
    residual = np.empty(samples.shape, dtype=np.complex128)
    ridge, diagonal = _ridge(weight), np.arange(len(phases))
    for m in range(samples.shape[1]):  # ramp by ramp, so that the signals fit a core's cache
        signal = _unit_signals(phases[:, m], rate, samples.shape[2])
        weighted = signal.conj() * weight[m]
        gram = weighted @ signal.T
        gram[diagonal, diagonal] += ridge[m]
        amplitude[:, :, m] = np.linalg.solve(gram, weighted @ samples[:, m].T)
        left = samples[:, m] - amplitude[:, :, m].T @ signal
        residual[:, m] = left * (weight[m] > 0.0)
    return amplitude, residual


def matched_amplitudes(
    samples: ComplexArray, weight: FloatArray, phases: FloatArray, rate: float
) -> ComplexArray:
    """Amplitude that `fit_amplitudes` would give every point if it were the only one.

    The parameters and the axes of the amplitude are those of `fit_amplitudes`.
    """
    energy = np.sum(weight, axis=1) + _ridge(weight)
    out = np.empty((len(phases), *samples.shape[:2]), dtype=np.complex128)
    for m in range(samples.shape[1]):
        signal = _unit_signals(phases[:, m], rate, samples.shape[2])
        out[:, :, m] = (signal.conj() * weight[m]) @ samples[:, m].T / energy[m]
    return out


REGULARISATION = 1e-7
"""Share of a unit signal's weighted energy that is added to the diagonal of the normal equations:
it bounds the amplitudes of points closer than a resolution cell. Chosen: small beside 1."""


def _ridge(weight: FloatArray) -> FloatArray:
    """Number added to the diagonal of the normal equations, ``(ramp,)``.

    It is above zero also on a ramp without samples, whose amplitudes then come out as zero.
    """
    return np.asarray(REGULARISATION * np.sum(weight, axis=1) + 1e-300)


def _unit_signals(phases: FloatArray, rate: float, fast: int) -> ComplexArray:
    """Signals of magnitude 1 with one ramp's phases of `beat_phase`, ``(point, fast)``."""
    elapsed = np.arange(fast) / rate
    start, beat, drift = phases.T[..., None]
    cycles = start + elapsed * (beat + 0.5 * elapsed * drift)
    return np.asarray(np.exp(2j * np.pi * (cycles - np.rint(cycles))))


def replica(
    schedule: RampSchedule, times: SampleTimes, *, motion: FloatArray, time: float
) -> ComplexArray:
    """Signal of magnitude 1 of one point with ``motion`` (R, v, a) at ``time``, ``(ramp, fast)``.

    Its phase is evaluated at every sample: this is the slow reference for `beat_phase`.
    """
    distance, rate, _ = path_of(np.asarray(motion)[None], times.time - time)[:, 0]
    delay = 2.0 * distance / (SPEED_OF_LIGHT + rate)
    frequency = schedule.start_frequency[:, None] + schedule.slope[:, None] * (
        times.time - schedule.start_time[:, None]
    )
    cycles = frequency * delay - 0.5 * schedule.slope[:, None] * delay**2
    return np.asarray(np.exp(2j * np.pi * (cycles % 1.0)) * times.is_sample)
