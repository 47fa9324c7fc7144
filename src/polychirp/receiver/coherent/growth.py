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
found apart from both. Points of one cell have one growth: what tells them apart is too little for a
growth of each, as for the direct path of a radar and the one by way of the road.
"""

from dataclasses import replace

import numpy as np

from polychirp.axes import FloatArray
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas, correlations, products
from polychirp.receiver.coherent.residual import Residual

GROWTH_DEVIATION = 5.0
"""Standard deviation γ₀ of growths that is known beforehand, 1/s; chosen: a radar that comes nearer
with 14 m/s, from whose ghost at 3 m growth differs by v/R from that of an echo."""

LEAST_GAIN_OF_GROWTH = 5.0
"""Fall of the residual's power, in units of a point's floor, from which growths change; chosen:
noise makes one of 1/2 for each."""

LEAST_OVERLAP = 0.3
"""Correlation with a stronger point from which a point has its growth; chosen."""


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
    white = mixed(seen, here.amplitude)
    alike = np.einsum("pm,qm->pq", white.conj(), white)
    overlap = products(seen, here)[0]
    normal = (alike * np.einsum("pk,qk,pqk->pq", time, time, overlap)).real
    matched = mixed(seen, here.matched(residual.sums(seen, here, every))[0])
    ahead = np.einsum("pm,pmk,pk->p", white.conj(), matched, time).real
    cell = _cells(points.strength[strong], correlations(seen, here, here))
    prior = 0.5 * (cell / cell.sum(axis=0)).T @ points.floor[strong] / GROWTH_DEVIATION**2
    wanted = cell.T @ (ahead + normal @ points.growth[strong])
    step = cell @ np.linalg.solve(cell.T @ normal @ cell + np.diag(prior), wanted)
    step -= points.growth[strong]
    fall = float(step @ (2.0 * ahead - normal @ step))
    if not fall > LEAST_GAIN_OF_GROWTH * float(np.min(points.floor[strong])):
        return points, False
    growth, amplitude = points.growth.copy(), points.amplitude.copy()
    growth[strong] += step
    amplitude[strong] *= np.exp(-step * centre)[:, None]
    return replace(points, growth=growth, amplitude=amplitude), True


def _cells(strength: FloatArray, coupling: FloatArray) -> FloatArray:
    """Points of each cell: 1 where a point belongs to it, else 0, ``(point, cell)``.

    A cell is the strongest point that is in no other cell, and those that overlap much with it.
    """
    leader = np.full(strength.size, -1)
    for n in np.argsort(-strength):
        if leader[n] < 0:
            leader[(leader < 0) & (coupling[n] > LEAST_OVERLAP)] = n
    return np.asarray(leader[:, None] == np.unique(leader), dtype=np.float64)
