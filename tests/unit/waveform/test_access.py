"""Rules by which radars share time and band."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.config.load import build
from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.study.spec import Study, StudyRadar, schedules_of
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import (
    Access,
    Compass,
    RandomStarts,
    Sawtooth,
    Slots,
    SlottedAloha,
)

RULES = [
    RandomStarts(period=1e-3),
    SlottedAloha(slot=2e-6, num_slots=10),
    Slots(slot=2e-6, num_slots=40),
    Compass(num_bands=4, spacing=250e6),
]
NAMES = [f"radar {n}" for n in range(40)]
HEADING = np.linspace(-3.0, 3.0, 40)


def given(rule, *, seed=1, names=NAMES):
    return rule.assign(names=names, heading=HEADING[: len(names)], streams=Streams(seed))


@pytest.fixture(params=RULES, ids=repr)
def rule(request):
    return request.param


def test_a_rule_gives_every_radar_a_delay_and_a_shift(rule):
    assert isinstance(rule, Access)
    one = given(rule)
    assert one.delay.shape == one.shift.shape == (40,)
    assert np.all(one.delay >= 0)


def test_equal_streams_give_equal_assignments(rule):
    one, again = given(rule), given(rule)
    np.testing.assert_array_equal(one.delay, again.delay)
    np.testing.assert_array_equal(one.shift, again.shift)


def test_a_further_radar_moves_no_other(rule):
    fewer, more = given(rule, names=NAMES[:20]), given(rule)
    np.testing.assert_array_equal(fewer.delay, more.delay[:20])
    np.testing.assert_array_equal(fewer.shift, more.shift[:20])


def test_agreed_slots_are_all_different_and_are_used_again_when_they_are_full():
    assert len(set(given(Slots(slot=2e-6, num_slots=40)).delay)) == 40
    counts = np.unique(given(Slots(slot=2e-6, num_slots=10)).delay, return_counts=True)[1]
    np.testing.assert_array_equal(counts, np.full(10, 4))


def test_drawn_slots_are_alone_as_often_as_slotted_aloha_says():
    """A slot is alone with the probability (1 − 1/n)^(N−1); of 4 000 the spread is 0.008."""
    rule, alone = SlottedAloha(slot=1e-6, num_slots=30), 0
    for seed in range(100):
        _, where, counts = np.unique(
            given(rule, seed=seed).delay, return_inverse=True, return_counts=True
        )
        alone += int(np.sum(counts[where] == 1))
    assert alone / 4000 == pytest.approx((1 - 1 / 30) ** 39, abs=0.035)


def test_random_starts_fill_the_period():
    delay = np.concatenate([given(RULES[0], seed=seed).delay for seed in range(20)])
    assert delay.max() < 1e-3
    assert np.histogram(delay, bins=4, range=(0, 1e-3))[0].min() > 150


@pytest.mark.parametrize("num_bands", [2, 3, 4, 8])
def test_radars_that_face_each_other_are_in_different_bands(num_bands):
    heading = np.linspace(-7.0, 7.0, 101)
    both = [
        Compass(num_bands=num_bands, spacing=1.0).assign(
            names=["radar"] * 101, heading=heading + turn, streams=Streams(1)
        )
        for turn in (0.0, np.pi)
    ]
    assert np.all(both[0].shift != both[1].shift)


# ── in a study ────────────────────────────────────────────────────────────────

WAVEFORM = Sawtooth(start_frequency=76e9, bandwidth=250e6, ramp_duration=20e-6, idle=5e-6)


def study(access):
    return Study(
        name="road",
        street=Street(
            vehicles=(
                Vehicle(name="ego", x=0.0, y=0.0),
                Vehicle(name="oncoming", x=40.0, y=3.5, heading=np.pi),
            )
        ),
        radars=(
            StudyRadar(name="front", vehicle="ego", waveform=WAVEFORM),
            StudyRadar(name="other", vehicle="oncoming", waveform=WAVEFORM, start_time=1e-4),
        ),
        access=access,
    )


def test_a_study_without_a_rule_is_as_before():
    front, other = schedules_of(study(None))
    assert front.start_time[0] == 0.0
    assert other.start_time[0] == pytest.approx(1e-4)
    np.testing.assert_array_equal(front.start_frequency, 76e9)


def test_slots_delay_radars_and_compass_bands_shift_them():
    starts = [one.start_time[0] for one in schedules_of(study(Slots(slot=3e-6, num_slots=2)))]
    assert sorted([starts[0], starts[1] - 1e-4]) == pytest.approx([0.0, 3e-6])
    front, other = schedules_of(study(Compass(num_bands=2, spacing=250e6)))
    assert front.start_frequency[0] == pytest.approx(76e9)
    assert other.start_frequency[0] == pytest.approx(76.25e9)
    np.testing.assert_array_equal(front.slope, other.slope)


def test_another_seed_draws_other_starts_and_the_same_waveform():
    one = study(RandomStarts(period=1e-3))
    first, second = schedules_of(one)[0], schedules_of(replace(one, seed=2))[0]
    assert first.start_time[0] != second.start_time[0]
    np.testing.assert_allclose(np.diff(first.start_time), np.diff(second.start_time))


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"kind": "compass", "num_bands": 1, "spacing": "1 MHz"}, "a num_bands of 2 or more"),
        ({"kind": "slots", "slot": "0 s", "num_slots": 3}, "slots needs a positive slot, not 0"),
        ({"kind": "slot", "slot": "1 s"}, "there is no 'slot'; did you mean 'slots'"),
        ({"kind": "random-starts"}, "period: is missing"),
    ],
)
def test_a_rule_that_cannot_be_is_refused_with_its_place(table, sentence):
    vehicles = {"vehicles": [{"name": "ego", "x": "0 m", "y": "0 m"}]}
    with pytest.raises(InputError) as caught:
        build(Study, {"name": "road", "street": vehicles, "radars": [], "access": table})
    assert sentence in str(caught.value)
    assert "access" in str(caught.value)
