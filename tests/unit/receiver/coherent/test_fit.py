"""Sums of signals, Gauss-Newton steps and the search for accelerations, against slow references."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.coherent.acceleration import accelerated
from polychirp.receiver.coherent.least_squares import gauss_newton
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import couplings, groups_of, overlaps
from polychirp.receiver.coherent.points import Points, without
from polychirp.receiver.coherent.refinement import divided, pruned, relaxed
from polychirp.receiver.coherent.signals import moments
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.signal_model.point_signal import path_of, replica
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=6, streams=Streams(2))
NEAR = HandPoint(range=12.3, range_rate=-7.7, acceleration=3.0, azimuth=0.2, spreads=True)
BESIDE = HandPoint(range=12.42, range_rate=-7.7, azimuth=-0.4, spreads=True)
"""Two points 0.8 cells apart in range."""


def observed(points, noise=1e-9):
    one = frame_of(RAMPS, points, noise=noise, seed=1)
    return Observation.of(one, mitigated(None, one))


def in_the_middle(seen, points):
    start = np.array([[p.range, p.range_rate, p.acceleration] for p in points])
    late = seen.model.time - float(RAMPS.start_time[0])
    return path_of(start, np.array(late)).T


def points_at(seen, motion, floor=1e-9):
    count, channels = len(motion), seen.samples.shape[0]
    return Points(
        motion=np.column_stack([motion, np.zeros(count)]),
        amplitude=np.zeros((count, channels), dtype=np.complex128),
        floor=np.full(count, floor),
        sine=np.zeros(count),
        power=np.zeros(count),
    )


def fitted_amplitudes(seen, points):
    step = gauss_newton(seen, seen.samples, points, share=0.0)
    return step.points, without(seen, seen.samples, step.points)


def test_moments_are_sums_over_samples():
    seen = observed([NEAR])
    motion = np.array([[12.1, -7.6, 2.0, 0.0]])
    model = seen.model
    signal = replica(model.schedule, model.times, motion=motion[0, :3], time=model.time)
    time = model.times.time - seen.middle[:, None]
    slow = [np.sum(seen.samples * signal.conj() * seen.present * time**n, axis=2) for n in range(3)]
    fast = moments(seen.samples, seen.present, seen.phases(motion), model.times)[:, 0]
    for found, true in zip(fast, slow, strict=True):
        assert np.abs(found - true).max() < 1e-3 * np.abs(true).max()


def test_an_ideal_point_is_subtracted_to_below_minus_80_db():
    """The beats, the phases between elements over the band, and the growth with 1/R² fit."""
    seen = observed([NEAR], noise=1e-14)
    points = points_at(seen, in_the_middle(seen, [NEAR]), floor=1e-14)
    points, residual = fitted_amplitudes(seen, points)
    points, residual = relaxed(seen, residual, points, sweeps=6)
    assert np.vdot(residual, residual).real < 1e-8 * np.vdot(seen.samples, seen.samples).real


def test_overlaps_are_sums_of_products():
    seen = observed([])
    motion = np.array([[12.1, -7.6, 2.0], [12.2, -7.5, 0.0], [12.1, -6.9, 0.0]])
    model = seen.model
    signals = [replica(model.schedule, model.times, motion=one, time=model.time) for one in motion]
    time = model.times.time - seen.middle[:, None]
    points = points_at(seen, motion)
    found = overlaps(seen, points)
    gain = seen.shape(points.motion, points.sine)[:, 0, :, 0]
    for p, q in ((0, 1), (1, 2), (0, 0)):
        for n in range(3):
            product = signals[p].conj() * signals[q] * time**n * seen.present
            true = product.sum(axis=1) * gain[p].conj() * gain[q]
            size = np.sum(seen.present * np.abs(time) ** n, axis=1)
            assert np.abs(found[n, p, q] - true).max() < 0.05 * size.max()


def test_two_points_in_a_cell_are_fitted_to_their_places():
    seen = observed([NEAR, BESIDE])
    true = in_the_middle(seen, [NEAR, BESIDE])
    start = points_at(seen, true + np.array([[0.02, 0.01, -1.0], [-0.02, 0.01, 1.0]]))
    points, residual = fitted_amplitudes(seen, start)
    points, residual = relaxed(seen, residual, points, sweeps=12)
    assert points.motion[:, 0] == pytest.approx(true[:, 0], abs=1e-4)
    assert points.motion[:, 1] == pytest.approx(true[:, 1], abs=1e-3)
    assert np.sum(np.abs(points.amplitude) ** 2, axis=1) == pytest.approx([4.0, 4.0], rel=0.05)


def test_a_fit_never_raises_the_residual():
    """A point whose range passes zero within the frame has no sensible model."""
    seen = observed([NEAR], noise=1.0)
    wild = points_at(seen, np.array([[0.2, 30.0, 50.0], [0.3, -31.0, 90.0]]), floor=1.0)
    wild = replace(wild, amplitude=wild.amplitude + 3.0)
    residual = without(seen, seen.samples, wild)
    _, after = relaxed(seen, residual, wild, sweeps=4)
    assert np.vdot(after, after).real <= np.vdot(residual, residual).real


def test_groups_hold_the_points_that_overlap():
    seen = observed([])
    motion = np.array([[12.1, -7.6, 0.0], [12.2, -7.6, 0.0], [20.0, 4.0, 0.0]])
    points = points_at(seen, motion)
    assert couplings(seen, points)[0, 1] > 0.3
    groups = sorted(sorted(group.tolist()) for group in groups_of(seen, points))
    assert groups == [[0, 1], [2]]


def test_a_point_that_its_neighbour_replaces_is_pruned():
    seen = observed([NEAR], noise=1.0)
    true = in_the_middle(seen, [NEAR])
    twice = points_at(seen, np.vstack([true, true + np.array([0.005, 0.002, 0.0])]), floor=1.0)
    twice, residual = fitted_amplitudes(seen, twice)
    twice, residual = relaxed(seen, residual, twice, sweeps=2)
    left, _ = pruned(seen, residual, twice, threshold=25.0)
    assert len(left) == 1
    assert left.motion[0, 0] == pytest.approx(true[0, 0], abs=0.005)


def test_pruning_keeps_two_points():
    seen = observed([NEAR, BESIDE], noise=0.01)
    points = points_at(seen, in_the_middle(seen, [NEAR, BESIDE]), floor=0.01)
    points, residual = fitted_amplitudes(seen, points)
    points, residual = relaxed(seen, residual, points, sweeps=4)
    assert len(pruned(seen, residual, points, threshold=25.0)[0]) == 2


@pytest.mark.parametrize("phase", [0.0, 1.5, 3.0])
def test_a_point_that_stands_for_two_is_divided(phase):
    """Two of 20 dB, one cell apart: whatever their phase, both are found from one."""
    seen = observed([], noise=1.0)
    cell = 0.5 * SPEED_OF_LIGHT / seen.bandwidth
    pair = [NEAR, replace(NEAR, range=NEAR.range + cell)]
    true = points_at(seen, in_the_middle(seen, pair), floor=1.0)
    size = np.sqrt(100.0 / (4.0 * seen.count.sum()))
    turned = size * np.exp(1j * np.array([[0.0], [phase]])) * np.ones((2, 4))
    both = without(seen, seen.samples, replace(true, amplitude=-turned))
    middle = points_at(seen, true.motion[:1, :3] + [[0.5 * cell, 0.0, 0.0]], floor=1.0)
    step = gauss_newton(seen, both, middle, share=0.0)
    one, residual = relaxed(seen, without(seen, both, step.points), step.points, sweeps=6)
    found, _ = divided(seen, residual, one, threshold=20.0)
    assert len(found) == 2
    assert np.ptp(found.motion[:, 0]) == pytest.approx(cell, rel=0.35)


def test_a_lone_point_is_not_divided():
    for seed in range(6):
        one = frame_of(RAMPS, [replace(NEAR, power=1.0)], noise=1.0, seed=seed)
        seen = Observation.of(one, mitigated(None, one))
        points = points_at(seen, in_the_middle(seen, [NEAR]), floor=1.0)
        points, residual = fitted_amplitudes(seen, points)
        points, residual = relaxed(seen, residual, points, sweeps=6)
        assert len(divided(seen, residual, points, threshold=20.0)[0]) == 1


@pytest.mark.parametrize("acceleration", [0.0, 4.0, 20.0, 60.0, 100.0])
def test_an_acceleration_is_found_from_the_motion_without_it(acceleration):
    """One acceleration step, half a wavelength over the square of the frame, is 3 m/s² here."""
    point = HandPoint(range=5.0, range_rate=-9.0, acceleration=acceleration, spreads=True)
    seen = observed([point], noise=1.0)
    true = in_the_middle(seen, [point])
    start = points_at(seen, true * [1.0, 1.0, 0.0], floor=1.0)
    found = accelerated(seen, seen.samples, start).motion[0]
    assert found[2] == pytest.approx(true[0, 2], abs=5.0)
    assert found[1] == pytest.approx(true[0, 1], abs=0.1)


def test_an_accelerated_point_is_found_from_a_range_that_is_wrong_by_a_cell():
    """The peak of its rising ramps alone is as far away."""
    point = HandPoint(range=5.0, range_rate=-9.0, acceleration=60.0, spreads=True)
    seen = observed([point], noise=1e-3)
    true = in_the_middle(seen, [point])
    start = points_at(seen, true * [1.0, 1.0, 0.0] + [seen.range_cell, 0.0, 0.0], floor=1e-3)
    found = accelerated(seen, seen.samples, start).motion[0]
    assert found[0] == pytest.approx(true[0, 0], abs=0.3 * seen.range_cell)
    assert found[2] == pytest.approx(true[0, 2], abs=5.0)
