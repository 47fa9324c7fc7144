"""Rules from frame to frame, as plain data."""

import numpy as np
import pytest

from polychirp.config.load import build
from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.study.spec import Study
from polychirp.waveform import (
    Access,
    Compass,
    FrameRule,
    HopAfterHit,
    ListenBeforeTalk,
    Listening,
    MeasuredInterference,
    RedrawEachFrame,
    Turn,
)

QUIET, HIT = (
    MeasuredInterference(inr=0.0, hit_ramps=0.0),
    MeasuredInterference(inr=1.0, hit_ramps=0.5),
)
RULES = [
    RedrawEachFrame(num_slots=10, slot=2e-6, start_spread=1e-6, num_channels=4, spacing=75e6),
    HopAfterHit(num_slots=10, slot=2e-6, start_spread=1e-6, num_channels=4, spacing=75e6),
    ListenBeforeTalk(),
]


@pytest.fixture(params=RULES, ids=lambda rule: rule.kind)
def rule(request):
    return request.param


def test_a_rule_from_frame_to_frame_gives_the_first_turns_as_every_rule_does(rule):
    assert isinstance(rule, Access)
    assert isinstance(rule, FrameRule)
    names = [f"radar {n}" for n in range(30)]
    one, again = (
        rule.assign(names=names[:n], heading=np.zeros(n), streams=Streams(1)) for n in (30, 20)
    )
    np.testing.assert_array_equal(one.delay[:20], again.delay)
    assert len(set(one.delay)) == 30


def test_only_a_rule_that_listens_is_asked_to_wait(rule):
    assert isinstance(rule, Listening) == (rule.kind == "listen-before-talk")
    assert not isinstance(Compass(num_bands=2, spacing=1.0), FrameRule)


def test_equal_streams_give_equal_turns(rule):
    turns = [rule.next_turn(Turn(), HIT, streams=Streams(3)) for _ in range(2)]
    assert turns[0] == turns[1]


def test_a_radar_keeps_its_turn_after_a_clean_frame_and_draws_another_after_a_hit():
    rule, last = RULES[1], Turn(delay=4e-6, shift=75e6, draw=2)
    assert rule.next_turn(last, QUIET, streams=Streams(1)) == last
    assert rule.next_turn(last, HIT, streams=Streams(1)).draw == 3


def test_a_detector_of_bursts_can_trigger_the_hop():
    """Few ramps hit hard, or many softly: each limit acts alone."""
    rule = HopAfterHit(num_channels=4, spacing=75e6, hit=1e9, hit_ramps=0.1)
    assert (
        rule.next_turn(
            Turn(), MeasuredInterference(inr=0.0, hit_ramps=0.2), streams=Streams(1)
        ).draw
        == 1
    )
    assert (
        rule.next_turn(
            Turn(), MeasuredInterference(inr=5.0, hit_ramps=0.05), streams=Streams(1)
        ).draw
        == 0
    )


def test_drawn_slots_and_channels_are_uniform():
    """4000 draws among 10 slots and 4 channels: χ² of 9 and 3 degrees below its 0.999 quantile."""
    turns = [RULES[0].next_turn(Turn(), QUIET, streams=Streams(n)) for n in range(4000)]
    slots = np.bincount([int(turn.delay // 2e-6) for turn in turns], minlength=10)
    channels = np.bincount([round(turn.shift / 75e6) for turn in turns], minlength=4)
    assert np.sum((slots - 400) ** 2 / 400) < 27.9
    assert np.sum((channels - 1000) ** 2 / 1000) < 16.3


def test_noise_makes_a_band_busy_as_often_as_stated():
    """χ² of 2n degrees for n complex samples, at the tenth of the frames: 2000 draws, ±0.02."""
    rule, samples = ListenBeforeTalk(false_alarm_probability=0.1), 500.0
    noise = np.random.default_rng(1).chisquare(2 * samples, 2000) / (2 * samples)
    assert np.mean(noise > rule.threshold(samples)) == pytest.approx(0.1, abs=0.02)


def test_a_radar_waits_while_its_band_is_busy_but_not_for_ever():
    rule = ListenBeforeTalk(backoff=1e-3, most_attempts=3)
    waits = [rule.wait(9.0, samples=1e4, attempt=n, streams=Streams(1)) for n in range(3)]
    assert 0.0 < waits[0] < 1e-3
    assert 0.0 < waits[1] != waits[0]
    assert waits[2] == 0.0
    assert rule.wait(1.0, samples=1e4, attempt=0, streams=Streams(1)) == 0.0


def test_a_radar_keeps_its_place_in_the_next_frame_unless_it_was_pushed_out():
    rule = ListenBeforeTalk(start_spread=10e-3)
    kept = rule.next_turn(Turn(delay=9e-3), QUIET, streams=Streams(1))
    moved = rule.next_turn(Turn(delay=12e-3), QUIET, streams=Streams(1))
    assert kept.delay == 9e-3
    assert 0.0 <= moved.delay < 10e-3


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"kind": "hop-after-hit", "num_slots": 4}, "with slots needs a positive slot, not 0"),
        ({"kind": "redraw-each-frame", "num_channels": 2}, "needs a positive spacing, not 0"),
        ({"kind": "hop-after-hit", "hit_ramps": 1.5}, "a share of the ramps, from 0 to 1"),
        ({"kind": "listen-before-talk", "backoff": "0 s"}, "needs a positive backoff, not 0"),
        ({"kind": "listen-before-talk", "false_alarm_probability": 2.0}, "between 0 and 1"),
        ({"kind": "hop-after-hit", "frame_interval": "0 s"}, "a positive frame_interval, not 0"),
        ({"kind": "redraw-each-frame", "num_frames": 0}, "num_frames"),
    ],
)
def test_a_rule_that_cannot_be_is_refused_with_its_place(table, sentence):
    vehicles = {"vehicles": [{"name": "ego", "x": "0 m", "y": "0 m"}]}
    with pytest.raises(InputError) as caught:
        build(Study, {"name": "road", "street": vehicles, "radars": [], "access": table})
    assert sentence in str(caught.value)
    assert "access" in str(caught.value)
