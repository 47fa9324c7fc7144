"""New points are added together, or in halves if one of them leads nowhere."""

from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.receiver.coherent import search
from polychirp.receiver.coherent.points import Points


def points_at(distance):
    count = len(distance)
    motion = np.zeros((count, 4))
    motion[:, 0] = distance
    return Points(
        motion=motion,
        amplitude=np.zeros((count, 4), dtype=np.complex128),
        floor=np.ones(count),
        sine=np.zeros(count),
        growth=np.zeros(count),
        power=np.ones(count),
    )


@pytest.mark.parametrize("bad", [{1.0}, {3.0}, {5.0}, {1.0, 2.0}, {1.0, 2.0, 3.0, 4.0, 5.0}])
def test_starts_that_lead_nowhere_do_not_cost_the_others(bad, monkeypatch):
    """Every good point lowers the residual by 1; with a bad one among them it rises."""

    def refitted(_, residual, points, fresh):
        every = set(fresh.motion[:, 0])
        change = 1.0 if every & bad else -float(len(every))
        return points + fresh, SimpleNamespace(energy=residual.energy + change)

    monkeypatch.setattr(search, "refitted", refitted)
    fresh = points_at([1.0, 2.0, 3.0, 4.0, 5.0])
    after, residual = search.added(None, SimpleNamespace(energy=9.0), points_at([8.0]), fresh)
    kept = [8.0, *sorted({1.0, 2.0, 3.0, 4.0, 5.0} - bad)]
    assert after.motion[:, 0].tolist() == kept
    assert residual.energy == 9.0 - (5 - len(bad))
