"""Ridges removed from the time-frequency plane."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.mitigation import Blanking, StftExcision
from polychirp.receiver.mitigation.stft_excision import whole_slices
from polychirp.rng import Streams
from polychirp.waveform import Triangular
from tests.support.points import HandPoint, frame_of

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


@pytest.mark.parametrize("cells", ["zeroed", "levelled"])
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
