r"""Number of peaks that noise alone raises above a threshold, and the threshold for a given number.

In white noise the map, relative to the noise power of a sample, is half a :math:`\chi^2` field with
k = 2M degrees of freedom for M channels. The expected number of its maxima above a high threshold u
is that of the Euler characteristic of the region above u (Worsley 1994, theorem 3.5, in two
dimensions):

.. math:: \mathrm E[N] = A\,\sqrt{\det\Lambda}\;\frac{(2u)^{(k-2)/2}\,e^{-u}\,(2u-k+1)}
          {2\pi\,2^{(k-2)/2}\,\Gamma(k/2)},

with A the area of the map in m · m/s and :math:`\Lambda` the covariance, over the samples, of the
derivatives of a point's phase by R and v. So no cells need be counted, and the schedule may be any.
For equal ramps that follow each other without gaps, a resolution cell c/2B by λ/2T has
:math:`A\sqrt{\det\Lambda} = \pi^2/3`, which serves as the unit.
"""

import math

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.coherent.observation import Observation

AREA_OF_A_CELL = np.pi**2 / 3.0
r"""Area of a resolution cell c/2B by λ/2T times :math:`\sqrt{\det\Lambda}`."""


def map_area(seen: Observation, *, range_span: float, range_rate_span: float) -> float:
    r"""Area of a map times :math:`\sqrt{\det\Lambda}`; the spans are in m and m/s."""
    times, schedule = seen.model.times, seen.model.schedule
    frequency = schedule.start_frequency[:, None] + schedule.slope[:, None] * (
        times.time - schedule.start_time[:, None]
    )
    columns = np.stack([frequency, frequency * (times.time - seen.model.time)])[:, seen.present]
    columns = 4.0 * np.pi / SPEED_OF_LIGHT * columns
    return float(range_span * range_rate_span * np.sqrt(np.linalg.det(np.cov(columns))))


def expected_peaks(threshold: float, *, num_channels: int) -> float:
    r"""Expected number of maxima above a threshold, per unit of `map_area`.

    The threshold is relative to the noise power of a sample.

    >>> round(expected_peaks(20.0, num_channels=1) / expected_peaks(21.0, num_channels=1), 2)
    2.59
    """
    half = float(num_channels)
    log = (half - 1.0) * math.log(threshold) - threshold - math.lgamma(half)
    return math.exp(log) * max(2.0 * (threshold - half) + 1.0, 0.0) / (2.0 * math.pi)


def threshold_of(probability: float, *, num_channels: int) -> float:
    """Threshold, over the noise power of a sample, at which noise has ``probability`` maxima.

    The number is that per resolution cell.

    >>> threshold = threshold_of(1e-6, num_channels=4)
    >>> round(threshold, 1), f"{AREA_OF_A_CELL * expected_peaks(threshold, num_channels=4):.1e}"
    (24.8, '1.0e-06')
    """
    from scipy.optimize import brentq

    def excess(threshold: float) -> float:
        return AREA_OF_A_CELL * expected_peaks(threshold, num_channels=num_channels) - probability

    least = num_channels + math.sqrt(num_channels)
    if excess(least) <= 0.0:
        return least
    return float(brentq(excess, least, least + 100.0 - 2.0 * math.log(probability)))
