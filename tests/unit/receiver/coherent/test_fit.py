"""Sums of signals, Gauss-Newton steps and the search for accelerations, against slow references."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.coherent import acceleration
from polychirp.receiver.coherent.acceleration import Accelerations, accelerated
from polychirp.receiver.coherent.least_squares import fitted
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import groups_of
from polychirp.receiver.coherent.points import Points, without
from polychirp.receiver.coherent.ramps import HALF
from polychirp.receiver.coherent.refinement import (
    ERROR_OF_SUMS,
    divided,
    inner_products,
    pruned,
    relaxed,
    settled,
)
from polychirp.receiver.coherent.replicas import BEAT, Replicas, correlations, products, sums_of
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.signals import moments
from polychirp.receiver.coherent.sweeps import swept
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.signal_model.point_signal import path_of, replica
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=6, streams=Streams(2))
NEAR = HandPoint(range=12.3, range_rate=-7.7, acceleration=3.0, azimuth=0.2)
BESIDE = HandPoint(range=12.42, range_rate=-7.7, azimuth=-0.4)
"""Two points 0.8 cells apart in range."""
NOTHING = Points.none(4)


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
        growth=np.zeros(count),
        power=np.zeros(count),
    )


def with_amplitudes(seen, points):
    """The points with the amplitudes that fit at their motions, all together."""
    return fitted(seen, Residual.of(seen, NOTHING), points)


def fitted_to_the_end(seen, points, **options):
    """The points after all steps, and what they leave."""
    return settled(seen, Residual.of(seen, points), points, **options)


def drawn(count, seed=3):
    draw = np.random.default_rng(seed)
    low, high = [2.0, -30.0, -10.0, -0.3], [30.0, 30.0, 40.0, 0.3]
    motion = draw.uniform(low, high, (count, 4))
    amplitude = draw.normal(size=(2, count, 4))
    points = points_at(observed([]), motion[:, :3])
    return replace(
        points,
        motion=motion,
        amplitude=amplitude[0] + 1j * amplitude[1],
        sine=draw.uniform(-0.7, 0.7, count),
        growth=draw.uniform(-5.0, 5.0, count),
    )


def test_replicas_are_the_signals_of_the_observation():
    """The kernel's waves have the phases, shapes and weights that whole arrays give."""
    seen, points = coloured(observed([NEAR], noise=1.0)), drawn(20)
    here = Replicas.of(seen, points)
    beat, phasor = middles(seen, points)
    shape = seen.shape(points.motion, points.sine, points.growth)
    wave = (np.sqrt(seen.weight_at(beat)) * phasor)[:, None, None] * np.moveaxis(shape, 3, 2)
    assert here.track[:, BEAT] == pytest.approx(beat)
    assert here.wave[:, :, 0::2] == pytest.approx(wave.real, abs=1e-6 * np.abs(wave).max())
    assert here.wave[:, :, 1::2] == pytest.approx(wave.imag, abs=1e-6 * np.abs(wave).max())


def middles(seen, points):
    """Beats and phasors in the middle of the ramps' windows, ``(point, ramp)``."""
    phases, half = seen.phases(points.motion), seen.ramps.table[HALF]
    cycles = phases[..., 0] + half * (phases[..., 1] + 0.5 * half * phases[..., 2])
    return phases[..., 1] + half * phases[..., 2], np.exp(2j * np.pi * (cycles % 1.0))


def coloured(seen):
    """The observation with channels that are mixed, and weights that differ between the ramps."""
    draw = np.random.default_rng(8)
    mixing = np.eye(4) + 0.2 * (draw.normal(size=(4, 4)) + 1j * draw.normal(size=(4, 4)))
    weight = np.tile(draw.uniform(0.3, 1.0, (len(seen.present), 1)), (1, 50))
    return replace(seen, mixing=mixing, weight=weight)


