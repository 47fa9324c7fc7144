"""Weights of ramps, white channels, and what tells points from interference."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.receiver.coherent.agreement import Agreement
from polychirp.receiver.coherent.coherent_map import (
    MapLimits,
    channel_covariance,
    coherent_map,
    coherent_power,
    map_axes,
)
from polychirp.receiver.coherent.noise import ramp_weights, whitening
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.profiles import STEPS_PER_RANGE, Profiles
from polychirp.receiver.coherent.ramps import Ramps
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.search import find_points
from polychirp.receiver.coherent.spectra import Spectra
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.interference import with_noisy_ramps
from tests.support.points import HandPoint, frame_of
from tests.support.profiles import in_order

RAMPS = {
    "equal": Triangular(bandwidth=1e9, ramp_duration=1e-3),
    "diverse": DiverseTriangular(),
}
LIMITS = MapLimits(range=(0.5, 20.0), range_rate=(-12.0, 12.0))


def nothing_from(seen):
    """The residual of a frame from which no point is subtracted."""
    return Residual.of(seen, Points.none(len(seen.samples)))


def frame(kind="diverse", points=(), **options):
    ramps = RAMPS[kind].schedule(num_sweeps=8, streams=Streams(3))
    return frame_of(ramps, points, seed=8, **options)


def observed(one):
    return Observation.of(one, mitigated(None, one))


def noisy(one, ramps, power):
    level = np.zeros(one.schedule.num_ramps)
    level[ramps] = power
    return with_noisy_ramps(one, level)


def points_at(seen, motion):
    count = len(motion)
    return Points(
        motion=np.column_stack([motion, np.zeros(count)]),
        amplitude=np.zeros((count, seen.samples.shape[0]), dtype=np.complex128),
        floor=np.ones(count),
        sine=np.zeros(count),
        growth=np.zeros(count),
        power=np.zeros(count),
    )


@pytest.mark.parametrize("kind", RAMPS)
def test_the_agreement_at_cells_is_that_of_shifted_profiles(kind):
    """Profiles are chosen and turned one after the other, and added by NumPy."""
    one = noisy(frame(kind, [HandPoint(range=12.0, range_rate=-5.0)]), [3, 8], 9.0)
    axes = map_axes(observed(one), LIMITS)
    seen, profiles = adapted(one, axes)
    draw = np.random.default_rng(5)
    cell = draw.integers(0, (axes.range_rate.size, axes.range.size), (50, 2))
    place, turn = profiles.places(seen, axes.range_rate[cell[:, 0]])
    ramp, place = np.arange(place.shape[1]), place + STEPS_PER_RANGE * cell[:, 1:]
    real, imag = in_order(profiles.value)
    value = ((real + 1j * imag)[:, ramp, place] * turn).transpose(1, 0, 2)
    weight = in_order(profiles.weight)[ramp, place].astype(np.float64)
    shown = Agreement.of(seen, *profiles.at(seen, cell))

    def power_of(which):
        total = np.sum(np.abs(value[..., which].sum(axis=-1)) ** 2, axis=1)
        return total / weight[:, which].sum(axis=1)

    rises = seen.model.schedule.slope > 0
    power = power_of(np.ones_like(rises))
    energy = np.sum(np.abs(value) ** 2 / weight[:, None], axis=(1, 2))
    assert shown.power == pytest.approx(power)
    assert shown.difference == pytest.approx(power_of(rises) + power_of(~rises) - power)
    assert shown.spread * shown.num_averaged == pytest.approx(energy - power)


@pytest.mark.parametrize("kind", RAMPS)
def test_ramps_of_white_noise_all_count_fully(kind):
    seen = observed(frame(kind))
    assert np.min(ramp_weights(seen, Spectra.of(seen, seen.samples))) == 1.0


@pytest.mark.parametrize("kind", RAMPS)
def test_a_strong_echo_in_motion_does_not_count_as_noise(kind):
    seen = observed(frame(kind, [HandPoint(range=12.0, range_rate=-25.0, power=1.0)]))
    assert np.min(ramp_weights(seen, Spectra.of(seen, seen.samples))) == 1.0


def test_a_noisy_ramp_counts_by_the_inverse_of_its_noise():
    """Its median is 0.69 of the mean, since it is the same on all channels; else it is 0.92."""
    one = noisy(frame(), [3, 8], 99.0)
    seen = observed(one)
    weight = ramp_weights(seen, Spectra.of(seen, one.samples))
    others = np.delete(np.arange(one.schedule.num_ramps), [3, 8])
    assert np.min(weight[others]) == 1.0
    assert np.median(weight[[3, 8]]) == pytest.approx(0.01 * 0.918 / 0.693, rel=0.1)


def test_few_ramps_have_no_usual_level():
    ramps = RAMPS["equal"].schedule(num_sweeps=3, streams=Streams(3))
    one = noisy(frame_of(ramps, []), [1], 99.0)
    seen = observed(one)
    assert np.min(ramp_weights(seen, Spectra.of(seen, one.samples))) == 1.0


def test_whitening_makes_channels_white_and_keeps_their_mean_power():
    draw = np.random.default_rng(4)
    root = draw.normal(size=(4, 4)) + 1j * draw.normal(size=(4, 4))
    covariance = root @ root.conj().T
    mixing = whitening(covariance)
    white = mixing @ covariance @ mixing.conj().T
    assert white == pytest.approx(np.trace(covariance).real / 4 * np.eye(4), abs=1e-9)


def adapted(one, axes):
    seen = observed(one)
    seen = replace(seen, weight=ramp_weights(seen, Spectra.of(seen, seen.samples)))
    profiles = Profiles.of(seen, Spectra.of(seen, seen.samples), axes)
    mixing = whitening(channel_covariance(seen, profiles))
    return replace(seen, mixing=mixing), profiles.mixed(mixing)


@pytest.mark.parametrize("kind", RAMPS)
def test_the_weighted_map_is_the_weighted_sum_over_all_samples(kind):
    point = HandPoint(range=12.3, range_rate=-7.7, power=0.5)
    one = noisy(frame(kind, [point]), [2, 4, 6], 30.0)
    axes = map_axes(observed(one), LIMITS)
    seen, profiles = adapted(one, axes)
    fast = coherent_map(seen, profiles)
    top = np.array(np.unravel_index(np.argmax(fast.power), fast.power.shape))
    drawn = np.random.default_rng(6).integers(0, fast.power.shape, size=(60, 2))
    cells = np.vstack([top, drawn])
    motion = np.stack([axes.range[cells[:, 1]], axes.range_rate[cells[:, 0]], 0 * cells[:, 0]], 1)
    slow = coherent_power(seen, seen.samples, motion)
    exact = Agreement.at(seen, nothing_from(seen), points_at(seen, motion))
    near = fast.agreement(cells)
    assert exact.power[0] == pytest.approx(slow[0], rel=1e-3)
    assert exact.power == pytest.approx(slow, rel=0.15)  # the azimuth's delays turn side lobes
    assert near.power[0] == pytest.approx(slow[0], rel=0.1)
    assert near.difference[0] < 0.02 * near.power[0]
    assert np.median(near.power) == pytest.approx(np.median(slow), rel=0.15)
    apart = np.abs(near.difference - exact.difference)
    assert np.median(apart) < 0.3 * np.median(exact.difference)
    assert np.mean(np.abs(near.spread - exact.spread) < 0.35 * exact.spread) > 0.8
    assert np.median(near.spread) == pytest.approx(np.median(exact.spread), rel=0.1)


def test_spread_and_difference_of_noise_are_its_power():
    one = frame(noise=2.0)
    axes = map_axes(observed(one), LIMITS)
    seen = observed(one)
    whole = coherent_map(seen, Profiles.of(seen, Spectra.of(seen, seen.samples), axes))
    drawn = np.random.default_rng(4).integers(0, whole.power.shape, size=(4000, 2))
    shown = whole.agreement(drawn)
    assert shown.spread.mean() == pytest.approx(2.0, rel=0.03)
    assert shown.difference.mean() == pytest.approx(4 * 2.0, rel=0.05)


@pytest.mark.parametrize("kind", RAMPS)
def test_beats_on_rising_ramps_alone_are_no_point(kind):
    """Half of the power adds up there, and as much is in the difference."""
    one = frame(kind, [HandPoint(range=12.3, range_rate=-7.7, power=10.0)])
    rises = one.schedule.slope > 0
    seen = observed(one)
    late = seen.model.time - float(one.schedule.start_time[0])
    there = points_at(seen, np.array([[12.3 - 7.7 * late, -7.7, 0.0]]))
    whole = Agreement.at(seen, nothing_from(seen), there)
    half = Agreement.at(
        seen, nothing_from(replace(seen, samples=seen.samples * rises[:, None])), there
    )
    assert whole.shows_points(np.ones(1), 25.0)[0]
    assert whole.difference[0] < 0.01 * whole.power[0]
    assert half.difference[0] == pytest.approx(half.power[0], rel=0.05)
    assert not half.shows_points(np.ones(1), 25.0)[0]


def test_interference_on_one_ramp_is_no_point():
    """It is as strong as a point of 30 dB, and adds up with no other ramp."""
    point = HandPoint(range=12.3, range_rate=-7.7, power=100.0)
    one = frame("equal", [point], noise=1e-6)
    one = replace(one, samples=one.samples * (np.arange(one.schedule.num_ramps) == 4)[:, None])
    seen = observed(one)
    late = seen.model.time - float(one.schedule.start_time[0])
    there = points_at(seen, np.array([[12.3 - 7.7 * late, -7.7, 0.0]]))
    shown = Agreement.at(seen, nothing_from(seen), there)
    assert shown.power[0] > 1000.0
    assert not shown.shows_points(np.full(1, 1e-6), 5.0)[0]


def with_samples(seen, present):
    ramps = Ramps.of(seen.model, present)
    return replace(seen, samples=seen.samples * present, present=present, ramps=ramps)


def detected(left):
    axes = map_axes(left, LIMITS)
    samples = nothing_from(left)
    return find_points(left, samples, axes, threshold=25.0, dynamic_range=1e7, most=50)[0]


def test_ramps_without_samples_are_as_if_they_were_not_there():
    seen = observed(frame(points=[HandPoint(range=12.3, range_rate=-7.7, power=1.0)]))
    present = seen.present.copy()
    present[[3, 8]] = False
    left = with_samples(seen, present)
    assert np.min(ramp_weights(left, Spectra.of(left, left.samples))) == 1.0
    assert len(detected(left)) == 1


def test_a_frame_without_samples_or_without_noise_has_no_points():
    seen = observed(frame())
    assert len(detected(with_samples(seen, np.zeros_like(seen.present)))) == 0
    assert len(detected(replace(seen, samples=0.0 * seen.samples))) == 0
