r"""The Cramér–Rao bound of a point: the least standard deviations of unbiased estimates.

The point keeps one complex amplitude A over the frame and over the array, and moves with constant
acceleration; its azimuth changes as on a straight path (`azimuth_rate`). A sample at the
time t of a ramp of slope b, on channel m, is

.. math:: y = A\,e^{j\Phi} + w, \qquad \Phi = 2\pi\left[f\,\tau - \tfrac12 b\,\tau^2
          - \tfrac{\bar f}{c}\,y_m\,s(t)\right], \qquad \tau = \frac{2R(t)}{c + \dot R(t)}

with f the frequency that is sent at t, :math:`\bar f` its mean over the schedule, y_m the channel's
place across the boresight, s(t) = sin θ and w white noise of power σ². Unknown are R, v, a, θ, the
rate of sin θ, and A. Fisher's information on the phase's parameters is
:math:`2\,\mathrm{SNR} \sum \partial_i\Phi\,\partial_j\Phi`, with SNR = |A|²/σ² per sample and
channel. arg A is one of these parameters; |A| is not, and its error is independent of theirs (Kay
1993, §3.9). If every ramp had an unknown amplitude of its own, only the beats would give
information, and the bound on the range rate would be many times greater. Prior knowledge of the
rate of sin θ adds its information (Van Trees 1968, §2.4).
"""

import math
from dataclasses import dataclass

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.estimation.azimuth_rate import sine_basis
from polychirp.receiver.signal_model.equal_ramps import refuse_code
from polychirp.receiver.signal_model.point_signal import path_of, path_slopes


@dataclass(frozen=True, slots=True, kw_only=True)
class Bound:
    """Least standard deviations of range, m, range rate, m/s, and azimuth, rad, at ``time``.

    That of an azimuth that is not measured is infinite.
    """

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
    is_acceleration_known: bool = False,
    sine_rate_deviation: float = math.inf,
) -> Bound:
    """The bound for one point without neighbours.

    Parameters
    ----------
    motion : range R, m, range rate v, m/s, and acceleration a, m/s², of the range at ``time``
    azimuth : rad, θ at ``time``
    snr : power ratio per sample and channel
    time : s, on the time axis of ``times``, the instant of which R, v, a and θ are estimated
    is_acceleration_known : true if a is not estimated, as for targets at constant velocity
    sine_rate_deviation : 1/s, standard deviation of the prior of the rate of sin θ, whose mean is
        taken as 0; 0 for a known rate, inf for no prior knowledge

    Raises
    ------
    CapabilityError
        The ramps carry a code, which is not in the equation.

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
    refuse_code(schedule, "the Cramér–Rao bound leaves out", instead="use ramps without a code")
    slopes = _phase_slopes(schedule, times, motion, time)[:, times.is_sample]
    frequency = float(np.mean(schedule.centre_frequency))
    by_sine = -2.0 * np.pi * frequency / SPEED_OF_LIGHT * array.position[:, 1]
    if np.ptp(by_sine) == 0.0:  # the phase of one place is that of the amplitude
        by_sine = np.zeros_like(by_sine)
    # derivatives by R, v, a, arg A are equal on all channels; by θ and the rate of sin θ they
    # are proportional to the y of each channel
    common = np.concatenate([slopes, np.ones((1, slopes.shape[1]))])
    elapsed = (times.time - time)[times.is_sample]
    own = sine_basis(motion[None], elapsed)[:, 0] * np.array([[np.cos(azimuth)], [1.0]])
    keep, turn = [0, 1, 2, 5], [3, 4]
    information = np.zeros((6, 6))
    information[np.ix_(keep, keep)] = array.num_channels * common @ common.T
    information[np.ix_(turn, keep)] = np.sum(by_sine) * own @ common.T
    information[np.ix_(keep, turn)] = information[np.ix_(turn, keep)].T
    information[np.ix_(turn, turn)] = by_sine @ by_sine * own @ own.T
    return _bound_of(2.0 * snr * information, not is_acceleration_known, sine_rate_deviation)


def _phase_slopes(
    schedule: RampSchedule, times: SampleTimes, motion: FloatArray, time: float
) -> FloatArray:
    """Derivatives of Φ, rad, by R, v and a, ``(3, ramp, fast)``."""
    elapsed = times.time - time
    distance, rate, _ = path_of(motion[None], elapsed)[:, 0]
    speed = SPEED_OF_LIGHT + rate
    delay = 2.0 * distance / speed
    frequency = schedule.start_frequency[:, None] + schedule.slope[:, None] * (
        times.time - schedule.start_time[:, None]
    )
    by_delay = 2.0 * np.pi * (frequency - schedule.slope[:, None] * delay) / speed
    # the derivative of τ by v through the denominator, −R/c times that by R, is neglected
    by_motion = 2.0 * np.moveaxis(path_slopes(motion[None], elapsed)[0], -1, 0)
    return np.asarray(by_delay * by_motion)


def _bound_of(
    information: FloatArray, unknown_acceleration: bool, sine_rate_deviation: float
) -> Bound:
    """Bound from the information on (R, v, a, θ, rate of sin θ, arg A) and the prior knowledge."""
    information = information.copy()
    free = np.ones(len(information), dtype=bool)
    is_measured = information[3, 3] > 0.0  # one channel measures no azimuth
    free[2] = unknown_acceleration
    free[3], free[4] = is_measured, is_measured and sine_rate_deviation > 0.0
    if sine_rate_deviation > 0.0:
        information[4, 4] += sine_rate_deviation**-2.0
    size = 1.0 / np.sqrt(np.diag(information)[free])
    scaled = information[np.ix_(free, free)] * np.outer(size, size)
    deviation = np.zeros(len(information))
    deviation[3] = math.inf
    deviation[free] = size * np.sqrt(np.diag(np.linalg.inv(scaled)))
    return Bound(
        range=float(deviation[0]), range_rate=float(deviation[1]), azimuth=float(deviation[3])
    )
