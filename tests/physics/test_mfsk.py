r"""MFSK: closed form, errors beside the bound, false alarms, and two targets in one beat.

The phase between both sequences dominates the errors of range and range rate, and the taper's noise
bandwidth of 1.58 cells multiplies its variance. The Cramér–Rao bound is lower than that of the
phase, since the turning of echoes within steps, and the curvature b v t² of their phase along a
sweep, tell the range rate as well (`_information_left`).
"""

import numpy as np
import pytest

from polychirp.model.if_frame import IfFrame, sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.estimation.cramer_rao import cramer_rao_bound
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.staircase import Staircase
from polychirp.rng import Streams
from polychirp.waveform import Mfsk
from tests.support.points import HandPoint, frame_of

CONVERTER = Converter(sample_rate=1e6, start=3e-6, margin=0.0)
RECEIVER = MfskReceiver(greatest_range=60.0)


def sent(**settings):
    return Mfsk(**settings).schedule(num_sweeps=1, streams=Streams(1))


@pytest.mark.parametrize(
    ("distance", "rate"), [(12.0, -3.0), (29.3, 31.0), (45.0, -20.1), (58.0, 0.3)]
)
@pytest.mark.parametrize("shift", [None, -1.171875e6, 2e5])
def test_a_point_without_noise_is_measured_to_micrometres(distance, rate, shift):
    """The delay 2R/(c + v) in place of 2R/c changes both by the share v/c, up to 1e-7."""
    point = HandPoint(range=distance, range_rate=rate, azimuth=0.2, spreading=0.0)
    frame = frame_of(sent(shift=shift), [point], noise=1e-16, converter=CONVERTER)
    found = RECEIVER.detect(frame)
    assert found.range[0] == pytest.approx(distance + rate * found.time, abs=1e-5)
    assert found.range_rate[0] == pytest.approx(rate, abs=1e-5)
    assert found.azimuth[0] == pytest.approx(0.2, abs=1e-4)
    assert found.elevation[0] != found.elevation[0]


def _information_left(schedule, times, middle):
    r"""What a sweep tells beyond beat and phase, over what the phase tells.

    If the beat is known, a range rate v changes the phase between A and B by
    :math:`2\pi(2/c)\,2fT_s v`, half of it on each; that within a step by
    :math:`2\pi(2/c) f v t'`, at t' from its middle; and that along a sweep by
    :math:`2\pi(2/c) b v t^2`.
    """
    stairs = Staircase.of(schedule)
    within = times.time - times.time.mean(axis=1, keepdims=True)
    along = (times.time.mean(axis=1) - middle) ** 2
    slope = stairs.increment / stairs.interval
    turning = stairs.frequency**2 * np.mean(within**2) + slope**2 * np.var(along)
    return turning / (stairs.frequency * stairs.late) ** 2


@pytest.mark.parametrize("snr_db", [-10.0, 0.0, 20.0])
def test_errors_are_the_bound_times_the_losses(snr_db, compare):
    """300 draws tell a standard deviation to 4.1 %; four of these are allowed."""
    schedule, ratio, rate = sent(num_steps=256), 10 ** (snr_db / 10), -7.1
    point = HandPoint(range=20.3, range_rate=rate, azimuth=0.2, spreading=0.0)
    errors = []
    first = 1000 * int(snr_db + 10.0)
    for seed in range(first, first + 300):
        frame = frame_of(schedule, [point], noise=1.0 / ratio, seed=seed, converter=CONVERTER)
        found = RECEIVER.detect(frame)
        true = point.range + rate * found.time
        errors.append((found.range[0] - true, found.range_rate[0] - rate))
    bound = cramer_rao_bound(
        schedule,
        frame.times,
        frame.array,
        motion=np.array([true, rate, 0.0]),
        azimuth=0.2,
        snr=ratio,
        time=found.time,
        is_acceleration_known=True,
        sine_rate_deviation=0.0,
    )
    size = np.sqrt(np.mean(np.square(errors), axis=0)) / [bound.range, bound.range_rate]
    loss = np.sqrt(256 * np.sum(taper(256) ** 2))
    loss *= np.sqrt(1.0 + _information_left(schedule, frame.times, found.time))
    for quantity, measured in zip(("range", "range rate"), size, strict=True):
        compare(
            page="coded-waveforms",
            case=f"MFSK of 256 steps, {quantity}, {snr_db:.0f} dB per sample",
            quantity="rms error over the Cramér–Rao bound",
            expected=loss,
            measured=measured,
            tolerance=0.164 * loss,
            source="noise bandwidth of the taper, and what beat and phase leave out",
        )


def test_a_greater_shift_tells_the_range_better(compare):
    """The error of the phase is divided by 1/2 + p for a shift of −p increments.

    100 draws tell each standard deviation to 7 %; three of their joint ones are allowed.
    """
    size = []
    for share in (0.5, 2.0):
        schedule = sent(shift=-share * 600e6 / 512)
        errors = []
        for seed in range(100):
            point = HandPoint(range=20.0, spreading=0.0)
            frame = frame_of(schedule, [point], noise=1.0, seed=seed, converter=CONVERTER)
            errors.append(MfskReceiver(greatest_speed=15.0).detect(frame).range[0] - 20.0)
        size.append(np.sqrt(np.mean(np.square(errors))))
    compare(
        page="coded-waveforms",
        case="MFSK, shift of half a step over that of two steps",
        quantity="ratio of the errors in range",
        expected=2.5,
        measured=size[0] / size[1],
        tolerance=0.75,
        source="phase over 1/2 + p",
    )


