"""Ridges removed from the time-frequency plane."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.radar import Converter
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation import Blanking, StftExcision
from polychirp.receiver.mitigation.steady_lines import excision_matrix, steady_lines
from polychirp.receiver.mitigation.stft_excision import whole_slices
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.rng import Streams
from polychirp.waveform import Sawtooth, Triangular
from tests.support.points import HandPoint, coded_frame, frame_of

RAMPS = Triangular().schedule(num_sweeps=4, streams=Streams(1))
ECHO = HandPoint(range=9.0, power=1e4)


def ridge(frame, *, duration, level):
    """A chirp through the whole band within ``duration`` samples, in the middle of every ramp."""
    n = np.arange(frame.times.most_samples) - 500.0
    filtered = 1.0 / (1.0 + (1.25 * n / duration) ** 32)  # as an IF filter lets it in and out
    line = level * filtered * np.exp(1j * np.pi * n**2 / duration)
    return np.broadcast_to(line * frame.times.is_sample, frame.samples.shape)


@pytest.mark.parametrize("probability", [1e-2, 1e-3])
def test_noise_crosses_as_often_as_stated(compare, probability):
    schedule = Triangular().schedule(num_sweeps=40, streams=Streams(1))
    frame = frame_of(schedule, [], seed=7)
    method = StftExcision(false_alarm_probability=probability)
    transform = method._transform()
    power = np.mean(np.abs(transform.stft(frame.samples)) ** 2, axis=0)
    crossings, cells = 0, 0
    for k, length in enumerate(frame.times.num_samples):
        first, last = whole_slices(transform, int(length))
        inside = power[k, :, first:last]
        crossings += int(method.above(inside, 4).sum())
        cells += inside.size
    compare(
        page="mitigation",
        case=f"STFT excision, stated {probability:g}",
        quantity="false alarms per cell over stated",
        expected=1.0,
        measured=crossings / cells / probability,
        tolerance=0.3,  # a hundred independent crossings at 1e-3; slices overlap
        source="ordered-statistic CFAR of four looks",
    )


def test_away_from_a_ridge_every_sample_is_what_it_was():
    """The dual window reconstructs perfectly what no cut slice reaches."""
    clean = frame_of(RAMPS, [ECHO])
    struck = clean.with_samples(clean.samples + ridge(clean, duration=6, level=1e3))
    cleaned = StftExcision().mitigate(struck)
    away = np.abs(np.arange(clean.times.most_samples) - 500) > 64
    assert (cleaned.weight < 1.0)[:, ~away].any()
    assert cleaned.weight[:, away] == pytest.approx(clean.times.is_sample[:, away].astype(float))
    assert cleaned.samples[:, :, away] == pytest.approx(clean.samples[:, :, away], abs=1e-10)


def test_samples_beside_a_cut_count_less_but_are_not_smaller():
    """An amplitude fitted with the weights would be too small otherwise."""
    clean = frame_of(RAMPS, [ECHO])
    struck = clean.with_samples(clean.samples + ridge(clean, duration=6, level=1e3))
    cleaned = StftExcision().mitigate(struck)
    beside = (cleaned.weight > 0.0) & (cleaned.weight < 0.9)
    kept = np.abs(cleaned.repair(clean.samples) / np.where(beside, clean.samples, 1.0))[:, beside]
    assert kept.size > 100
    assert np.median(kept) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    "cells", ["zeroed", "levelled", pytest.param("filled", marks=pytest.mark.slow)]
)
def test_a_slow_ridge_goes_and_an_echo_keeps_its_row(cells):
    """The band crossed in 400 samples: cut row by row, the echo's own a few slices long."""
    clean = frame_of(RAMPS, [ECHO])
    other = ridge(clean, duration=400, level=30.0)
    cleaned = StftExcision(cells=cells).mitigate(clean.with_samples(clean.samples + other))
    left = np.mean(np.abs(cleaned.repair(other)) ** 2) / np.mean(np.abs(other) ** 2)
    kept = np.vdot(clean.samples, cleaned.repair(clean.samples)) / np.vdot(
        clean.samples, clean.samples
    )
    assert left < 0.1
    assert abs(kept - 1.0) < 0.15
    assert np.array_equal(cleaned.weight, clean.times.is_sample)


def test_a_burst_below_the_echoes_is_found_beside_their_rows():
    """20 dB below the echo in amplitude, where blanking sees nothing."""
    clean = frame_of(RAMPS, [ECHO], noise=1e-2)
    other = ridge(clean, duration=6, level=10.0)
    struck = clean.with_samples(clean.samples + other)
    assert not Blanking(whitening=0).hit(struck).any()
    cleaned = StftExcision().mitigate(struck)
    assert np.sum(np.abs(cleaned.repair(other) * cleaned.weight) ** 2) < 1e-2 * np.sum(
        np.abs(other) ** 2
    )


