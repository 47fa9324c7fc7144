"""Echoes that move as the target does, beside others at the same range and in the same beam."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from polychirp.model.detection import Detections
from polychirp.receiver.attribution import part_amplitudes, target_levels
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.mitigation.base import with_weights
from polychirp.receiver.own_echo import own_echoes
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.rng import Streams
from polychirp.units import from_db, to_db
from polychirp.waveform import (
    DiverseSawtooth,
    DopplerDivision,
    PhaseCoded,
    Sawtooth,
    TimeDivision,
    Triangular,
)
from tests.physics.test_mimo import frame, plan, target
from tests.support.points import HandPoint
from tests.unit.receiver.range_doppler.test_parts_in_a_cell import (
    frame_with,
    truth_at,
)

RECEIVERS = [RangeDoppler(), CoherentReceiver(greatest_range=60.0)]
SHORT_CHIRPS = Sawtooth(start_frequency=77e9, bandwidth=300e6, ramp_duration=50e-6).schedule(
    num_sweeps=256, streams=Streams(seed=1)
)
CODINGS = [
    None,
    TimeDivision(),
    DopplerDivision(),
    DopplerDivision(num_bands=4),
    PhaseCoded(),
]


def levels_beside(other, *, receiver, schedule, ghost=()):
    """SNR and INR, dB, of an echo of 20 m and 1 m/s, with another echo in the frame."""
    own = HandPoint(range=20.0, range_rate=1.0, power=0.01)
    received, parts = frame_with(schedule, echo=[own, *other], direct=ghost)
    true = truth_at(received, range=20.0, range_rate=1.0)
    levels = target_levels(receiver, received, parts, true)
    return to_db(np.array([levels.snr[0], levels.inr[0]]))


@pytest.mark.parametrize("decibels", [3.0, 20.0, 40.0])
@pytest.mark.parametrize("aside", [-8.0, 3.5, 20.0])
@pytest.mark.parametrize("receiver", RECEIVERS, ids=["with a taper", "without a taper"])
def test_another_body_at_the_range_of_a_target_adds_nothing_to_its_levels(
    receiver, aside, decibels
):
    """Beside a ghost of the target's own range rate."""
    ghost = [HandPoint(range=20.0, range_rate=1.0, power=0.03)]
    stronger = HandPoint(range=20.0, range_rate=1.0 + aside, power=0.01 * from_db(decibels))
    fields = {"receiver": receiver, "schedule": SHORT_CHIRPS, "ghost": ghost}
    alone, beside = levels_beside([], **fields), levels_beside([stronger], **fields)
    np.testing.assert_allclose(beside, alone, atol=0.3)


@dataclass(frozen=True)
class _TakesSamplesOut:
    """A mitigation that leaves a share of the samples of ramps that are drawn."""

    share_of_ramps: float
    share_left: float

    def mitigate(self, frame):
        weight = frame.times.is_sample.astype(np.float64)
        hit = np.random.default_rng(5).random(len(weight)) < self.share_of_ramps
        first = round((1.0 - self.share_left) * weight.shape[1])
        weight[hit, :first] = 0.0
        return with_weights(frame, weight)


@pytest.mark.parametrize(("ramps", "left"), [(0.3, 0.9), (0.3, 0.4), (0.4, 0.0)])
@pytest.mark.parametrize("decibels", [20.0, 40.0])
@pytest.mark.parametrize("receiver", RECEIVERS, ids=["with a taper", "without a taper"])
def test_mitigation_does_not_bring_another_body_back(receiver, decibels, ramps, left):
    repairing = replace(receiver, mitigation=_TakesSamplesOut(ramps, left))
    fields = {"receiver": repairing, "schedule": SHORT_CHIRPS}
    stronger = HandPoint(range=20.0, range_rate=11.0, power=0.01 * from_db(decibels))
    alone, beside = levels_beside([], **fields), levels_beside([stronger], **fields)
    assert beside[0] == pytest.approx(alone[0], abs=0.3)
    clean = levels_beside([], receiver=receiver, schedule=SHORT_CHIRPS)
    assert alone[0] < clean[0] + 0.1


@pytest.mark.parametrize("aside", [0.0, 0.5])
def test_an_echo_near_the_targets_range_rate_is_its_own(aside):
    """A scatterer of a walking person, say."""
    arm = HandPoint(range=20.0, range_rate=1.0 + aside, power=0.1)
    alone = levels_beside([], receiver=RangeDoppler(), schedule=SHORT_CHIRPS)
    both = levels_beside([arm], receiver=RangeDoppler(), schedule=SHORT_CHIRPS)
    assert both[0] > alone[0] + 7.0


@pytest.mark.parametrize("coding", CODINGS, ids=repr)
@pytest.mark.parametrize(("azimuth", "range_rate"), [(0.3, -14.0), (-0.6, 0.0), (0.0, 5.0)])
def test_the_echo_of_a_target_is_its_own_whatever_the_elements_send(coding, azimuth, range_rate):
    received = frame(plan(192, coding=coding), target(azimuth=azimuth, range_rate=range_rate))
    cells = Detections(
        time=float(received.schedule.start_time[0]),
        range=[12.0],
        range_rate=[range_rate],
        azimuth=[azimuth],
        elevation=[0.0],
        power=[1.0],
        snr=[1.0],
    )
    whole = part_amplitudes(RangeDoppler(), received, received.samples[None], cells)[:, 0]
    own = own_echoes(whole, whole, received, cells)
    np.testing.assert_array_equal(own, whole)
    turning = whole * np.exp(2j * np.pi * 2.0 * 5.0 / 3.88e-3 * received.schedule.start_time)
    left = own_echoes(turning, turning, received, cells)
    assert np.sum(np.abs(left) ** 2) < 1e-3 * np.sum(np.abs(whole) ** 2)


SLOW = Triangular().schedule(num_sweeps=4, streams=Streams(seed=1))
DRAWN = DiverseSawtooth(
    start_frequency=77e9, bandwidth=(200e6, 300e6), ramp_duration=50e-6
).schedule(num_sweeps=256, streams=Streams(seed=1))


@pytest.mark.parametrize("schedule", [SLOW, DRAWN], ids=["few ramps", "unequal ramps"])
def test_ramps_that_do_not_tell_echoes_apart_leave_them_as_they_are(schedule):
    """Eight ramps within 8 ms, and 17 tones within ±2 m/s; or ramps of drawn slopes."""
    received, parts = frame_with(schedule, echo=[HandPoint(range=9.0, power=1.0)])
    true = truth_at(received, range=9.0, range_rate=5.0)
    cells = Detections(
        time=true.time,
        range=true.range,
        range_rate=true.range_rate,
        azimuth=true.azimuth,
        elevation=true.elevation,
        power=[1.0],
        snr=[1.0],
    )
    amplitude = part_amplitudes(CoherentReceiver(), received, parts["echo"][None], cells)[:, 0]
    assert own_echoes(amplitude, amplitude, received, cells) is amplitude
