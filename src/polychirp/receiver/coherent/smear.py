r"""Motions of bodies whose accelerations smear them over the map of constant range rates.

The range rate of a body that passes nearby changes by several metres per second within a frame. On
ramps that differ, the strongest peaks that it raises are then where some of its rising or of its
falling ramps add up by chance, up to some metres per second beside it, and too far for a search of
the acceleration. The powers of single ramps do not depend on the phases from ramp to ramp. With the
sums :math:`y_k` of the samples at a motion's beats on ramp k and the numbers :math:`n_k` of
samples,

.. math:: E = \min\Big\{\sum_{k \in \text{rising}} \frac{|y_k|^2}{n_k},
              \sum_{k \in \text{falling}} \frac{|y_k|^2}{n_k}\Big\}

is greatest at the body's own motion, to within the resolution of a ramp. Its peaks are wide, so
that few motions need be tried. It costs sensitivity, since noise adds up as signals do; so it
serves only to find where the phases are tried.
"""

from dataclasses import replace

import numpy as np

from polychirp.axes import FloatArray
from polychirp.receiver.coherent.acceleration import GREATEST_ACCELERATION
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas
from polychirp.receiver.coherent.residual import Residual

RANGE_OFFSETS = np.arange(-3.0, 3.5, 0.75)
"""Ranges of motions beside a peak, in cells; chosen: a peak where only rising or only falling ramps
add up is seldom further from the body, and half a step costs 2 dB."""

ACCELERATIONS = (0.0, 50.0, 100.0)
"""Accelerations of motions, m/s²; chosen: within a frame of 48 ms, half a step moves a beat by half
of a ramp's resolution."""

RATE_STEP = 0.5
"""Step of range rate, in the Doppler cells λ/2T of a ramp; chosen: half a step costs 1 dB."""

MOST_RATES = 16
"""Greatest number of range rates to either side of a peak; chosen: it limits the work."""


def likeliest_motions(seen: Observation, residual: Residual, points: Points) -> FloatArray:
    """Motions near those of points at which single ramps have most power, ``(point, 4)``.

    The range rates reach as far as the greatest acceleration takes them within a frame.
    """
    offsets = _offsets(seen)
    motion = (points.motion + offsets[:, None]).reshape(-1, 4)
    every = points[np.tile(np.arange(len(points)), len(offsets))]
    here = Replicas.of(seen, replace(every, motion=motion))
    sums = mixed(seen, here.matched(residual.sums(seen, here))[0])
    power = np.sum(np.abs(sums) ** 2, axis=1) / np.maximum(here.size(seen), 1e-300)
    rises = seen.model.schedule.slope > 0.0
    kinds = [power[:, kind].sum(axis=1) for kind in (rises, ~rises) if np.any(kind)]
    both = np.min(kinds, axis=0).reshape(len(offsets), len(points))
    return np.asarray(points.motion + offsets[np.argmax(both, axis=0)])


def _offsets(seen: Observation) -> FloatArray:
    """Changes of a motion that are tried, ``(motion, 4)``."""
    length = float(np.median(seen.model.times.num_samples)) / seen.model.times.rate
    step = RATE_STEP * seen.wavelength / (2.0 * length)
    reach = min(np.floor(GREATEST_ACCELERATION * seen.duration / step), MOST_RATES)
    rates = step * np.arange(-reach, reach + 1.0)
    axes = np.meshgrid(seen.range_cell * RANGE_OFFSETS, rates, ACCELERATIONS, [0.0], indexing="ij")
    return np.stack(axes, axis=-1).reshape(-1, 4)