def test_levelled_cells_are_brought_to_the_median_of_their_row():
    clean = frame_of(RAMPS, [ECHO], noise=1e-2)
    struck = clean.with_samples(clean.samples + ridge(clean, duration=400, level=100.0))
    gain = StftExcision(cells="levelled").gain(struck)
    transform = StftExcision()._transform()
    power = np.mean(np.abs(transform.stft(struck.samples)) ** 2, axis=0)
    first, last = whole_slices(transform, int(struck.times.num_samples[0]))
    inside = power[0, :, first:last]
    cut = (gain[0, :, first:last] < 1.0) & (gain[0, :, first:last] > 0.0)
    median = np.broadcast_to(np.median(inside, axis=1, keepdims=True), inside.shape)
    assert cut.any()
    assert (gain[0, :, first:last] ** 2 * inside)[cut] == pytest.approx(median[cut])


@pytest.mark.parametrize(
    ("wrong", "word"),
    [({"window": 30}, "window"), ({"false_alarm_probability": 1.0}, "false-alarm")],
)
def test_what_cannot_be_is_refused(wrong, word):
    with pytest.raises(InputError, match=word):
        StftExcision(**wrong)


CHIRPS = Sawtooth(start_frequency=76.5e9, bandwidth=400e6, ramp_duration=20e-6, idle=5e-6)
SHORT = CHIRPS.schedule(num_sweeps=64, streams=Streams(1))
READER = RangeDoppler(greatest_range=60.0)


def drawn_frame(draw, *, count):
    """Equal chirps with points of 60 to 73 dB of SNR in all samples and channels, in noise."""
    converter = Converter(sample_rate=20e6, start=2e-6, margin=0.1e-6)
    per_sample = 64 * 359 * 4
    points = [
        HandPoint(
            range=draw.uniform(3.0, 55.0),
            range_rate=draw.uniform(-30.0, 30.0),
            azimuth=draw.uniform(-0.7, 0.7),
            power=10 ** draw.uniform(6.0, 7.3) / per_sample,
        )
        for _ in range(count)
    ]
    return coded_frame(
        SHORT,
        points,
        array=AntennaArray(num_channels=4),
        converter=converter,
        seed=int(draw.integers(1 << 30)),
    )


def crossings(frame, draw):
    """An interferer that crosses the band in 40 % of a chirp, elsewhere in every other chirp."""
    n = np.arange(frame.times.most_samples)
    duration = 0.4 * n.size
    starts = draw.uniform(0.1, 0.5, 2) * n.size
    out = np.zeros(frame.samples.shape, dtype=np.complex128)
    for k in range(frame.schedule.num_ramps):
        into = n - starts[k % 2]
        inside = 1.0 / (1.0 + (2.2 * (into / duration - 0.5)) ** 32)
        phase = np.pi * 0.9 * (into**2 / duration - into) + draw.uniform(0, 2 * np.pi)
        out[:, k] = 300.0 * inside * np.exp(1j * phase)
    return out


@pytest.mark.parametrize("cells", ["zeroed", "levelled", "filled"])
def test_strong_echoes_without_interference_cause_no_further_detections(cells):
    """Ten drawn frames of one to four points, detected as without mitigation."""
    draw = np.random.default_rng(91)
    for _ in range(10):
        frame = drawn_frame(draw, count=int(draw.integers(1, 5)))
        plain = READER.detect(frame)
        found = replace(READER, mitigation=StftExcision(cells=cells)).detect(frame)
        assert found.num_detections == plain.num_detections
        assert found.range == pytest.approx(plain.range, abs=0.01)
        assert found.power == pytest.approx(plain.power, rel=0.01)


@pytest.mark.slow
def test_gaps_that_are_filled_do_not_spread_strong_echoes_over_range_and_speed():
    """Zeroed gaps of 40 % of a chirp, at two places in turns, make some 15 false detections.

    Filled ones make a fifth of them or fewer over five drawn frames, at least 40 dB below the
    stronger echo. The bursts, 25 to 50 dB above the noise of a sample, are at least 10 dB below it.
    """
    draw = np.random.default_rng(92)
    false = {"zeroed": 0, "filled": 0}
    for _ in range(5):
        clean = drawn_frame(draw, count=2)
        plain = READER.detect(clean)
        other = crossings(clean, draw)
        struck = clean.with_samples(clean.samples + other)
        for cells in false:
            method = StftExcision(cells=cells)
            found = replace(READER, mitigation=method).detect(struck)
            is_echo = np.abs(np.log(found.power[:, None] / plain.power)).min(axis=1) < 0.1
            false[cells] += int(np.sum(~is_echo))
        assert np.mean(np.abs(method.mitigate(struck).repair(other)) ** 2) < 0.1
        assert is_echo.sum() == plain.num_detections
        assert found.power[~is_echo].max(initial=0.0) < 1e-4 * plain.power.max()
    assert false["filled"] <= 0.2 * false["zeroed"]