def test_the_fall_by_a_sweep_is_that_of_exact_residuals():
    """Two groups move, one after the other, in noise that differs between channels and ramps."""
    far = HandPoint(range=21.0, range_rate=4.0, azimuth=0.3)
    seen = coloured(observed([NEAR, BESIDE, far], noise=1e-3))
    true = in_the_middle(seen, [NEAR, BESIDE, far])
    away = np.array([[0.004, 0.002, 0.0], [0.0, 0.003, 0.0], [-0.01, 0.004, 0.0]])
    points = with_amplitudes(seen, points_at(seen, true + away))
    before = Residual.of(seen, points)
    here, groups = Replicas.of(seen, points), [np.arange(2), np.array([2])]
    moved, fallen = swept(seen, before, points, here, groups, sweeps=1, least_gain=0.0)
    after = Residual.of(seen, moved)
    assert np.all(fallen > 0.0)
    assert fallen.sum() == pytest.approx(before.energy - after.energy, rel=0.02)
    assert after.energy < 0.1 * before.energy


def test_sweeps_end_where_steps_are_not_worth_taking():
    """The second sweep sees what the first has left; after the last step, more change nothing."""
    seen = observed([NEAR, BESIDE], noise=1.0)
    true = in_the_middle(seen, [NEAR, BESIDE])
    points = with_amplitudes(seen, points_at(seen, true + np.array([0.05, 0.02, 0.0]), floor=1e-3))
    before = Residual.of(seen, points)

    def swept_by(sweeps, least_gain=0.5):
        here, groups = Replicas.of(seen, points), [np.arange(2)]
        return swept(seen, before, points, here, groups, sweeps=sweeps, least_gain=least_gain)

    falls = [swept_by(n)[1][0] for n in (1, 2, 40, 50)]
    assert falls[0] < falls[1] < falls[2] == falls[3]
    assert swept_by(5, least_gain=1e12)[1][0] == 0.0


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


@pytest.mark.parametrize(("power", "error"), [(0, 5e-3), (1, 0.05), (2, 0.1)])
def test_sums_of_spectra_are_moments(power, error):
    points = drawn(20)
    seen = observed([NEAR, BESIDE], noise=1.0)
    here = Replicas.of(seen, points)
    phases, phasor = seen.phases(points.motion), middles(seen, points)[1]
    exact = moments(seen.samples, seen.present, phases, seen.model.times)[power]
    found = Residual.of(seen, NOTHING).sums(seen, here)[power] * phasor.conj()[:, None]
    assert np.linalg.norm(found - exact) < error * np.linalg.norm(exact)


def test_a_residual_tells_what_other_points_would_leave():
    """Each point is moved by a tenth of a cell: sums change as those of the exact residual."""
    seen, points = observed([NEAR], noise=1.0), drawn(12)
    moved = replace(points, motion=points.motion + np.array([0.01, 0.002, 0.0, 0.0]))
    here, there = Replicas.of(seen, points), Replicas.of(seen, moved)
    before = Residual.of(seen, points)
    exact = Residual.of(seen, moved).sums(seen, here)
    change = exact - before.sums(seen, here)
    error = before.sums(seen, here, there) - exact
    assert np.linalg.norm(error[0]) < 0.1 * np.linalg.norm(change[0])


def test_the_residual_after_a_change_is_that_of_the_new_points():
    """Three points move, one of them in the rate of its azimuth alone; one goes and one comes."""
    seen, points = observed([NEAR], noise=1.0), drawn(12)
    moved = replace(points, motion=points.motion + np.eye(12, 4) * 0.01)[np.arange(1, 12)]
    others = moved + drawn(1, seed=4)
    found, exact = Residual.of(seen, points).after(seen, others), Residual.of(seen, others)
    assert found.samples == pytest.approx(exact.samples, abs=1e-9)
    assert found.energy == pytest.approx(exact.energy, rel=1e-6)


def test_correlations_give_the_fall_of_the_energy():
    """The fall is |r|² − |r − δ|² = Re⟨δ, 2r − δ⟩, of a change δ of the signals."""
    seen, points = observed([NEAR], noise=1.0), drawn(6)
    moved = replace(points, motion=points.motion + np.array([0.03, 0.01, 0.0, 0.0]))
    moved = replace(moved, amplitude=0.3 * points.amplitude)
    before, after = Residual.of(seen, points), Residual.of(seen, moved)
    change = Replicas.of(seen, moved) + Replicas.of(seen, points).negated
    sums = 2.0 * before.sums(seen, change) - sums_of(seen, change, change)
    fall = float(np.sum(inner_products(seen, change, sums)))
    strength = seen.count.sum() * np.sum(np.abs(points.amplitude) ** 2, axis=1)
    allowed = ERROR_OF_SUMS * strength.max()
    assert abs(before.energy - after.energy) > 20.0 * allowed
    assert fall == pytest.approx(before.energy - after.energy, abs=allowed)


