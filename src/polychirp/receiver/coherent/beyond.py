r"""Strong points beyond the greatest range, whose side lobes reach into the map.

A point at range R leaves, at a range x resolution cells away, its coherent power times
:math:`(\pi x)^{-2}`. Where that exceeds the noise within the limits, the search must reach as far
as the point: then it is found, subtracted, and left out as one beyond the limits.
"""

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.signal_model.point_signal import hann_weights
from polychirp.receiver.signal_model.power_spectra import power_spectra, spectrum_size

MARGIN = 4.0
"""Range cells behind the farthest strong point to which the search reaches; chosen: its main lobe
is within it."""

LEAST_EXCESS = 0.5
"""Power over the median of all ranges, less one, up to which it counts as noise; chosen: five
deviations of the mean over 32 ramps and four channels."""

HANN_LOSS = 1.5
"""Power of a point in all samples of a ramp over that in its bin with Hann's window."""


def farthest_range(seen: Observation, greatest_range: float) -> float:
    """Range to which the search must reach, m: the limit, or that of a strong point beyond it.

    The spectra of all ramps show the points, averaged at equal ranges without regard to speeds.
    """
    times, slope = seen.model.times, seen.model.schedule.slope
    size = spectrum_size(times)
    power = power_spectra(seen.samples, hann_weights(seen.present), size).mean(axis=0)
    cell = seen.range_cell
    last = 0.5 * times.rate * SPEED_OF_LIGHT / (2.0 * float(np.max(np.abs(slope))))
    distance = np.arange(0.0, last, 0.5 * cell)
    place = np.rint(2.0 * distance * slope[:, None] / SPEED_OF_LIGHT * size / times.rate)
    profile = np.take_along_axis(power, place.astype(np.int64) % size, axis=1).mean(axis=0)
    noise = max(float(np.median(profile)), np.finfo(np.float64).tiny)
    excess = np.maximum(profile / noise - 1.0 - LEAST_EXCESS, 0.0)
    total = HANN_LOSS * seen.num_used * len(seen.samples) * excess
    apart = np.maximum((distance - greatest_range) / cell, 1.0)
    is_strong = (distance > greatest_range) & (total > (np.pi * apart) ** 2)
    if not np.any(is_strong):
        return greatest_range
    return float(distance[is_strong][-1]) + MARGIN * cell