def test_the_matrix_of_an_excision_is_its_transform_there_and_back():
    draw = np.random.default_rng(93)
    transform = StftExcision()._transform()
    samples = draw.normal(size=(3, 217)) + 1j * draw.normal(size=(3, 217))
    cells = transform.stft(samples)
    gain = draw.integers(0, 2, cells.shape[1:]).astype(float)
    back = transform.istft(cells * gain, k1=217)
    assert samples @ excision_matrix(transform, gain, 217).T == pytest.approx(back, abs=1e-12)


def test_a_sum_of_tones_is_restored_whatever_was_removed():
    """Three tones between the cells of the spectrum, 200 dB above rounding; a third is missing."""
    draw = np.random.default_rng(94)
    transform = StftExcision()._transform()
    for _ in range(5):
        length = int(draw.integers(200, 400))
        gain = np.ones(transform.stft(np.zeros(length)).shape)
        start = int(draw.integers(5, gain.shape[1] // 2))
        gain[:, start : start + gain.shape[1] // 3] = 0.0
        frequency = np.sort(draw.uniform(0.0, 0.2, 3)) + np.array([0.0, 0.3, 0.6])
        tones = np.exp(2j * np.pi * np.outer(frequency, np.arange(length)))
        samples = draw.uniform(0.3, 1.0, (2, 3)) @ tones
        matrix = excision_matrix(transform, gain, length)
        kept = samples @ matrix.T
        lines = steady_lines(kept, matrix, gain.mean(axis=1))
        filled = kept + kept @ lines.fit.T @ lines.missing.T
        assert np.abs(filled - samples).max() < 1e-3
        assert np.abs(kept - samples).max() > 0.5


def noise_alone(*, num_channels, num_ramps, length, is_real=False):
    """A frame of white noise on equal ramps."""
    draw, k = np.random.default_rng(7), np.arange(num_ramps)
    ramps = RampSchedule(
        start_time=k * 160e-6, duration=0 * k + 155e-6, start_frequency=0 * k + 77e9,
        slope=0 * k + 1e13, start_phase=0 * k, sweep=k,
    )  # fmt: skip
    times = SampleTimes(first=ramps.start_time, num_samples=0 * k + length, rate=10e6)
    samples = draw.normal(size=(2, num_channels, num_ramps, length))
    noise = samples[0] + (0 if is_real else 1j) * samples[1]
    return IfFrame(
        samples=noise.astype(complex), times=times, schedule=ramps,
        array=AntennaArray(num_channels=num_channels),
    )  # fmt: skip


@pytest.mark.parametrize("length", [64, 96, 128, 192, 256, 512, 1024])
@pytest.mark.parametrize("num_channels", [1, 4])
def test_ramps_of_two_windows_or_more_keep_the_stated_rate(num_channels, length):
    """A whole number of independent slices gave 0.03 to 4.9 times the stated rate.

    Some 1200 crossings, of which those of overlapping cells come together: 30 % are 5 standard
    deviations. Two windows have little that is not the cell's own, and are hit more rarely.
    """
    frame = noise_alone(num_channels=num_channels, num_ramps=150_000 // length, length=length)
    found = StftExcision(false_alarm_probability=1e-3).hit_cells(frame).mean() / 1e-3
    assert (0.5 if length < 96 else 0.7) < found < 1.3


@pytest.mark.parametrize("is_real", [False, True])
@pytest.mark.parametrize("num_channels", [1, 4])
def test_noise_exceeds_the_thresholds_as_rarely_as_stated(num_channels, is_real):
    """In every row: of real samples, those at zero and at half the sample rate have half a look."""
    stated = 1e-3
    frame = noise_alone(num_channels=num_channels, num_ramps=200, length=512, is_real=is_real)
    hit = StftExcision(false_alarm_probability=stated).hit_cells(frame)
    rows = hit.mean(axis=(0, 2)) / stated
    assert rows.mean() < 2.0
    assert rows.max() < 4.0