def test_a_strongly_bent_signal_has_exact_sums():
    """At 2000 m/s² the phase on a ramp is bent by more than a cycle."""
    seen = observed([NEAR], noise=1.0)
    points = points_at(seen, np.array([[12.3, 5.0, 2e3]]))
    here, phasor = Replicas.of(seen, points), middles(seen, points)[1]
    exact = moments(seen.samples, seen.present, seen.phases(points.motion), seen.model.times)
    found = Residual.of(seen, NOTHING).sums(seen, here) * phasor.conj()[:, None]
    assert found == pytest.approx(exact)


def test_steps_of_groups_are_those_of_all_samples():
    """The twin has a column for every sample, and solves for motions and amplitudes together."""
    seen = observed([NEAR, BESIDE])
    true = in_the_middle(seen, [NEAR, BESIDE])
    away = np.array([[0.004, 0.002, 0.0], [0.0, 0.003, 0.0]])
    points = with_amplitudes(seen, points_at(seen, true + away))
    points = replace(points, amplitude=points.amplitude * np.array([[0.9], [0.95 + 0.1j]]))
    residual = Residual.of(seen, points)
    here = Replicas.of(seen, points)
    moved, _ = swept(seen, residual, points, here, [np.arange(2)], sweeps=1, least_gain=0.0)
    step = (moved.motion - points.motion)[:, :2]
    assert step == pytest.approx(slow_step(seen, points, residual), abs=4e-4)


def slow_step(seen, points, residual):
    """Least squares of range, range rate and amplitudes by differences of exact signals."""
    size, small, columns = residual.samples.size, 1e-5, []
    for n in range(len(points)):
        one = points[np.array([n])]
        for i in range(2):
            change = np.zeros(4)
            change[i] = small
            moved = replace(one, motion=one.motion + change)
            columns.append((signal_of(seen, moved) - signal_of(seen, one)) / small)
        for m in range(4):
            unit = replace(one, amplitude=np.eye(4)[[m]].astype(np.complex128))
            columns += [signal_of(seen, unit), 1j * signal_of(seen, unit)]
    matrix = np.array(columns).reshape(len(columns), size)
    matrix = np.concatenate([matrix.real, matrix.imag], axis=1).T
    side = np.concatenate([residual.samples.real.ravel(), residual.samples.imag.ravel()])
    solved = np.linalg.lstsq(matrix, side, rcond=None)[0].reshape(len(points), -1)
    return solved[:, :2]


def signal_of(seen, points):
    return -without(seen, np.zeros_like(seen.samples), points)


def test_energies_are_those_of_all_samples():
    seen = observed([NEAR], noise=1.0)
    residual = Residual.of(seen, NOTHING)
    assert residual.energy == pytest.approx(np.vdot(seen.samples, seen.samples).real, rel=1e-5)


def test_an_ideal_point_is_subtracted_to_below_minus_80_db():
    """The beats, the phases between elements over the band, and the growth with 1/R² fit."""
    seen = observed([NEAR], noise=1e-14)
    points = points_at(seen, in_the_middle(seen, [NEAR]), floor=1e-14)
    _, left = fitted_to_the_end(seen, with_amplitudes(seen, points))
    residual = left.samples
    assert np.vdot(residual, residual).real < 1e-8 * np.vdot(seen.samples, seen.samples).real


def test_products_are_sums_of_products():
    seen = observed([])
    motion = np.array([[12.1, -7.6, 2.0], [12.2, -7.5, 0.0], [12.1, -6.9, 0.0]])
    model = seen.model
    signals = [replica(model.schedule, model.times, motion=one, time=model.time) for one in motion]
    time = model.times.time - seen.middle[:, None]
    points = points_at(seen, motion)
    here = Replicas.of(seen, points)
    found = products(seen, here)
    assert correlations(seen, here, here) == pytest.approx(correlation_of(found))
    gain = seen.shape(points.motion, points.sine, points.growth)[:, 0, :, 0]
    for p, q in ((0, 1), (1, 2), (0, 0)):
        for n in range(3):
            product = signals[p].conj() * signals[q] * time**n * seen.present
            true = product.sum(axis=1) * gain[p].conj() * gain[q]
            size = np.sum(seen.present * np.abs(time) ** n, axis=1)
            assert np.abs(found[n, p, q] - true).max() < 0.05 * size.max()


