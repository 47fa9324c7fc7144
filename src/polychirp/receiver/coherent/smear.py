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

A peak of the rising ramps alone has the body's beats on them. With their mean slope :math:`S` and
the centre frequency :math:`f_0 = c/\lambda`, beats :math:`2SR/c + 2\dot R/\lambda` stay the same if
the range changes by :math:`-f_0 \Delta\dot R / S`. So the motions that are tried lie along two
lines through the peak, one for rising and one for falling ramps.
"""

from dataclasses import replace

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.coherent.acceleration import GREATEST_ACCELERATION
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas
from polychirp.receiver.coherent.residual import Residual

RANGE_OFFSETS = (-0.75, 0.0, 0.75)
"""Ranges of motions beside a line, in cells; chosen: peaks lie on the line, and half a step costs
2 dB."""

ACCELERATIONS = (0.0, 50.0, 100.0)
"""Accelerations of motions, m/s²; chosen: within a frame of 48 ms, half a step moves a beat by half
of a ramp's resolution."""

RATE_STEP = 0.5
"""Step of range rate, in the Doppler cells λ/2T of a ramp; chosen: half a step costs 1 dB."""

RATE_REACH = 1.5
"""Greatest difference of range rates between a body and its peak, over the change of range rate
that the greatest acceleration makes in a frame; chosen: peaks of one kind of ramps reached as far.
"""

MOST_RATES = 20
"""Greatest number of range rates to either side of a peak; chosen: it limits the work."""


def likeliest_motions(seen: Observation, residual: Residual, points: Points) -> FloatArray:
    """Motions with beats of points at which single ramps have most power, ``(point, 4)``."""
    offsets = _offsets(seen)
    motion = (points.motion + offsets[:, None]).reshape(-1, 4)
    every = points[np.tile(np.arange(len(points)), len(offsets))]
    here = Replicas.of(seen, replace(every, motion=motion))
    sums = mixed(seen, here.matched(residual.sums(seen, here)))
    power = np.sum(np.abs(sums) ** 2, axis=1) / np.maximum(here.size(seen), 1e-300)
    rises = seen.model.schedule.slope > 0.0
    kinds = [power[:, kind].sum(axis=1) for kind in (rises, ~rises) if np.any(kind)]
    both = np.min(kinds, axis=0).reshape(len(offsets), len(points))
    return np.asarray(points.motion + offsets[np.argmax(both, axis=0)])


def _offsets(seen: Observation) -> FloatArray:
    """Changes of a motion that are tried, ``(motion, 4)``."""
    length = float(np.median(seen.model.times.num_samples)) / seen.model.times.rate
    step = RATE_STEP * seen.wavelength / (2.0 * length)
    reach = min(np.floor(RATE_REACH * GREATEST_ACCELERATION * seen.duration / step), MOST_RATES)
    rate, beside, acceleration = np.meshgrid(
        step * np.arange(-reach, reach + 1.0),
        seen.range_cell * np.array(RANGE_OFFSETS),
        ACCELERATIONS,
        indexing="ij",
    )
    lines = [
        np.stack([beside - rate * ratio, rate, acceleration, np.zeros_like(rate)], axis=-1)
        for ratio in _range_per_rate(seen)
    ]
    return np.concatenate(lines).reshape(-1, 4)


def _range_per_rate(seen: Observation) -> list[float]:
    """Ranges over range rates at equal beats, s, of rising ramps and of falling ones."""
    slope = seen.model.schedule.slope
    kinds = [slope[kind] for kind in (slope > 0.0, slope < 0.0) if np.any(kind)]
    return [SPEED_OF_LIGHT / seen.wavelength / float(np.mean(kind)) for kind in kinds]
