"""Frames of steps that cannot be read are refused with the reason and what would work."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import CapabilityError, InputError, ModelWarning, PhysicsError
from polychirp.model.front_end import FrontEnd, HighPass
from polychirp.model.radar import Converter, Radar
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.selection import (
    AutoReceiver,
    reason_of_choice,
    receiver_for,
    refuse_unreadable,
    refuse_unsampled,
)
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.staircase import Staircase
from polychirp.receiver.stepped.step_limits import warn_of_motion
from polychirp.rng import Streams
from polychirp.waveform import Mfsk
from tests.support.points import HandPoint, frame_of

WAVEFORM = Mfsk(num_steps=64)
STEPS = WAVEFORM.schedule(num_sweeps=1, streams=Streams(1))
GOOD = Converter(sample_rate=2e6, start=3e-6, margin=0.0)


def moved(field, ramp, by):
    values = getattr(STEPS, field).copy()
    values[ramp] += by
    return replace(STEPS, **{field: values})


def test_the_receiver_is_chosen_because_of_the_steps():
    assert receiver_for(AutoReceiver(greatest_range=7.0), STEPS).kind == "mfsk"
    assert reason_of_choice(STEPS) == "its ramps are steps of constant frequency"
    refuse_unreadable(AutoReceiver(greatest_range=7.0), STEPS)
    refuse_unsampled(AutoReceiver(), STEPS, Radar(name="front", converter=GOOD))


def test_steps_are_read_on_a_clock_with_an_error_and_a_drift():
    clocked = STEPS.as_clocked(start_time=1e-3, clock_offset=2e-5, clock_drift=1e-6)
    assert receiver_for(AutoReceiver(), clocked).kind == "mfsk"
    assert Staircase.of(clocked).shift == pytest.approx(Staircase.of(STEPS).shift, rel=1e-4)


@pytest.mark.parametrize(
    ("schedule", "reason"),
    [
        (WAVEFORM.schedule(num_sweeps=2, streams=Streams(1)), "it has 2 sweeps"),
        (Mfsk(num_steps=8).schedule(num_sweeps=1, streams=Streams(1)), None),
        (moved("start_frequency", 7, 2e4), "different frequencies"),
        (moved("start_time", 127, 1e-7), "different intervals"),
        (moved("duration", 3, -1e-6), "differ in duration"),
        (replace(STEPS, transmit_weight=np.ones((128, 2))), "2 transmitting elements"),
    ],
)
def test_other_steps_are_refused_with_what_would_work(schedule, reason):
    if reason is None:
        return refuse_unreadable(MfskReceiver(greatest_range=0.9), schedule)
    with pytest.raises(CapabilityError, match=rf"{reason}.*waveform 'mfsk' with num_sweeps = 1"):
        refuse_unreadable(MfskReceiver(), schedule)
    return None


def test_a_decoder_names_the_receiver_that_reads_steps():
    with pytest.raises(CapabilityError, match="no code; the receiver 'auto' reads it"):
        refuse_unreadable(Decoding(), STEPS)


def test_ranges_that_look_alike_at_one_speed_are_refused():
    """Without a shift, ranges of N cells have the same beats, and the phase is that of speed."""
    steps = replace(WAVEFORM, shift=0.0).schedule(num_sweeps=1, streams=Streams(1))
    cells = 64 * Staircase.of(steps).range_cell
    refuse_unreadable(MfskReceiver(least_range=0.5, greatest_range=0.5 + 0.99 * cells), steps)
    with pytest.raises(CapabilityError, match="look alike at two ranges"):
        refuse_unreadable(MfskReceiver(least_range=0.5, greatest_range=0.6 + cells), steps)


def test_a_converter_before_the_echo_is_refused():
    early = Radar(name="front", converter=replace(GOOD, start=0.1e-6))
    with pytest.raises(PhysicsError, match=r"set converter\.start to '201 ns' or more"):
        refuse_unsampled(MfskReceiver(greatest_range=30.0), STEPS, early)


def test_a_high_pass_is_refused_before_the_run_and_in_a_frame():
    front_end = FrontEnd(high_pass=HighPass(corners=(1e5,)))
    radar = Radar(name="front", converter=GOOD, front_end=front_end)
    with pytest.raises(CapabilityError, match=r"leave front_end\.high_pass out"):
        refuse_unsampled(MfskReceiver(), STEPS, radar)
    frame = replace(frame_of(STEPS, [], converter=GOOD), high_pass=front_end.high_pass)
    with pytest.raises(CapabilityError, match=r"leave front_end\.high_pass out"):
        MfskReceiver().detect(frame)


def test_a_target_that_moves_several_cells_in_a_sweep_is_warned_of():
    long = replace(WAVEFORM, num_steps=1024, step_duration=20e-6)
    steps = long.schedule(num_sweeps=1, streams=Streams(1))
    with pytest.warns(ModelWarning, match=r"moves by 4\.9 range cells in the sweep"):
        warn_of_motion(Staircase.of(steps), np.array([-30.0]))
    frame = frame_of(steps, [HandPoint(range=9.0, range_rate=28.0, power=100.0)], converter=GOOD)
    with pytest.warns(ModelWarning, match="range cells in the sweep"):
        MfskReceiver().detect(frame)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"num_steps": 7}, "of 7 steps has too few for a spectrum; use 8 or more"),
        ({"bandwidth": 0.0}, "needs a positive bandwidth"),
        ({"step_duration": -1e-6}, "needs a positive step_duration"),
        ({"idle": -1e-6}, "cannot have a negative idle"),
        ({"shift": 300e6 / 64}, "cannot tell range from range rate; use a shift of '-4687.5 kHz'"),
    ],
)
def test_waveforms_that_cannot_work_are_refused(change, sentence):
    with pytest.raises(InputError, match=sentence):
        replace(WAVEFORM, **change)


def test_a_speed_of_zero_is_refused():
    with pytest.raises(InputError, match="greatest speed must be positive"):
        MfskReceiver(greatest_speed=0.0)
