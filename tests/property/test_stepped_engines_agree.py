"""Steps of constant frequency: the fast engine against the full band, sample by sample."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from polychirp.model.if_filter import IfFilter
from polychirp.model.ramp import RampSchedule
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from tests.property.test_engines_agree import (
    AGREEMENT,
    FILTERS,
    between,
    hand_paths,
    largest_difference,
    schedules,
    two_radars,
)


@st.composite
def staircases(draw, start):
    """Six steps of two sequences, 5 to 9 µs each, touching or apart."""
    step, idle = draw(between(5e-6, 9e-6)), draw(st.sampled_from([0.0, 0.4e-6]))
    increment = draw(between(0.3e6, 6e6))
    shift = draw(st.sampled_from([-1.5, -0.5, 0.0, 2.0])) * increment
    number = np.arange(6)
    return RampSchedule(
        start_time=draw(start) + number * (step + idle),
        duration=np.full(6, step),
        start_frequency=79e9 + (number // 2) * increment + (number % 2) * shift,
        slope=np.zeros(6),
        start_phase=[draw(between(0.0, 1.0)) for _ in range(6)],
        sweep=np.zeros(6, dtype=np.int64),
    )


@settings(max_examples=12)
@given(
    own=staircases(between(0.0, 1e-4)),
    paths=st.lists(hand_paths(0), min_size=1, max_size=2),
    if_filter=FILTERS,
)
def test_echoes_of_steps_are_the_same_from_both_engines(own, paths, if_filter):
    """The echo of a step goes on in the next one for its delay, at another beat."""
    snapshots = [paths_of(*paths, reference_time=own.start_time[0])]
    assert largest_difference(two_radars(if_filter), [own, own], snapshots, 0) < AGREEMENT


@settings(max_examples=12)
@given(
    own=staircases(st.just(0.0)),
    sent=schedules(between(-12e-6, 12e-6)),
    paths=st.lists(hand_paths(1), min_size=1, max_size=2),
    if_filter=FILTERS,
)
def test_chirps_cross_steps_alike_in_both_engines(own, sent, paths, if_filter):
    snapshots = [paths_of(*paths, reference_time=4e-6)]
    assert largest_difference(two_radars(if_filter), [own, sent], snapshots, 1) < AGREEMENT


@settings(max_examples=12)
@given(
    own=schedules(st.just(0.0)),
    sent=staircases(between(-12e-6, 12e-6)),
    paths=st.lists(hand_paths(1), min_size=1, max_size=2),
    if_filter=FILTERS,
)
def test_steps_cross_chirps_alike_in_both_engines(own, sent, paths, if_filter):
    snapshots = [paths_of(*paths, reference_time=4e-6)]
    assert largest_difference(two_radars(if_filter), [own, sent], snapshots, 1) < AGREEMENT


@settings(max_examples=12)
@given(
    own=staircases(st.just(0.0)),
    sent=staircases(between(-12e-6, 12e-6)),
    paths=st.lists(hand_paths(1), min_size=1, max_size=2),
    if_filter=FILTERS,
)
def test_steps_reach_other_steps_alike_in_both_engines(own, sent, paths, if_filter):
    snapshots = [paths_of(*paths, reference_time=4e-6)]
    assert largest_difference(two_radars(if_filter), [own, sent], snapshots, 1) < AGREEMENT


def test_the_step_before_is_heard_for_the_delay_of_its_echo():
    """Its beat is the shift, outside of the filter, and that of its own step is the Doppler shift.

    One microsecond after a step's start, an echo of 1 µs has passed the change; before it, the
    mixer's product is 40 MHz away, and a filter of 3 MHz removes it but for half its response.
    """
    scene = two_radars(IfFilter(passband=3e6, stopband=6e6))
    step, number = 8e-6, np.arange(4)
    plan = RampSchedule(
        start_time=number * step,
        duration=np.full(4, step),
        start_frequency=79e9 + 40e6 * number,
        slope=np.zeros(4),
        start_phase=np.zeros(4),
        sweep=np.zeros(4, dtype=np.int64),
    )
    path = HandPath(transmitter=0, delay=1e-6, gain=1.0)
    sums = Stretch().contribution(
        scene, [plan, plan], [paths_of(path, reference_time=0.0)], victim=0, transmitter=0
    )
    of_step = sums.sum(axis=0)[0, 1]
    late = 0.1e-6 + np.arange(of_step.size) / 10e6
    half = 0.5 * scene.radars[0].if_filter.support
    level = np.abs(of_step) / np.abs(of_step).max()
    settled = (late > 1e-6 + half) & (late < step - half)
    np.testing.assert_allclose(level[settled], np.mean(level[settled]), rtol=1e-4)
    assert np.all(level[late < 0.3e-6] < 0.2)
