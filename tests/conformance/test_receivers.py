"""What every receiver of a study keeps to; a new receiver is one line in `RECEIVERS`."""

from dataclasses import fields, replace
from typing import get_args

import numpy as np
import pytest

from polychirp.errors import CapabilityError, InputError
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import PARTS, IfFrame, IfParts
from polychirp.model.radar import Converter
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.attribution import detected
from polychirp.receiver.clustering import Body
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.mitigation import Blanking
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import (
    RECEIVERS,
    AnyReceiver,
    AutoReceiver,
    receiver_of_kind,
    refuse_unreadable,
)
from polychirp.receiver.signal_model.point_signal import path_of
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.rng import Streams
from polychirp.study.kernel_parts import _OF_RECEIVER
from polychirp.waveform import Mfsk, Pmcw, Sawtooth, Triangular
from tests.support.points import HandPoint, frame_of
from tests.support.schedules import drawn_chirps

TRIANGLES = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(num_sweeps=8, streams=Streams(1))
CHIRPS = Sawtooth(bandwidth=1e9, ramp_duration=40e-6, idle=20e-6).schedule(
    num_sweeps=64, streams=Streams(1)
)
CARRIER = Pmcw(order=9, chip_duration=1.6e-9, periods=6, idle=40e-6).schedule(
    num_sweeps=64, streams=Streams(1)
)
STEPS = Mfsk(num_steps=256, step_duration=8e-6).schedule(num_sweeps=1, streams=Streams(1))
CHIPS = Converter(sample_rate=625e6, start=0.8176e-6, margin=0.0)
FAST = Converter(sample_rate=20e6, start=2e-6, margin=1e-6)
SLOW = Converter()
POINT = HandPoint(range=9.0, range_rate=-3.0, azimuth=0.3, power=100.0)

CASES = {
    "coherent": (CoherentReceiver(greatest_range=15.0), drawn_chirps(32, seed=1), FAST),
    "range-doppler": (RangeDoppler(greatest_range=15.0), CHIRPS, FAST),
    "decoding": (Decoding(greatest_range=15.0), CARRIER, CHIPS),
    "mfsk": (MfskReceiver(greatest_range=15.0), STEPS, FAST),
    "paper": (PaperReceiver(greatest_range=15.0), TRIANGLES, SLOW),
}
"""A receiver of every kind, with ramps that it reads and a converter for them."""


@pytest.fixture(params=CASES)
def case(request):
    receiver, schedule, converter = CASES[request.param]
    return receiver, frame_of(schedule, [POINT], seed=3, converter=converter)


def of_one_channel(frame: IfFrame) -> IfFrame:
    return replace(frame, samples=frame.samples[:1], array=AntennaArray(num_channels=1))


def test_every_kind_is_a_receiver_of_a_study():
    union, by_kind = get_args(AnyReceiver)
    assert set(RECEIVERS.values()) == set(get_args(union))
    assert [RECEIVERS[name]().kind for name in RECEIVERS] == list(RECEIVERS)
    assert set(CASES) | {by_kind.default} == set(RECEIVERS)
    assert set(_OF_RECEIVER) == set(CASES)


def test_a_strong_point_is_the_strongest_detection(case):
    """100 times the noise of a sample. A ramp resolves λ/2T = 1.9 m/s, half of it is the limit."""
    receiver, frame = case
    found = receiver.detect(frame)
    motion = np.array([[POINT.range, POINT.range_rate, 0.0]])
    distance, rate, _ = path_of(motion, np.array(found.time - frame.schedule.start_time[0]))[:, 0]
    assert found.range[0] == pytest.approx(float(distance), abs=0.1)
    assert found.range_rate[0] == pytest.approx(float(rate), abs=0.95)
    assert found.azimuth[0] == pytest.approx(POINT.azimuth, abs=0.05)
    assert found.power[0] == pytest.approx(POINT.power, rel=0.3)
    assert np.all(np.diff(found.power) <= 0)
    assert np.all(found.snr > 0)


def test_detections_are_within_the_limits_in_range(case):
    receiver, frame = case
    limits = replace(receiver, least_range=8.0, greatest_range=10.0)
    found = limits.detect(frame)
    assert found.num_detections > 0
    slack = 0.3  # the paper's ranges are those of the middle of the frame, moved to its start
    assert np.all((found.range >= 8.0 - slack) & (found.range <= 10.0 + slack))


def test_a_frame_is_not_changed_and_read_alike_each_time(case):
    receiver, frame = case
    before = frame.samples.copy()
    first, again = receiver.detect(frame), receiver.detect(frame)
    np.testing.assert_array_equal(frame.samples, before)
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(again, field.name))


def test_one_channel_measures_no_azimuth(case):
    receiver, frame = case
    found = receiver.detect(of_one_channel(frame))
    assert found.range[0] == pytest.approx(9.0, abs=0.15)
    assert np.all(np.isnan(found.azimuth))


def test_silence_has_no_detections(case):
    receiver, frame = case
    assert receiver.detect(frame.with_samples(0.0 * frame.samples)).num_detections == 0


def test_a_part_has_the_power_of_its_echo_in_all_channels(case):
    receiver, frame = case
    converter = CASES[receiver.kind][2]
    echo = frame_of(frame.schedule, [POINT], seed=3, noise=0.0, converter=converter).samples
    parts = IfParts(samples=np.stack([echo, frame.samples - echo]), names=("echo", "noise"))
    found, powers = detected(receiver, frame, parts)
    assert powers.shape == (found.num_detections, len(PARTS))
    assert powers[0, PARTS.index("echo")] == pytest.approx(4.0 * POINT.power, rel=0.3)
    assert powers[0, PARTS.index("noise")] < 0.01 * powers[0, PARTS.index("echo")]


