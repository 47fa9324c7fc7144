r"""The Cramér–Rao bound of a point: how well any unbiased receiver can measure it.

The point keeps one complex amplitude A over the frame and over the array, and moves with constant
acceleration. Sample n of ramp k on channel m is

.. math:: y = A\,e^{j\Phi} + w, \qquad \Phi = 2\pi\left[f\,\tau - \tfrac12 b\,\tau^2
          - \tfrac{\bar f}{c}\,y_m \sin\theta\right], \qquad \tau = \frac{2R(t)}{c + \dot R(t)}

in white noise of power σ². With unknown R, v, a, θ and A Fisher's information of the phase's
parameters is :math:`2\,\mathrm{SNR} \sum \partial_i\Phi\,\partial_j\Phi`, SNR = |A|²/σ² per sample
and channel; |A| is orthogonal to them, arg A is one of them (Kay 1993, §3.9). Amplitudes free
on every ramp would leave only the beats, and a bound many times weaker for the rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.point import replica


@dataclass(frozen=True, slots=True, kw_only=True)
class Bound:
    """Least standard deviations: m, m/s and rad, of range and rate at the reference time."""

    range: float
    range_rate: float
    azimuth: float


def cramer_rao_bound(
    schedule: RampSchedule,
    times: SampleTimes,
    array: AntennaArray,
    *,
    motion: FloatArray,
    azimuth: float,
    snr: float,
    time: float,
    knows_acceleration: bool = False,
) -> Bound:
    """The bound for an isolated point.

    Parameters
    ----------
    motion : R, v, a at ``time``
    snr : power ratio per sample and channel
    knows_acceleration : it need not be estimated, as of what stands or rolls steadily

    Examples
    --------
    >>> from polychirp.model.if_frame import sample_times
    >>> from polychirp.model.radar import Converter
    >>> from polychirp.waveform import Triangular
    >>> from polychirp.rng import Streams
    >>> ramps = Triangular().schedule(num_sweeps=16, streams=Streams(1))
    >>> bound = cramer_rao_bound(ramps, sample_times(ramps, Converter()), AntennaArray(),
    ...     motion=np.array([10.0, 0.0, 0.0]), azimuth=0.0, snr=1.0, time=0.0)
    >>> bound.range < 1e-3
    True
    """
    slopes = _phase_slopes(schedule, times, motion, time)[:, times.is_sample]
    along = array.position[:, 1]
    frequency = float(np.mean(schedule.centre_frequency))
    bearing = -2.0 * np.pi * frequency / SPEED_OF_LIGHT * np.cos(azimuth) * along
    one, count = np.ones(array.num_channels), slopes.shape[1]
    # rows: R, v, a, θ, arg A; sums over channels and samples factorise
    moments = np.concatenate([slopes, np.ones((1, count))])
    own = array.num_channels * moments @ moments.T
    information = np.zeros((5, 5))
    keep = [0, 1, 2, 4]
    information[np.ix_(keep, keep)] = own
    information[3, keep] = information[keep, 3] = (bearing @ one) * moments.sum(axis=1)
    information[3, 3] = count * (bearing @ bearing)
    free = np.array([True, True, not knows_acceleration, True, True])
    return _bound_of(2.0 * snr * information, free)


def cramer_rao_bound_twin(
    schedule: RampSchedule,
    times: SampleTimes,
    array: AntennaArray,
    *,
    motion: FloatArray,
    azimuth: float,
    snr: float,
    time: float,
    knows_acceleration: bool = False,
) -> Bound:
    """The slow, obvious twin: every sample of every channel, differentiated by differences."""
    frequency = float(np.mean(schedule.centre_frequency))

    def signal(point: FloatArray) -> FloatArray:
        own = replica(schedule, times, motion=point[:3], time=time)[times.is_sample]
        cycles = frequency / SPEED_OF_LIGHT * array.position[:, 1] * np.sin(point[3])
        both = np.exp(1j * point[4] - 2j * np.pi * cycles)[:, None] * own * np.exp(point[5])
        return np.concatenate([both.real.ravel(), both.imag.ravel()])

    centre = np.array([*motion, azimuth, 0.0, 0.0])
    slopes = []
    for i, step in enumerate((1e-6, 1e-5, 1e-3, 1e-5, 1e-5, 1e-5)):
        change = np.zeros(6)
        change[i] = step
        slopes.append((signal(centre + change) - signal(centre - change)) / (2.0 * step))
    jacobian = np.array(slopes)
    free = np.array([True, True, not knows_acceleration, True, True, True])
    return _bound_of(2.0 * snr * jacobian @ jacobian.T, free)


def _phase_slopes(
    schedule: RampSchedule, times: SampleTimes, motion: FloatArray, time: float
) -> FloatArray:
    """∂Φ by R, v and a, ``(3, ramp, fast)``."""
    elapsed = times.time - time
    distance = motion[0] + motion[1] * elapsed + 0.5 * motion[2] * elapsed**2
    speed = SPEED_OF_LIGHT + motion[1] + motion[2] * elapsed
    delay = 2.0 * distance / speed
    frequency = schedule.start_frequency[:, None] + schedule.slope[:, None] * (
        times.time - schedule.start_time[:, None]
    )
    by_delay = 2.0 * np.pi * (frequency - schedule.slope[:, None] * delay) / speed
    by_motion = [2.0 * np.ones_like(elapsed), 2.0 * elapsed - delay, elapsed**2 - delay * elapsed]
    return np.asarray(by_delay * np.stack(by_motion))


def _bound_of(information: FloatArray, free: BoolArray) -> Bound:
    """Standard deviations of R, v, θ when only some parameters are unknown."""
    size = 1.0 / np.sqrt(np.diag(information)[free])
    scaled = information[np.ix_(free, free)] * np.outer(size, size)
    deviation = size * np.sqrt(np.diag(np.linalg.inv(scaled)))
    place = np.cumsum(free) - 1
    return Bound(
        range=float(deviation[0]),
        range_rate=float(deviation[1]),
        azimuth=float(deviation[place[3]]),
    )
