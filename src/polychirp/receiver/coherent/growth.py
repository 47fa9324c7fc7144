r"""Growth of points: amplitudes that do not change as 1/R².

An echo grows with 1/R² when its body comes nearer, the direct path of another radar with 1/R, and
both with the gains of antennas towards a passer. Over a frame this changes an amplitude by some per
cent, which is far above the noise for a strong point. A point p therefore has an amplitude
:math:`\alpha_p e^{\gamma_p t}` beyond 1/R², with a growth γ of its own. The residual r of a point
with the signal s gives it by

.. math:: \gamma = \frac{\mathrm{Re}\langle t s, r\rangle}{|t s|^2 + \sigma^2/2\gamma_0^2},

with t the time from the mean of the signal's energy, σ² the noise power of a sample and γ₀ the
deviation of growths that is known beforehand. The change of a signal with its growth is real where
that with its motion is imaginary, and odd where that with its amplitude is even. So growths are
found apart from both.

Points of one cell have none: their signals beat with each other, which looks like a growth of one
point. So it is with the direct path of a radar and the one by way of the road.
"""

from dataclasses import replace

import numpy as np

from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_REDUNDANCY, overlaps_another
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas, correlations, products
from polychirp.receiver.coherent.residual import Residual

GROWTH_DEVIATION = 5.0
"""Standard deviation γ₀ of growths that is known beforehand, 1/s; chosen: a radar that comes nearer
with 14 m/s, from whose ghost at 3 m growth differs by v/R from that of an echo."""

GREATEST_GROWTH = 10.0 * GROWTH_DEVIATION
"""Greatest growth that is believed, 1/s; chosen: a body at 1 m that comes nearer with 25 m/s. What
grows faster is a point that another one, not found yet, is added to."""

LEAST_GAIN_OF_GROWTH = 5.0
"""Fall of the residual's power, in units of a point's floor, from which growths change; chosen:
noise makes one of 1/2 for each."""


def grown(seen: Observation, residual: Residual, points: Points) -> tuple[Points, bool]:
    """Points of which strong ones have the growths that fit best, and if any has changed.

    ``residual`` may be that of other points near these. Those whose growth noise hides, and those
    that overlap another, keep theirs, and so do those whose best one is beyond `GREATEST_GROWTH`.
    """
    elapsed = seen.middle - seen.model.time
    measured = np.sqrt(2.0 * points.power) * float(np.std(elapsed)) * GROWTH_DEVIATION
    if not np.any(measured > 1.0):
        return points, False
    every = Replicas.of(seen, points)
    chosen = np.flatnonzero((measured > 1.0) & ~overlaps_another(seen, every))
    if not chosen.size:
        return points, False
    here = every[chosen]
    size = here.size(seen)
    centre = size @ elapsed / np.maximum(size.sum(axis=1), 1e-300)
    time = elapsed - centre[:, None]
    white = mixed(seen, here.amplitude)
    matched = mixed(seen, here.matched(residual.sums(seen, here, every)))
    prior = 0.5 * points.floor[chosen] / GROWTH_DEVIATION**2
    ahead = np.einsum("pm,pmk,pk->p", white.conj(), matched, time).real
    ahead -= prior * points.growth[chosen]
    alike = np.einsum("pm,qm->pq", white.conj(), white)
    overlap = np.einsum("pk,qk,pqk->pq", time, time, products(seen, here)[0])
    step = np.linalg.solve((alike * overlap).real + np.diag(prior), ahead)
    step[np.abs(points.growth[chosen] + step) > GREATEST_GROWTH] = 0.0
    if not float(step @ ahead) > LEAST_GAIN_OF_GROWTH * float(np.min(points.floor[chosen])):
        return points, False
    growth, amplitude = points.growth.copy(), points.amplitude.copy()
    growth[chosen] += step
    amplitude[chosen] *= np.exp(-step * centre)[:, None]
    return replace(points, growth=growth, amplitude=amplitude), True


def without_growth(seen: Observation, points: Points, fresh: Points) -> Points:
    """Points of which those that overlap new ones, ``fresh``, have no growth of their own."""
    coupling = correlations(seen, Replicas.of(seen, points), Replicas.of(seen, fresh))
    is_shared = np.any(coupling > LEAST_REDUNDANCY, axis=1)
    return replace(points, growth=np.where(is_shared, 0.0, points.growth))