def correlation_of(products):
    total = products[0].sum(axis=-1)
    size = np.sqrt(np.diagonal(total).real)
    return np.abs(total) / np.outer(size, size)


def test_two_points_in_a_cell_are_fitted_to_their_places():
    seen = observed([NEAR, BESIDE])
    true = in_the_middle(seen, [NEAR, BESIDE])
    start = points_at(seen, true + np.array([[0.02, 0.01, -1.0], [-0.02, 0.01, 1.0]]))
    points, _ = fitted_to_the_end(seen, with_amplitudes(seen, start), sweeps=12)
    assert points.motion[:, 0] == pytest.approx(true[:, 0], abs=1e-4)
    assert points.motion[:, 1] == pytest.approx(true[:, 1], abs=1e-3)
    assert np.sum(np.abs(points.amplitude) ** 2, axis=1) == pytest.approx([4.0, 4.0], rel=0.05)


def test_a_fit_never_raises_the_residual():
    """A point whose range passes zero within the frame has no sensible model."""
    seen = observed([NEAR], noise=1.0)
    wild = points_at(seen, np.array([[0.2, 30.0, 50.0], [0.3, -31.0, 90.0]]), floor=1.0)
    wild = replace(wild, amplitude=wild.amplitude + 3.0)
    residual = Residual.of(seen, wild)
    _, after = fitted_to_the_end(seen, wild)
    assert after.energy <= residual.energy


@pytest.mark.parametrize("away", [0.3, 0.6, 0.9])
def test_a_step_from_far_away_does_not_raise_the_residual(away):
    """Half a cell is the most that a step takes, and a whole one may be too far."""
    seen = observed([NEAR, BESIDE], noise=1.0)
    cells = np.array([seen.range_cell, seen.range_rate_cell, 0.0])
    true = in_the_middle(seen, [NEAR, BESIDE])
    for sign in ([1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]):
        points = with_amplitudes(seen, points_at(seen, true + away * cells * sign, floor=1.0))
        before = Residual.of(seen, points)
        moved, _ = relaxed(seen, before, points, sweeps=1)
        assert Residual.of(seen, moved).energy <= 1.001 * before.energy


def test_groups_hold_the_points_that_overlap():
    seen = observed([])
    motion = np.array([[12.1, -7.6, 0.0], [12.2, -7.6, 0.0], [20.0, 4.0, 0.0]])
    points = points_at(seen, motion)
    here = Replicas.of(seen, points)
    assert correlations(seen, here, here)[0, 1] > 0.3
    assert sorted(sorted(group.tolist()) for group in groups_of(seen, here)) == [[0, 1], [2]]


def test_a_point_that_its_neighbour_replaces_is_pruned():
    seen = observed([NEAR], noise=1.0)
    true = in_the_middle(seen, [NEAR])
    twice = points_at(seen, np.vstack([true, true + np.array([0.005, 0.002, 0.0])]), floor=1.0)
    twice, residual = fitted_to_the_end(seen, with_amplitudes(seen, twice))
    left, _ = pruned(seen, residual, twice, threshold=25.0)
    assert len(left) == 1
    assert left.motion[0, 0] == pytest.approx(true[0, 0], abs=0.005)


def test_of_two_points_at_one_place_the_weaker_is_pruned_at_any_loss():
    """Two whose great amplitudes nearly cancel fit the growth of one, and have no azimuth."""
    seen = observed([replace(NEAR, power=100.0, spreading=40.0)], noise=1e-3)
    true = in_the_middle(seen, [NEAR])
    twice = points_at(seen, np.vstack([true, true + np.array([2e-3, 4e-3, 0.0])]), floor=1e-3)
    twice = with_amplitudes(seen, twice)
    residual = Residual.of(seen, twice)
    one = Residual.of(seen, with_amplitudes(seen, twice[:1]))
    assert one.energy > residual.energy + 25.0 * 1e-3
    left, after = pruned(seen, residual, twice, threshold=25.0)
    assert len(left) == 1
    assert after.energy > residual.energy


