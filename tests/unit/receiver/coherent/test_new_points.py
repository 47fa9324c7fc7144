"""Peaks that are tried as new points, once and one after the other where they share beats."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.receiver.coherent.acceleration import Accelerations
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.coherent_map import OTHER, MapLimits, coherent_map, map_axes
from polychirp.receiver.coherent.new_points import (
    GREATEST_SPREAD,
    MOST_AT_ONCE,
    MOST_SMEARED,
    Trial,
    bright_points,
    distinct,
    further_points,
    new_points,
    shares_beats,
    smeared_points,
    still_shown,
)
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.peaks import GREATEST_LOSS, peaks
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.profiles import Profiles
from polychirp.receiver.coherent.refinement import settled
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=8, streams=Streams(4))
STRONG = HandPoint(range=12.3, range_rate=-7.7, azimuth=0.2, power=10.0)
WEAK = HandPoint(range=21.0, range_rate=4.0, azimuth=-0.3, power=1.0)
THRESHOLD = 25.0
NOTHING = Points.none(4)


def shown(points):
    """The peaks of a map, and a trial of them."""
    frame = frame_of(RAMPS, points, noise=1.0, seed=1)
    seen = Observation.of(frame, mitigated(None, frame))
    axes = map_axes(seen, MapLimits.of(CoherentReceiver()))
    residual = Residual.of(seen, NOTHING)
    whole = coherent_map(seen, Profiles.of(seen, residual.spectra, axes))
    trial = Trial.of(
        whole,
        residual,
        Accelerations.of(seen),
        threshold=THRESHOLD,
        is_tried=np.zeros(whole.power.shape, dtype=bool),
    )
    return peaks(whole, axes, THRESHOLD), trial


def test_bright_peaks_are_all_that_show_points_and_are_near_the_strongest_of_them():
    found, trial = shown([STRONG, WEAK])
    is_point = trial.seen_map.agreement(found.cell).shows_points(
        found.floor, GREATEST_LOSS * THRESHOLD
    )
    least = GREATEST_SPREAD * found.power[is_point].max()
    slow = np.sort(found.power[is_point & (found.power >= least)])
    assert 0 < slow.size < found.power.size
    assert np.sort(bright_points(trial, found).power).tolist() == slow.tolist()


def ranges(points):
    return sorted(points.motion[:, 0])


def test_points_far_from_each_other_are_found_together():
    found, trial = shown([STRONG, WEAK])
    assert ranges(new_points(trial, found)) == pytest.approx([12.3, 21.0], abs=0.3)


def test_what_has_been_tried_is_not_tried_again():
    found, trial = shown([STRONG, WEAK])
    new_points(trial, found)
    same = found[np.abs(found.range - 21.0) < 0.1]
    assert np.any(trial.shows_points(same))
    assert len(further_points(trial, same[same.ratio > 0.9 * same.ratio.max()], NOTHING)) == 0


def test_no_point_is_new_where_a_stronger_new_one_has_its_beats():
    found, trial = shown([STRONG])
    near = found[np.abs(found.range - 12.3) < 1.0]
    fresh = further_points(trial, near, NOTHING)
    assert len(fresh) == 1
    assert np.sum(np.abs(near.range - 12.3) < 1.0) > 1


def test_peaks_of_what_is_subtracted_are_not_shown_any_more():
    """The weak point stays, and a peak that was none of a point does not become one."""
    found, trial = shown([STRONG, WEAK])
    fresh = new_points(trial, found)
    first = fresh[np.argsort(-fresh.strength)[:1]]
    _, left = settled(trial.seen, Residual.of(trial.seen, first), first)
    again = replace(trial, residual=left, is_tried=np.zeros_like(trial.is_tried))
    others = found[~trial.shows_points(found)]
    before, after = still_shown(again, others), still_shown(again, found)
    assert len(before.range) == 0
    assert np.any(np.abs(after.range - 21.0) < 0.3)
    assert not np.any(np.abs(after.range - 12.3) < 0.3)


def test_peaks_that_show_no_points_are_tried_where_the_strongest_is_one_of_them():
    found, trial = shown([STRONG])
    assert len(smeared_points(trial, found)) == 0
    assert not np.any(trial.is_tried)
    trial.seen_map.known[:] = OTHER
    assert ranges(smeared_points(trial, found)) == pytest.approx([12.3], abs=0.3)
    order = np.argsort(-found.power)[:MOST_SMEARED]
    assert np.mean(trial.is_tried[tuple(found.cell[order].T)]) > 0.5


def strongest(found, count=40):
    return found[np.argsort(-found.power, kind="stable")[:count]]


@pytest.mark.parametrize("seed", range(4))
def test_peaks_may_show_points_wherever_a_search_of_the_acceleration_finds_one(seed):
    """Bodies that pass nearby, whose peaks are too weak for points without it."""
    draw = np.random.default_rng([78, seed])
    passers = [
        HandPoint(
            range=distance,
            range_rate=draw.uniform(-9.0, 9.0),
            acceleration=draw.uniform(20.0, 90.0),
            azimuth=draw.uniform(-0.5, 0.5),
            power=draw.uniform(0.1, 1.0),
        )
        for distance in (5.0, 11.0, 17.0)
    ]
    found, trial = shown(passers)
    found = strongest(found)
    may_be = trial.may_show_points(found)
    _, is_point = trial.starts(found)
    assert np.sum(is_point) > 3
    assert np.mean(may_be[is_point]) > 0.9
    assert np.sum(is_point & ~trial.shows_points(found)) > 0


@pytest.mark.parametrize(("over", "may_be"), [(0.5, True), (2.0, False)])
def test_peaks_show_no_points_where_bodies_leave_more_than_all_ramps_have(over, may_be):
    found, trial = shown([STRONG])
    found = strongest(found, 1)
    left = over * found.power / THRESHOLD
    bodies = SimpleNamespace(residues=lambda _seen, at, **_how: np.full(len(at), left))
    assert trial.may_show_points(found).tolist() == [True]
    assert replace(trial, bodies=bodies).may_show_points(found).tolist() == [may_be]


def test_a_trial_of_the_same_residual_keeps_its_bodies():
    found, trial = shown([STRONG, WEAK])
    fresh = new_points(trial, found)
    left = Residual.of(trial.seen, fresh)
    assert trial.after(trial.residual) is trial
    assert trial.after(left).residual is left
    assert trial.after(left).bodies.rate.tolist() == fresh.motion[:, 1].tolist()
    assert trial.after(left).is_tried is trial.is_tried


def test_places_share_beats_if_rising_ramps_alone_have_the_same():
    """The range changes a rising ramp's beat as much as the range rate changes it back."""
    ramps = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(num_sweeps=8, streams=Streams(4))
    frame = frame_of(ramps, [], noise=1.0)
    seen = Observation.of(frame, mitigated(None, frame))
    here = np.array([[12.0, 3.0]])
    rate = -2.0 * np.max(ramps.slope) / float(seen.frequency.mean())
    assert shares_beats(seen, here, here).all()
    assert shares_beats(seen, here, here + np.array([2.0, rate])).all()
    assert not shares_beats(seen, here, here + np.array([2.0, 0.0])).any()


def test_distinct_places_are_the_strongest_ones():
    _, trial = shown([])
    motion = np.array([[12.0, 3.0], [12.05, 3.0], [18.0, 3.0], [25.0, -3.0]])
    power = np.array([1.0, 2.0, 0.5, 0.001])
    assert distinct(trial.seen, motion, power).tolist() == [1, 2]


def test_distinct_places_share_beats_with_no_stronger_one():
    """One place after the other, against those that are taken before it."""
    _, trial = shown([])
    draw = np.random.default_rng(6)
    motion = np.column_stack([draw.uniform(1.0, 30.0, 200), draw.uniform(-30.0, 30.0, 200)])
    power = draw.uniform(0.5, 1.0, 200)
    slow = []
    for n in np.argsort(-power)[: 8 * MOST_AT_ONCE]:
        if not np.any(shares_beats(trial.seen, motion[[n]], motion[slow])):
            slow.append(n)
    assert len(slow) > 2
    assert distinct(trial.seen, motion, power).tolist() == slow[:MOST_AT_ONCE]