def test_powers_of_parts_grow_with_the_square_of_amplitudes(case):
    receiver, frame = case
    parts = IfParts(
        samples=np.stack([frame.samples, 0.1j * frame.samples]), names=("echo", "noise")
    )
    twice = replace(parts, samples=2.0 * parts.samples)
    _, powers = detected(receiver, frame, parts)
    _, greater = detected(receiver, frame.with_samples(2.0 * frame.samples), twice)
    np.testing.assert_allclose(greater[0], 4.0 * powers[0], rtol=1e-6)
    noise, echo = (powers[0, PARTS.index(part)] for part in ("noise", "echo"))
    assert noise == pytest.approx(0.01 * echo, rel=1e-6)


@pytest.mark.parametrize("kind", [k for k in CASES if hasattr(CASES[k][0], "combined_power")])
def test_power_that_is_combined_over_ramps_grows_with_the_square_of_amplitudes(kind):
    receiver, schedule, _ = CASES[kind]
    amplitude = np.random.default_rng(1).normal(size=(3, 2, schedule.num_ramps, 2))
    amplitude = amplitude.view(complex)[..., 0]
    power = receiver.combined_power(amplitude, schedule)
    assert power.shape == (3, 2)
    twice = receiver.combined_power(2.0 * amplitude, schedule)
    np.testing.assert_allclose(twice, 4.0 * power, rtol=1e-9)
    steady = np.ones((1, 1, schedule.num_ramps), dtype=complex)
    assert receiver.combined_power(steady, schedule)[0, 0] == pytest.approx(1.0)


def test_bursts_are_mitigated_before_detection(case):
    """A burst on a twelfth of every ramp, 40 dB above the point, leaves its place and power.

    The range-Doppler receiver corrects power by the mean weight of the samples, not by that under
    its windows, which is lower here. The decoding receiver reads 0.65 dB too much with the burst as
    without one: chips that no filter has limited are stronger at the edges of the band than those
    to which it compares them.
    """
    receiver, frame = case
    burst = np.zeros_like(frame.samples)
    fast = frame.samples.shape[2]
    burst[:, :, fast // 3 : fast // 3 + fast // 12] = 1e3
    hit = frame.with_samples(frame.samples + burst)
    found = replace(receiver, mitigation=Blanking(guard=0.5e-6)).detect(hit)
    assert found.range[0] == pytest.approx(9.0, abs=0.15)
    error = {"range-doppler": 0.4, "decoding": 0.2}.get(receiver.kind, 0.15)
    assert found.power[0] == pytest.approx(POINT.power, rel=error)


def test_points_of_one_body_are_grouped(case):
    receiver, frame = case
    alone = replace(receiver, grouping=Body(gap=50.0, range_rate=100.0, extent=200.0))
    assert alone.detect(frame).num_detections == 1


@pytest.mark.parametrize(
    ("receiver", "schedule", "reason"),
    [
        (RangeDoppler(), TRIANGLES, "differ in slope"),
        (PaperReceiver(), CHIRPS, "one ramp"),
        (PaperReceiver(), drawn_chirps(8, seed=1), "one ramp"),
        (MfskReceiver(), CHIRPS, "no steps of constant frequency"),
    ],
)
def test_ramps_that_it_cannot_read_are_refused_with_what_works(receiver, schedule, reason):
    with pytest.raises(CapabilityError, match=rf"{reason}; the receiver '\w+'"):
        refuse_unreadable(receiver, schedule)
    with pytest.raises(CapabilityError, match=reason):
        receiver.detect(frame_of(schedule, [], converter=FAST if schedule is CHIRPS else None))


@pytest.mark.parametrize("receiver", [CoherentReceiver(), AutoReceiver()])
def test_ramps_without_a_slope_are_refused(receiver):
    ramps = replace(drawn_chirps(8, seed=1), slope=np.where(np.arange(8) == 3, 0.0, 1e13))
    with pytest.raises(CapabilityError, match="ramp 3 has a constant frequency"):
        refuse_unreadable(receiver, ramps)


@pytest.mark.parametrize("receiver", [CoherentReceiver(), RangeDoppler(), PaperReceiver()])
def test_steps_are_refused_by_receivers_of_ramps_which_name_those_that_work(receiver):
    for refuse in (
        lambda: refuse_unreadable(receiver, STEPS),
        lambda: receiver.detect(frame_of(STEPS, [], converter=FAST)),
    ):
        with pytest.raises(CapabilityError, match="the receivers 'auto' and 'mfsk' read"):
            refuse()


@pytest.mark.parametrize("change", [{"least_range": 0.0}, {"greatest_range": 0.1}])
def test_limits_that_leave_nothing_are_refused(case, change):
    with pytest.raises(InputError, match="range"):
        replace(case[0], **change)


@pytest.mark.parametrize("kind", RECEIVERS)
def test_a_receiver_of_another_kind_keeps_the_settings_that_it_knows(kind):
    given = AutoReceiver(greatest_range=44.0, greatest_speed=20.0, mitigation=Blanking())
    other = receiver_of_kind(kind, given)
    assert other.kind == kind
    assert (other.greatest_range, other.mitigation) == (44.0, Blanking())
    known = {field.name for field in fields(other)}
    assert "greatest_speed" not in known or other.greatest_speed == 20.0
    assert receiver_of_kind("auto", other).greatest_range == 44.0


def test_a_kind_that_does_not_exist_is_named():
    with pytest.raises(InputError, match="did you mean 'coherent'"):
        receiver_of_kind("coherrent", AutoReceiver())
