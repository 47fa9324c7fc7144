"""New points are added together, or in halves if one leads nowhere; the search has an end."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.errors import ModelWarning
from polychirp.model.radar import Converter
from polychirp.receiver.coherent import search
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.noise import whitening
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.mitigation.base import mitigated
from tests.support.points import HandPoint, frame_of
from tests.support.schedules import drawn_chirps

FAST = Converter(sample_rate=20e6, start=2e-6, margin=1e-6)


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


def test_a_search_that_reaches_its_greatest_number_of_maps_says_what_it_left(monkeypatch):
    """Of two points 40 dB apart the stronger one is found in the first maps."""
    monkeypatch.setattr(search, "MOST_MAPS", 2)
    points = [HandPoint(range=9.0, power=100.0), HandPoint(range=12.0, range_rate=3.0, power=1e-2)]
    frame = frame_of(drawn_chirps(32, seed=1), points, converter=FAST)
    with pytest.warns(ModelWarning, match=r"stopped after 2 maps of a frame, with \d+ peaks not"):
        found = CoherentReceiver(greatest_range=15.0).detect(frame)
    assert found.range[0] == pytest.approx(9.0, abs=0.05)


def test_an_ordinary_search_ends_before_that_and_warns_of_nothing():
    frame = frame_of(drawn_chirps(32, seed=1), [HandPoint(range=9.0, power=100.0)], converter=FAST)
    assert CoherentReceiver(greatest_range=15.0).detect(frame).num_detections == 1


def test_a_point_that_would_run_through_the_radar_is_none():
    """In half of a frame of 50 ms, 17 m/s are 0.4 m."""
    seen = SimpleNamespace(duration=0.05)
    distance = np.array([0.0, 0.3, 0.5, 0.5, 0.02, -0.5, -0.3])
    rate = np.array([17.0, -17.0, 17.0, -17.0, 0.0, 17.0, 17.0])
    away = search.keeps_away(seen, distance, rate)
    assert away.tolist() == [False, False, True, True, True, True, False]


@pytest.mark.parametrize(
    ("source", "apart_db", "white_db"),
    [(0, 30.0, 86.0), (1, 70.0, 14.0)],
    ids=["noise from the weak point", "noise from the strong point, as leakage has"],
)
def test_the_dynamic_range_is_met_as_received_or_in_white_channels(source, apart_db, white_db):
    """White channels lower points from where noise comes by 6 dB, and raise others by 50 dB."""
    frame = frame_of(drawn_chirps(32, seed=1), [], converter=FAST)
    steering = np.exp(1j * np.pi * np.outer([0.3, -0.5], np.arange(4)))
    amplitude = np.array([[1.0], [10.0 ** (apart_db / 20.0)]]) * steering
    noise = np.outer(steering[source], steering[source].conj()) + 1e-5 * np.eye(4)
    seen = replace(Observation.of(frame, mitigated(None, frame)), mixing=whitening(noise))
    white = np.sum(np.abs(amplitude @ seen.mixing.T) ** 2, axis=1)
    assert 10.0 * np.log10(white[1] / white[0]) == pytest.approx(white_db, abs=0.5)
    points = replace(
        points_at([9.0, 12.0]), amplitude=amplitude, power=white * frame.samples[0].size
    )
    lesser = 10.0 ** (0.1 * min(apart_db, white_db))
    assert len(search.standing_out(seen, points, 10.0, 2.0 * lesser)) == 2
    assert len(search.standing_out(seen, points, 10.0, 0.5 * lesser)) == 1
