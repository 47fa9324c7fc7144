"""Residues of bodies: their energy, their side lobes, and their sum over the ramps."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.coherent import search
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points, without
from polychirp.receiver.coherent.replicas import BEAT, Replicas, total_products
from polychirp.receiver.coherent.residue import (
    Bodies,
    bodies,
    folds,
    greatest_fold,
    side_lobes,
    unexplained,
    with_residues,
)
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=8, streams=Streams(3))
CELL = (0.16, 0.08)
"""Resolution of the frame in range, m, and range rate, m/s; somewhat more than c/2B and λ/2T."""


EQUAL = Triangular().schedule(num_sweeps=8, streams=Streams(3))
"""Ramps of two kinds, rising and falling."""

FOLD = (
    0.5 * SPEED_OF_LIGHT / EQUAL.centre_frequency[0] / (EQUAL.start_time[2] - EQUAL.start_time[0])
)
"""Range rate λ/2T by which speeds are folded on equal ramps, m/s."""


def observed(ramps=RAMPS):
    one = frame_of(ramps, [], noise=0.0)
    return Observation.of(one, mitigated(None, one))


def points_at(seen, motion, amplitude):
    count = len(motion)
    size = np.sum(seen.count)
    return Points(
        motion=np.column_stack([motion, np.zeros((count, 2))]),
        amplitude=amplitude,
        floor=np.ones(count),
        sine=np.zeros(count),
        growth=np.zeros(count),
        power=np.sum(np.abs(amplitude) ** 2, axis=1) * size,
    )


def drawn_amplitudes(draw, power):
    power = np.asarray(power, dtype=float)
    normal = draw.normal(size=(2, power.size, 4))
    value = normal[0] + 1j * normal[1]
    return value * np.sqrt(power / np.mean(np.abs(value) ** 2, axis=1))[:, None]


def drawn_body(draw, count=4, distance=12.0):
    """Points around a distance and 3 m/s, within half a cell, and one alone 6 cells behind them."""
    offset = draw.uniform(-0.5, 0.5, (count, 2)) * CELL
    motion = np.vstack([np.array([distance, 3.0]) + offset, [distance + 6 * CELL[0], 3.5]])
    power = np.append(draw.uniform(0.5, 1.0, count), 0.1)
    seen = observed()
    return seen, points_at(seen, motion, drawn_amplitudes(draw, power))


def residues(seen, points):
    """Noise power that the bodies among points leave at them."""
    return Bodies.of(seen, points).residues(seen, points)


def signals(seen, points):
    """The sum of the signals of points, ``(channel, ramp, fast)``."""
    return without(seen, np.zeros_like(seen.samples), points.negated)


def test_a_body_keeps_what_the_best_single_point_leaves_of_its_samples():
    """The single point is fitted to the samples themselves, at the place of every point."""
    for seed in range(3):
        seen, points = drawn_body(np.random.default_rng([71, seed]))
        body = points[np.arange(4)]
        samples = signals(seen, body)
        left = []
        for n in range(4):
            unit = replace(body[np.array([n])], amplitude=np.ones((1, 4), dtype=complex))
            signal = signals(seen, unit)
            fit = np.sum(samples * signal.conj(), axis=(1, 2)) / np.sum(
                np.abs(signal) ** 2, axis=(1, 2)
            )
            left.append(np.sum(np.abs(samples - fit[:, None, None] * signal) ** 2))
        here = Replicas.of(seen, body)
        found = unexplained(total_products(seen, here, here), body.amplitude)
        assert found == pytest.approx(min(left), rel=0.02)


def test_one_point_leaves_nothing():
    assert unexplained(np.array([[3.0 + 0j]]), np.ones((1, 4), dtype=complex)) == 0.0


def test_side_lobes_are_above_those_of_tones_and_reach_them():
    """Mean powers of tones on all ramps. The mean of sin² over them is one half of the limit."""
    seen = observed()
    draw = np.random.default_rng(72)
    motion = np.column_stack([draw.uniform(3.0, 20.0, 40), draw.uniform(-20.0, 20.0, 40)])
    points = points_at(seen, motion, np.ones((40, 4), dtype=complex))
    every = Replicas.of(seen, points)
    times = seen.model.times
    tone = np.zeros((40, RAMPS.num_ramps))
    for k, count in enumerate(times.num_samples):
        time = np.arange(count) / times.rate
        turn = np.exp(
            2j * np.pi * np.outer(every.track[:, BEAT][:, k] - every.track[:, BEAT][0, k], time)
        )
        tone[:, k] = np.abs(turn.mean(axis=1)) ** 2
    lobe = side_lobes(seen, every, every[np.array([0])])[:, 0]
    mean = tone.mean(axis=1)
    assert lobe[0] == 1.0
    assert np.all(mean <= lobe * 1.01)
    assert np.median(mean[1:] / lobe[1:]) == pytest.approx(0.5, abs=0.15)


def test_errors_that_differ_between_ramps_add_up_as_the_residue_says():
    """Derived: the power of the sum at other beats has the mean that the residue states.

    The body's amplitude has an error on every ramp, drawn anew 400 times, of the energy that one
    point leaves of it. Lobes are half of what is stated, on average over the beats.
    """
    draw = np.random.default_rng(73)
    seen, points = drawn_body(draw)
    body, alone = points[np.arange(4)], points[np.array([4])]
    stated = residues(seen, points)[4]
    here = Replicas.of(seen, body)
    energy = unexplained(total_products(seen, here, here), body.amplitude)
    leader = body[np.argsort(-body.strength)[:1]]
    unit = replace(leader, amplitude=np.ones((1, 4), dtype=complex))
    signal, other = (
        signals(seen, one)[0] for one in (unit, replace(alone, amplitude=unit.amplitude))
    )
    by_ramp = np.sum(signal * other.conj(), axis=1)
    deviation = np.sqrt(energy / (4 * RAMPS.num_ramps * seen.count))
    error = draw.normal(size=(2, 400, 4, RAMPS.num_ramps)) / np.sqrt(2.0)
    total = ((error[0] + 1j * error[1]) * deviation * by_ramp).sum(axis=-1)
    power = np.mean(np.abs(total) ** 2) / np.sum(seen.count)  # per channel
    assert 0.1 < power / stated < 1.0


def test_points_with_cells_of_their_own_leave_nothing():
    """Ten points 12 cells apart in range, with powers over 60 dB."""
    draw = np.random.default_rng(74)
    seen = observed()
    motion = np.column_stack([6.0 + 12 * CELL[0] * np.arange(10), draw.uniform(-9.0, 9.0, 10)])
    points = points_at(seen, motion, drawn_amplitudes(draw, 10 ** draw.uniform(-6, 0, 10)))
    assert np.all(residues(seen, points) == 0.0)


def test_a_weak_point_is_no_error_of_a_strong_one_in_its_own_cell():
    """Two points in one cell: neither has to stand out of what the other one explains."""
    draw = np.random.default_rng(75)
    seen = observed()
    motion = np.array([[12.0, 3.0], [12.0 + 0.7 * CELL[0], 3.0]])
    points = points_at(seen, motion, drawn_amplitudes(draw, [1.0, 0.01]))
    assert np.all(residues(seen, points) == 0.0)


def test_floors_hold_the_residues_and_strengths_stay():
    seen, points = drawn_body(np.random.default_rng(76))
    after = with_residues(seen, points, Bodies.of(seen, points))
    assert after.floor == pytest.approx(points.floor + residues(seen, points))
    assert after.strength == pytest.approx(points.strength)
    assert after.floor[4] > points.floor[4]


@pytest.mark.parametrize(("rate", "distance"), [(3.5, 8.0), (8.0, 8.0), (8.0, 12.0)])
def test_points_that_do_not_move_with_a_near_body_have_floors_with_a_margin(rate, distance):
    """The body moves at 3 m/s; the point alone is a metre behind it, with this range rate."""
    seen, points = drawn_body(np.random.default_rng(76), distance=distance)
    motion = points.motion.copy()
    motion[4, 1] = rate
    points = replace(points, motion=motion)
    after = with_residues(seen, points, Bodies.of(seen, points), margin=8.0)
    plain = residues(seen, points)
    assert plain[4] > 0.0
    factor = np.where((np.abs(motion[:, 1] - 3.0) > 1.5) & (distance < 10.0), 8.0, 1.0)
    assert after.floor == pytest.approx(points.floor + factor * plain)


@pytest.mark.parametrize(("over", "is_kept"), [(0.8, False), (1.3, True)])
def test_at_the_end_of_a_search_other_points_stand_out_of_the_residues_by_a_margin(
    over, is_kept, monkeypatch
):
    """A point at another speed has ``over`` times what it needs; the fits are left out."""
    for name in ("settled", "divided", "pruned", "above_noise"):
        monkeypatch.setattr(search, name, lambda _seen, left, same, *_more, **_how: (same, left))
    seen, points = drawn_body(np.random.default_rng(77), distance=8.0)
    motion = points.motion.copy()
    motion[4, 1] = 8.0
    points = replace(points, motion=motion)
    floor = 1.0 + 8.0 * residues(seen, points)
    points = replace(points, power=np.append(1e6 * points.power[:4], over * 30.0 * floor[4]))
    kept, _ = search.finished(
        seen, SimpleNamespace(after=lambda *_: None), points, None, 30.0, 1e9, margin=8.0
    )
    assert (points.motion[4].tolist() in kept.motion.tolist()) is is_kept


def test_bodies_hold_the_correlated_points_of_a_strongest_one():
    coupling = np.eye(5)
    coupling[[0, 1, 2, 3], [1, 0, 3, 2]] = 0.5
    coupling[[1, 2], [2, 1]] = 0.2
    found = bodies(np.array([1.0, 4.0, 2.0, 3.0, 9.0]), coupling)
    assert [body.tolist() for body in found] == [[1, 0, 2]]


def folded_points(seen, steps, power):
    """Points of one place whose speeds are ``steps`` folds apart."""
    motion = np.array([[12.0, 3.0 + FOLD * step] for step in steps])
    return points_at(seen, motion, drawn_amplitudes(np.random.default_rng(77), power))


def test_folds_are_what_equal_ramps_add_in_phase():
    """Derived from samples: products of tones on each ramp, added over ramps of one kind."""
    seen = observed(EQUAL)
    points = folded_points(seen, [0.0, 1.0, 2.0, 0.37], np.ones(4))
    every = Replicas.of(seen, points)
    unit = [
        signals(seen, replace(points[np.array([n])], amplitude=np.eye(1, 4, dtype=complex)))[0]
        for n in range(4)
    ]
    by_ramp = np.array([np.sum(one.conj() * unit[0], axis=1) for one in unit]) / seen.count
    added = sum(np.abs(by_ramp[:, own::2].sum(axis=1)) ** 2 for own in (0, 1)) / EQUAL.num_ramps
    leader = every[np.array([0])]
    by_folds, by_lobes = (one(seen, every, leader)[:, 0] for one in (folds, side_lobes))
    assert greatest_fold(seen) == 7.0
    assert by_folds[0] == pytest.approx(7.0)
    assert np.all(added <= 1.01 * (by_folds + by_lobes))
    assert added[1] > 0.5 * (by_folds + by_lobes)[1]
    assert by_folds[1] > 2.0
    assert by_folds[3] == 0.0


def test_ramps_that_differ_have_no_folds():
    seen = observed()
    every = Replicas.of(seen, folded_points(seen, [0.0, 1.0, 2.0], np.ones(3)))
    assert greatest_fold(seen) == 1.0
    assert folds(seen, every, every) == pytest.approx(np.zeros((3, 3)), abs=1e-12)


def test_several_points_that_are_folded_on_a_body_are_its_errors():
    """Each has to stand out of the others; the body itself keeps its floor."""
    seen = observed(EQUAL)
    points = folded_points(seen, [0.0, 1.0, -1.0], [1.0, 0.01, 0.01])
    left = residues(seen, points) * EQUAL.num_ramps * 4
    assert left[0] == 0.0
    assert np.all(left[1:] > 0.3 * points.strength[:0:-1])


def test_one_point_that_is_folded_on_another_keeps_its_floor():
    seen = observed(EQUAL)
    points = folded_points(seen, [0.0, 1.0], [1.0, 0.01])
    assert np.all(residues(seen, points) == 0.0)