def test_pruning_keeps_two_points():
    seen = observed([NEAR, BESIDE], noise=0.01)
    points = points_at(seen, in_the_middle(seen, [NEAR, BESIDE]), floor=0.01)
    points, residual = fitted_to_the_end(seen, with_amplitudes(seen, points))
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
    seen = replace(seen, samples=both)
    middle = points_at(seen, true.motion[:1, :3] + [[0.5 * cell, 0.0, 0.0]], floor=1.0)
    one, residual = fitted_to_the_end(seen, with_amplitudes(seen, middle))
    found, _ = divided(seen, residual, one, threshold=20.0)
    assert len(found) == 2
    assert np.ptp(found.motion[:, 0]) == pytest.approx(cell, rel=0.35)


def test_a_lone_point_is_not_divided():
    for seed in range(6):
        one = frame_of(RAMPS, [replace(NEAR, power=1.0)], noise=1.0, seed=seed)
        seen = Observation.of(one, mitigated(None, one))
        points = points_at(seen, in_the_middle(seen, [NEAR]), floor=1.0)
        points, residual = fitted_to_the_end(seen, with_amplitudes(seen, points))
        assert len(divided(seen, residual, points, threshold=20.0)[0]) == 1


@pytest.mark.parametrize("acceleration", [0.0, 4.0, 20.0, 60.0, 100.0])
def test_an_acceleration_is_found_from_the_motion_without_it(acceleration):
    """One acceleration step, half a wavelength over the square of the frame, is 3 m/s² here."""
    point = HandPoint(range=5.0, range_rate=-9.0, acceleration=acceleration)
    seen = observed([point], noise=1.0)
    true = in_the_middle(seen, [point])
    start = points_at(seen, true * [1.0, 1.0, 0.0], floor=1.0)
    found = accelerated(seen, Residual.of(seen, NOTHING), start, Accelerations.of(seen)).motion[0]
    assert found[2] == pytest.approx(true[0, 2], abs=5.0)
    assert found[1] == pytest.approx(true[0, 1], abs=0.1)


@pytest.mark.parametrize(("distance", "is_believed"), [(8.0, True), (16.0, False)])
def test_an_acceleration_is_believed_that_a_crossing_body_may_have(distance, is_believed):
    """At 30 m/s across the line of sight it is 112 m/s² at 8 m, and 56 m/s² at 16 m."""
    point = HandPoint(range=distance, range_rate=-2.0, acceleration=80.0)
    seen = observed([point], noise=1e-3)
    true = in_the_middle(seen, [point])
    start = points_at(seen, true * [1.0, 1.0, 0.0], floor=1e-3)
    found = accelerated(seen, Residual.of(seen, NOTHING), start, Accelerations.of(seen)).motion[0]
    assert found[2] == pytest.approx(true[0, 2] if is_believed else 0.0, abs=5.0)


def test_no_new_points_have_no_accelerations():
    seen = observed([], noise=1.0)
    assert len(accelerated(seen, Residual.of(seen, NOTHING), NOTHING, Accelerations.of(seen))) == 0


def test_no_acceleration_is_looked_for_where_all_power_adds_up_without(monkeypatch):
    """A point without acceleration has no more power to gain; one of 20 m/s² has."""
    searched = []

    def best(seen, residual, points, *_, **__):
        searched.append(len(points))
        return points

    monkeypatch.setattr(acceleration, "_best", best)
    for value in (0.0, 20.0):
        point = HandPoint(range=5.0, range_rate=-9.0, acceleration=value)
        seen = observed([point], noise=1e-3)
        start = points_at(seen, in_the_middle(seen, [point]) * [1.0, 1.0, 0.0], floor=1e-3)
        accelerated(seen, Residual.of(seen, NOTHING), start, Accelerations.of(seen))
    assert searched == [0, 0, 1, 0]


def test_an_accelerated_point_is_found_from_a_range_that_is_wrong_by_a_cell():
    """The peak of its rising ramps alone is as far away."""
    point = HandPoint(range=5.0, range_rate=-9.0, acceleration=60.0)
    seen = observed([point], noise=1e-3)
    true = in_the_middle(seen, [point])
    start = points_at(seen, true * [1.0, 1.0, 0.0] + [seen.range_cell, 0.0, 0.0], floor=1e-3)
    found = accelerated(seen, Residual.of(seen, NOTHING), start, Accelerations.of(seen)).motion[0]
    assert found[0] == pytest.approx(true[0, 0], abs=0.3 * seen.range_cell)
    assert found[2] == pytest.approx(true[0, 2], abs=5.0)
