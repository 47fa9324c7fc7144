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
"""

from dataclasses import replace

import numpy as np

from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas, products
from polychirp.receiver.coherent.residual import Residual

GROWTH_DEVIATION = 5.0
"""Standard deviation γ₀ of growths that is known beforehand, 1/s; chosen: a radar that comes nearer
with 14 m/s, from whose ghost at 3 m growth differs by v/R from that of an echo."""

LEAST_GAIN_OF_GROWTH = 5.0
"""Fall of the residual's power, in units of a point's floor, from which growths change; chosen:
noise makes one of 1/2 for each."""


def grown(seen: Observation, residual: Residual, points: Points) -> tuple[Points, bool]:
    """Points of which the strong ones have the growths that fit best, and if any has changed.

    ``residual`` may be that of other points near these. Weak points, whose growth noise hides, keep
    theirs.
    """
    elapsed = seen.middle - seen.model.time
    measured = np.sqrt(2.0 * points.power) * float(np.std(elapsed)) * GROWTH_DEVIATION
    strong = np.flatnonzero(measured > 1.0)
    if not strong.size:
        return points, False
    every = Replicas.of(seen, points)
    here = every[strong]
    size = here.size(seen)
    centre = size @ elapsed / np.maximum(size.sum(axis=1), 1e-300)
    time = elapsed - centre[:, None]
    matched = mixed(seen, here.matched(residual.sums(seen, here, every))[0])
    white = mixed(seen, here.amplitude)
    ahead = np.einsum("pm,pmk,pk->p", white.conj(), matched, time).real
    alike = np.einsum("pm,qm->pq", white.conj(), white)
    normal = (alike * np.einsum("pk,qk,pqk->pq", time, time, products(seen, here)[0])).real
    prior = 0.5 * points.floor[strong] / GROWTH_DEVIATION**2
    right = ahead - prior * points.growth[strong]
    step = np.linalg.solve(normal + np.diag(prior), right)
    if not float(step @ right) > LEAST_GAIN_OF_GROWTH * float(np.min(points.floor[strong])):
        return points, False
    growth, amplitude = points.growth.copy(), points.amplitude.copy()
    growth[strong] += step
    amplitude[strong] *= np.exp(-step * centre)[:, None]
    return replace(points, growth=growth, amplitude=amplitude), True
