"""Coded ramps and carriers: the fast engine against the full band, sample by sample.

The full band looks up the chip that every path sends at each instant.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polychirp.model.ramp import RampSchedule
from polychirp.model.ramp_code import RampCode
from polychirp.synthesis.stretch import coded_ramps
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import paths_of
from tests.property.test_engines_agree import (
    AGREEMENT,
    FILTERS,
    between,
    hand_paths,
    largest_difference,
    mimo_schedules,
    schedules,
    two_radars,
)


@st.composite
def coded(draw, plan, *, longest=2e-6):
    """The ramps with binary or complex chips of 0.05 to 2 µs, of two drawn codes, repeated."""
    chip = draw(between(0.05e-6, longest))
    length = draw(st.integers(2, 4))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    value = random.choice([-1.0, 1.0], size=(2, length)).astype(complex)
    if draw(st.booleans()):
        value = np.sqrt(random.uniform(0.0, 1.0, value.shape)) * np.exp(
            2j * np.pi * random.random(value.shape)
        )
    count = plan.num_ramps
    code = RampCode(value=value, row=np.arange(count) % 2, chip_duration=np.full(count, chip))
    return replace(plan, code=code)


def carrier_of(plan, frequency):
    """The same ramps at one constant frequency."""
    flat = np.full(plan.num_ramps, frequency)
    return replace(plan, slope=0.0 * flat, start_frequency=flat)


@settings(max_examples=6)
@given(data=st.data(), own=schedules(between(0.0, 1e-4)), if_filter=FILTERS)
def test_echoes_of_coded_chirps_are_the_same_from_both_engines(data, own, if_filter):
    plan = data.draw(coded(own))
    paths = data.draw(st.lists(hand_paths(0), min_size=1, max_size=2))
    snapshots = [paths_of(*paths, reference_time=own.start_time[0])]
    scene = two_radars(if_filter)
    assert largest_difference(scene, [plan, plan], snapshots, 0) < AGREEMENT


@settings(max_examples=6)
@given(data=st.data(), own=schedules(between(0.0, 1e-4)), if_filter=FILTERS)
def test_echoes_of_coded_carriers_are_the_same_from_both_engines(data, own, if_filter):
    plan = data.draw(coded(carrier_of(own, 79e9)))
    paths = data.draw(st.lists(hand_paths(0), min_size=1, max_size=2))
    snapshots = [paths_of(*paths, reference_time=own.start_time[0])]
    scene = two_radars(if_filter)
    assert largest_difference(scene, [plan, plan], snapshots, 0) < AGREEMENT


@settings(max_examples=12)
@given(
    data=st.data(),
    own=schedules(st.just(0.0)),
    sent=mimo_schedules(between(-12e-6, 12e-6)),
    victim=st.sampled_from(["chirps", "carrier"]),
    other=st.sampled_from(["chirps", "carrier"]),
    offset=st.sampled_from([0.0, 2e6, 60e6]),
    if_filter=FILTERS,
)
def test_coded_interference_is_the_same_from_both_engines(
    data, own, sent, victim, other, offset, if_filter
):
    """Victims that chirp or hold their frequency, and interferers that do, with short chips."""
    own = carrier_of(own, 79e9) if victim == "carrier" else own
    sent = carrier_of(sent, 79e9 + offset) if other == "carrier" else sent
    sent = data.draw(coded(sent, longest=data.draw(st.sampled_from([0.2e-6, 2e-6]))))
    paths = data.draw(st.lists(hand_paths(1), min_size=1, max_size=2))
    snapshots = [paths_of(*paths, reference_time=4e-6)]
    assert largest_difference(two_radars(if_filter), [own, sent], snapshots, 1) < AGREEMENT


@settings(max_examples=5)
@given(
    data=st.data(),
    own=schedules(st.just(0.0)),
    sent=schedules(between(-12e-6, 12e-6)),
    path=hand_paths(1),
    if_filter=FILTERS,
)
def test_chirps_reach_a_coded_victim_alike_in_both_engines(data, own, sent, path, if_filter):
    """A victim's code is not in its mixer: it hears chirps as without the code."""
    own = data.draw(coded(carrier_of(own, 79e9)))
    frame = two_radars(if_filter), [own, sent], [paths_of(path, reference_time=4e-6)]
    assert largest_difference(*frame, 1) < AGREEMENT
    plain = (frame[0], [replace(own, code=None), sent], frame[2])
    heard, expected = (
        Stretch().contribution(*one, victim=0, transmitter=1) for one in (frame, plain)
    )
    np.testing.assert_array_equal(heard, expected)


@settings(max_examples=5)
@given(
    data=st.data(),
    own=schedules(st.just(0.0)),
    sent=schedules(between(-12e-6, 12e-6)),
    path=hand_paths(1),
    if_filter=FILTERS,
)
def test_chips_and_ramps_of_their_own_give_the_same_samples(data, own, sent, path, if_filter):
    """Filon's rule against the closed form of each chip, whatever its length."""
    sent = data.draw(coded(sent))
    frame = two_radars(if_filter), [own, sent], [paths_of(path, reference_time=4e-6)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coded_ramps, "LONG_CHIP", np.inf)
        as_chips = Stretch().contribution(*frame, victim=0, transmitter=1)
        patch.setattr(coded_ramps, "LONG_CHIP", 0.0)
        patch.setattr(coded_ramps, "STEADY_TURN", -1.0)
        as_ramps = Stretch().contribution(*frame, victim=0, transmitter=1)
    largest = np.abs(as_ramps).max()
    assert np.abs(as_chips - as_ramps).max() < AGREEMENT * max(largest, 1e-300)


@settings(max_examples=4)
@given(
    data=st.data(),
    own=schedules(st.just(0.0)),
    offset=st.sampled_from([0.0, 1.5e6, -30e6, 100e6]),
    if_filter=FILTERS,
)
def test_parallel_coded_ramps_are_the_same_as_jumps_and_as_ramps(data, own, offset, if_filter):
    """Another radar with the same slopes, in band and out of it: sums of jumps and the full band.

    Chips are long, so that they would be ramps of their own if beats were not steady.
    """
    chip = data.draw(between(0.4e-6, 3e-6))
    plan = data.draw(coded(replace(own, start_frequency=own.start_frequency + offset)))
    code = replace(plan.code, chip_duration=np.full(plan.num_ramps, chip))
    sent = replace(plan, code=code, start_time=own.start_time + data.draw(between(-1e-7, 1e-7)))
    paths = data.draw(st.lists(hand_paths(1), min_size=1, max_size=2))
    frame = two_radars(if_filter), [own, sent], [paths_of(*paths, reference_time=4e-6)]
    as_jumps = Stretch().contribution(*frame, victim=0, transmitter=1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coded_ramps, "STEADY_TURN", -1.0)
        as_ramps = Stretch().contribution(*frame, victim=0, transmitter=1)
    assert np.abs(as_jumps - as_ramps).max() < AGREEMENT * max(np.abs(as_ramps).max(), 1e-300)
    assert largest_difference(*frame, 1) < AGREEMENT


def test_a_code_of_ones_changes_nothing():
    plan = RampSchedule(
        start_time=[0.0], duration=[1e-5], start_frequency=[79e9], slope=[1e13], start_phase=[0.2],
        sweep=[0],
    )  # fmt: skip
    ones = RampCode(value=np.ones((1, 5)), row=[0], chip_duration=[1e-6])
    parts, _whole = coded_ramps.sub_ramps(replace(plan, code=ones))
    np.testing.assert_array_equal(parts.duration, plan.duration)
    np.testing.assert_array_equal(parts.start_phase, plan.start_phase)