def test_noise_is_detected_as_often_as_stated(compare):
    """A receiver whose limits hold all beats and phases detects each crossing that is a maximum.

    Of the neighbours that the taper correlates, one is the maximum: 0.82 of the crossings, counted
    in 400 frames. Training cells that it correlates allow 15 %, and 60 frames 6 %.
    """
    schedule = sent(bandwidth=60e6)
    stairs = Staircase.of(schedule)
    receiver = MfskReceiver(
        least_range=1e-9,
        greatest_range=0.5 * stairs.num_steps * stairs.range_cell,
        greatest_speed=stairs.num_steps * stairs.rate_cell,
        false_alarm_probability=0.01,
    )
    found = [
        receiver.detect(frame_of(schedule, [], seed=seed, converter=CONVERTER)).num_detections
        for seed in range(60)
    ]
    expected = 0.82 * 0.01 * stairs.num_steps
    compare(
        page="coded-waveforms",
        case="MFSK of 512 steps, 0.01 in a cell",
        quantity="detections in a frame of noise",
        expected=expected,
        measured=np.mean(found),
        tolerance=0.2 * expected,
        source="stated probability, maxima alone",
    )


def test_noise_has_no_detection_at_the_stated_probability():
    """1e-6 in each of 512 cells: in 60 frames 0.03 are expected."""
    schedule = sent()
    found = [
        RECEIVER.detect(frame_of(schedule, [], seed=seed, converter=CONVERTER))
        for seed in range(60)
    ]
    assert sum(one.num_detections for one in found) == 0


def test_two_targets_with_one_beat_are_one_detection_that_is_neither():
    """A car at 30 m and one at 20 m whose speeds differ by 10 m in cells have one beat."""
    schedule = sent()
    stairs = Staircase.of(schedule)
    faster = 10.0 / stairs.range_cell * stairs.rate_cell
    pair = [
        HandPoint(range=30.0, spreading=0.0),
        HandPoint(range=20.0, range_rate=faster, spreading=0.0),
    ]
    found = RECEIVER.detect(frame_of(schedule, pair, noise=1e-3, converter=CONVERTER))
    strong = found.power > 0.1
    assert np.count_nonzero(strong) == 1
    assert np.min(np.abs(found.range[0] - np.array([30.0, 20.0 + faster * found.time]))) > 1.0


def test_two_targets_at_one_range_and_different_speeds_are_two():
    schedule = sent()
    pair = [HandPoint(range=25.0, range_rate=v, spreading=0.0) for v in (-2.0, 2.0)]
    found = RECEIVER.detect(frame_of(schedule, pair, noise=1e-4, converter=CONVERTER))
    rate = np.sort(found.range_rate[:2])
    np.testing.assert_allclose(rate, [-2.0, 2.0], atol=0.02)
    np.testing.assert_allclose(found.range[:2], 25.0, atol=0.05)


def test_a_fast_target_keeps_its_power_within_a_step():
    """At 30 m/s the phase turns by 0.12 cycles in the samples of a step: 0.2 dB."""
    still, fast = (
        RECEIVER.detect(
            frame_of(
                sent(bandwidth=150e6),
                [HandPoint(range=20.0, range_rate=v, spreading=0.0)],
                noise=1e-6,
                converter=CONVERTER,
            )
        ).power[0]
        for v in (0.0, 30.0)
    )
    assert fast == pytest.approx(still, rel=0.01)
    assert still == pytest.approx(1.0, rel=0.01)


def test_steps_that_are_received_through_the_filter_give_range_and_speed():
    """A path of a point through the engine: the step before has left the filter at `start`."""
    from polychirp.model.antenna import AntennaArray
    from polychirp.model.if_filter import IfFilter
    from polychirp.model.radar import Radar
    from polychirp.model.scene import Actor, Scene
    from polychirp.synthesis.stretch.engine import Stretch
    from polychirp.testing.paths import HandPath, paths_of

    schedule = sent(num_steps=128, bandwidth=150e6)
    radar = Radar(
        name="front",
        array=AntennaArray(num_channels=1),
        if_filter=IfFilter(passband=1e6, stopband=3e6),
        converter=Converter(sample_rate=2e6, start=3.4e-6, margin=1.5e-6),
    )
    scene = Scene(
        time=0.0, actors=(Actor(name="car", kind="vehicle"),), radars=(radar,), carriers=(0,)
    )
    delay = 2.0 * 40.0 / 299792458.0
    path = HandPath(transmitter=0, delay=delay, delay_rate=2.0 * -12.0 / 299792458.0, gain=1.0)
    samples = Stretch().contribution(
        scene, [schedule], [paths_of(path, reference_time=0.0)], victim=0, transmitter=0
    )
    frame = IfFrame(
        samples=samples.sum(axis=0),
        times=sample_times(schedule, radar.converter),
        schedule=schedule,
        array=radar.array,
    )
    found = RECEIVER.detect(frame)
    assert found.range[0] == pytest.approx(40.0 - 12.0 * found.time, abs=1e-3)
    assert found.range_rate[0] == pytest.approx(-12.0, abs=1e-3)


def test_a_point_of_any_strength_is_one_detection():
    """30 points 60 to 90 dB above the noise of a frame of 1024 steps, 6 samples and 4 channels.

    Side lobes are 51 dB below a peak, and each of them would have some range and range rate.
    """
    draw = np.random.default_rng(8)
    samples = 1024 * 6 * 4
    for number, snr in enumerate(np.linspace(60.0, 90.0, 30)):
        point = HandPoint(
            range=draw.uniform(3.0, 55.0), range_rate=draw.uniform(-20.0, 20.0), spreading=0.0
        )
        noise = samples * 10 ** (-0.1 * snr)
        frame = frame_of(sent(), [point], noise=noise, seed=number, converter=CONVERTER)
        found = RECEIVER.detect(frame)
        assert found.num_detections == 1
        assert found.range[0] == pytest.approx(point.range + point.range_rate * found.time, abs=0.5)
