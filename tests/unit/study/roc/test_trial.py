"""Frames of drawn points, and which detections count as theirs."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.detection import Detections
from polychirp.model.if_filter import IfFilter
from polychirp.rng import Streams
from polychirp.study.roc.frames import (
    DrawnPoint,
    aliased_noise,
    drawn_points,
    frame_with,
    middle_of,
)
from polychirp.study.roc.plan import Strong, as_read, of_trial, roc_plan
from polychirp.study.roc.trial import found_points, measured
from polychirp.study.roc.yardsticks import Extent
from polychirp.units import from_db
from polychirp.waveform import PhaseCoded, TimeDivision
from tests.support.roc_study import CHIRPS, TRIANGLES, roc_study

ASK = {"snrs_db": [14.0], "trials": 3, "noise_trials": 4}
CODED = {"array": AntennaArray(num_channels=2, num_transmitters=2)}
POINT = DrawnPoint(range=14.0, range_rate=-6.0, azimuth=0.4, snr=from_db(70.0))


def noise_power(study, num_frames):
    """Mean noise density in the pass band, as power of a sample."""
    power = []
    for trial in range(num_frames):
        noise = frame_with(study, (), streams=Streams(trial + 2))
        spectrum = np.fft.fft(noise.samples, axis=2) / np.sqrt(noise.times.most_samples)
        inside = np.abs(np.fft.fftfreq(noise.times.most_samples)) < 0.2
        power.append(np.mean(np.abs(spectrum[:, :, inside]) ** 2))
    return np.mean(power)


@pytest.mark.filterwarnings("ignore:the .* transmitting elements:polychirp.errors.ModelWarning")
@pytest.mark.parametrize("waveform", [CHIRPS, TRIANGLES], ids=["chirps", "triangles"])
@pytest.mark.parametrize("coding", [None, TimeDivision(), PhaseCoded()], ids=repr)
def test_a_point_has_the_snr_that_is_asked_for(waveform, coding):
    """The energy of all samples over the noise density, measured in the pass band.

    The noise is that of 6 frames, averaged over the bins of every ramp below 0.2 of the sample
    rate, where the IF filter is flat. 6 · 2 · 16 ramps · 60 bins: its error is 0.9 %.
    """
    more = {} if coding is None else {**CODED, "coding": coding}
    study = roc_plan(roc_study(waveform, num_sweeps=16, **more), kinds=["auto"], **ASK).study
    echo = frame_with(study, (POINT,), streams=Streams(1))
    energy = np.sum(np.abs(echo.samples) ** 2)
    assert energy / noise_power(study, num_frames=6) == pytest.approx(POINT.snr, rel=0.06)


def test_real_samples_have_the_noise_of_both_sides_in_the_snr():
    """As above; of the energy of y + ȳ, one half is that of the echo's beat, the other its image's.

    The noise of 8 frames: 8 · 4 · 8 ramps · 60 bins, of which those at f and −f are alike: 1.2 %.
    """
    converter = replace(roc_study(CHIRPS).radars[0].converter, sampling="real")
    bare = roc_study(CHIRPS, num_sweeps=8, converter=converter)
    study = roc_plan(bare, kinds=["range-doppler"], **ASK).study
    echo = frame_with(study, (POINT,), streams=Streams(1))
    energy = 0.5 * np.sum(np.abs(echo.samples) ** 2)
    assert energy / noise_power(study, num_frames=8) == pytest.approx(POINT.snr, rel=0.06)


@pytest.mark.filterwarnings("ignore:'front' takes:polychirp.errors.ModelWarning")
@pytest.mark.parametrize("sampling", ["complex", "real"])
def test_noise_that_sampling_adds_counts_in_the_snr(sampling):
    """The stop edge is above the sample rate less the beat; noise is measured beside the beat.

    The noise of 12 frames in 5 bins of 8 ramps and 2 channels: its error is 3 %.
    """
    base = roc_study(CHIRPS, num_sweeps=8)
    converter = replace(base.radars[0].converter, sampling=sampling)
    wide = IfFilter(passband=0.4 * 4e6, stopband=0.95 * 4e6)
    bare = roc_study(CHIRPS, num_sweeps=8, converter=converter, if_filter=wide)
    study = roc_plan(bare, kinds=["range-doppler"], **ASK).study
    point = replace(POINT, range=40.0, range_rate=0.0)
    echo = frame_with(study, (point,), streams=Streams(1))
    beat = 2 * 5e12 * point.range / SPEED_OF_LIGHT
    power = []
    for trial in range(12):
        noise = frame_with(study, (), streams=Streams(trial + 2))
        spectrum = np.fft.fft(noise.samples, axis=2) / np.sqrt(noise.times.most_samples)
        frequency = np.fft.fftfreq(noise.times.most_samples, 1 / noise.times.rate)
        power.append(np.abs(spectrum[:, :, np.argsort(np.abs(frequency - beat))[:5]]) ** 2)
    energy = np.sum(np.abs(echo.samples) ** 2) * (0.5 if sampling == "real" else 1.0)
    assert aliased_noise(wide, np.array([beat]), 4e6)[0] > 0.2
    assert energy / np.mean(power) == pytest.approx(POINT.snr, rel=0.1)


@pytest.mark.parametrize("waveform", [CHIRPS, TRIANGLES], ids=["chirps", "triangles"])
def test_a_point_is_where_the_receivers_find_it(waveform):
    """From a moving car with a turned radar; a tenth of a cell, with 70 dB."""
    base = roc_study(waveform, num_sweeps=16)
    mount = replace(base.radars[0].mount, x=2.0, yaw=0.7, z=0.5)
    radars = (replace(base.radars[0], mount=mount, start_time=2e-3), base.radars[1])
    kinds = ["range-doppler" if waveform is CHIRPS else "coherent"]
    plan = roc_plan(replace(base, radars=radars), kinds=kinds, **ASK)
    frame = frame_with(plan.study, (POINT,), streams=Streams(1))
    found = plan.curves[0].receiver.detect(frame)
    distance, rate = POINT.at(found.time - middle_of(frame.schedule))
    assert found.range[0] == pytest.approx(distance, abs=0.08)
    assert found.range_rate[0] == pytest.approx(rate, abs=0.1 * 1.2)
    assert found.azimuth[0] == pytest.approx(POINT.azimuth, abs=0.02)


def test_points_fill_the_window_and_stay_in_it():
    window = roc_plan(roc_study(), **ASK).window
    draw = np.random.default_rng(1)
    points = [drawn_points(window, None, snr=1.0, random=draw)[0] for _ in range(2000)]
    ends = np.array([[p.at(-window.half_frame)[0], p.at(window.half_frame)[0]] for p in points])
    assert ends.min() >= window.least_range - 1e-9
    assert ends.max() <= window.greatest_range + 1e-9
    ranges = np.array([p.range for p in points])
    rates = np.array([p.range_rate for p in points])
    sines = np.sin([p.azimuth for p in points])
    for values, low, high in (
        (ranges, window.least_range, window.greatest_range),
        (rates, -window.greatest_speed, window.greatest_speed),
        (sines, -np.sin(np.pi / 3), np.sin(np.pi / 3)),
    ):
        # a uniform variable's mean is known to 4 sigma, 4 · 0.289/√2000 of the span
        assert np.mean(values) == pytest.approx(0.5 * (low + high), abs=0.03 * (high - low))
        assert np.std(values) == pytest.approx((high - low) / np.sqrt(12), rel=0.06)


def test_a_strong_point_is_beside_the_tested_one_and_inside_the_window():
    window = roc_plan(roc_study(), **ASK).window
    strong = Strong(ratio=100.0, apart=Extent(3.0, 1.0))
    draw = np.random.default_rng(1)
    for _ in range(200):
        tested, other = drawn_points(window, strong, snr=7.0, random=draw)
        assert abs(other.range - tested.range) == pytest.approx(3.0)
        assert abs(other.range_rate - tested.range_rate) == pytest.approx(1.0)
        assert (tested.snr, other.snr) == (7.0, 700.0)
        assert window.least_range <= other.range <= window.greatest_range


def test_a_frame_depends_on_its_trial_and_snr_alone():
    """Another SNR or another receiver in the plan, or other frames before it, change nothing."""
    one = roc_plan(roc_study(), **ASK)
    other = roc_plan(roc_study(), snrs_db=[8.0, 14.0], trials=1, noise_trials=1)
    measured(other, 8.0, 0)
    assert measured(other, 14.0, 1) == measured(one, 14.0, 1)
    frames = [
        frame_with(of_trial(one.study, trial), (), streams=Streams(trial)).samples
        for trial in (0, 1)
    ]
    assert not np.array_equal(*frames)


def test_noise_differs_from_snr_to_snr():
    """The scatter of a curve's points about a smooth line then shows their errors.

    At 1e-2 a map of 1184 cells has some eight detections of noise.
    """
    plan = roc_plan(roc_study(), probabilities=[1e-2], **ASK)
    counts = [
        [measured(plan, snr_db, trial).others for trial in range(6)] for snr_db in (3.0, 3.001)
    ]
    assert counts[0] != counts[1]


def detections(*places):
    some = np.array(places, dtype=np.float64).reshape(-1, 2)
    ones = np.ones(len(some))
    return Detections(
        time=2.0, range=some[:, 0], range_rate=some[:, 1], azimuth=ones, power=ones, snr=ones
    )


NEAR = DrawnPoint(range=10.0, range_rate=1.0, azimuth=0.0, snr=1.0)
FAR = DrawnPoint(range=10.5, range_rate=1.0, azimuth=0.0, snr=1.0)
LIMITS = Extent(0.4, 0.2)


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        ([], [False, False]),
        ([(11.0, 1.0)], [True, False]),  # one second after the middle, at 1 m/s
        ([(11.3, 1.0)], [False, True]),  # nearer to the second
        ([(11.0, 1.3)], [False, False]),
        ([(11.0, 1.0), (11.2, 1.0)], [True, True]),
        ([(11.0, 1.0), (14.0, 1.0), (10.0, 5.0)], [True, False]),
        ([(10.59, 1.0)], [False, False]),
    ],
)
def test_a_point_is_found_by_a_detection_of_its_own(seen, expected):
    found = found_points(detections(*seen), (NEAR, FAR), limits=LIMITS, middle=1.0)
    assert found.tolist() == expected


def test_other_detections_are_those_of_no_point():
    """With 60 dB more, the strong point is detected, and is not counted as another detection."""
    plan = roc_plan(roc_study(), strong=from_db(10.0), apart=(6.0, 0.0), **ASK)
    record = measured(plan, 40.0, 0)
    assert (record.found, record.others) == ((True,), (0,))


@pytest.mark.filterwarnings("ignore:the .* equal ramps of:polychirp.errors.ModelWarning")
@pytest.mark.filterwarnings("ignore:the .* transmitting elements:polychirp.errors.ModelWarning")
def test_coded_frames_are_decoded_for_receivers_that_cannot_do_so():
    study = roc_study(num_sweeps=8, **CODED, coding=TimeDivision())
    plan = roc_plan(study, kinds=["range-doppler", "coherent"], **ASK)
    frame = frame_with(plan.study, (), streams=Streams(1))
    channels = [as_read(c.receiver, frame).array.num_channels for c in plan.curves]
    assert channels == [2, 4]
