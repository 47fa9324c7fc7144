"""Blanking before the range transform, and the bursts that it finds."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.mitigation import Blanking
from polychirp.receiver.signal_model.point_signal import hann_weights, matched_amplitudes
from polychirp.rng import Streams
from polychirp.waveform import Triangular
from tests.support.points import HandPoint, frame_of

RAMPS = Triangular().schedule(num_sweeps=1, streams=Streams(1))
ECHO = HandPoint(range=9.0, power=1e4)


def struck(frame, *, start=500, stop=504, level=1e4):
    """The frame with a burst in its second ramp."""
    samples = frame.samples.copy()
    samples[:, 1, start:stop] += level
    return frame.with_samples(samples)


def test_echoes_alone_are_not_touched():
    """A steady echo has one amplitude; noise 40 dB below never triples it."""
    frame = frame_of(RAMPS, [ECHO])
    cleaned = Blanking().mitigate(frame)
    assert np.array_equal(cleaned.weight, frame.times.is_sample)
    assert np.array_equal(cleaned.samples, frame.samples)


def test_a_burst_goes_with_its_neighbours_and_nothing_else():
    frame = frame_of(RAMPS, [ECHO])
    cleaned = Blanking(guard=8e-6).mitigate(struck(frame))
    zeroed = np.all(cleaned.samples == 0.0, axis=0) & frame.times.is_sample
    assert np.flatnonzero(zeroed[1]).tolist() == list(range(492, 512))
    assert np.array_equal(cleaned.weight, frame.times.is_sample & ~zeroed)
    assert not zeroed[0].any()
    assert np.array_equal(cleaned.samples[:, 0], frame.samples[:, 0])


def test_an_interferer_that_fills_the_ramp_is_not_touched():
    """A synchronous ghost looks like an echo: no blanking can tell."""
    frame = frame_of(RAMPS, [ECHO, HandPoint(range=6.6, power=1e7)])
    assert not Blanking().hit(frame).any()
    assert not Blanking(whitening=0).hit(frame).any()


def test_prediction_shows_a_burst_that_is_weaker_than_the_echoes():
    """20 dB below the echo and 20 dB above the noise; found where it is, to the sample."""
    frame = struck(frame_of(RAMPS, [ECHO, HandPoint(range=17.0, power=3e3)]), level=10.0)
    assert not Blanking(whitening=0).hit(frame).any()
    hit = Blanking(guard=0.0).hit(frame)
    assert np.flatnonzero(hit[1]).tolist() == [500, 501, 502, 503]
    assert not hit[0].any()


def test_a_tapered_gap_is_smooth_on_both_sides_and_the_ramps_ends_are_kept():
    frame = struck(frame_of(RAMPS, [ECHO]))
    weight = Blanking(guard=8e-6, taper=3e-6).mitigate(frame).weight[1]
    rise = 0.5 * (1 - np.cos(np.pi * np.array([1, 2, 3, 4]) / 4))
    assert weight[511:516] == pytest.approx([0.0, *rise])
    assert weight[488:493] == pytest.approx([*rise[::-1], 0.0])
    assert weight[0] == 1.0
    assert weight[frame.times.num_samples[1] - 1] == 1.0


@pytest.mark.parametrize(("taper", "length"), [(0.0, 300), (20e-6, 300), (100e-6, 100)])
def test_what_blanking_costs_is_the_share_of_the_window_that_it_takes(compare, taper, length):
    """Noise in 1600 tones with and without the gap, against sums over a gap drawn by hand."""
    frame = struck(frame_of(RAMPS, [], noise=0.0), stop=500 + length)
    noise = frame_of(RAMPS, [], seed=3)
    method = Blanking(guard=0.0, taper=taper)
    cleaned = method.mitigate(noise.with_samples(noise.samples + 1e3 * frame.samples))
    phases = np.zeros((400, RAMPS.num_ramps, 3))
    phases[:, :, 1] = np.linspace(-0.4e6, 0.4e6, 400)[:, None]  # as many tones, 2 kHz apart

    def noise_power(samples, weight):
        found = matched_amplitudes(samples, hann_weights(weight), phases, frame.times.rate)
        return np.mean(np.abs(found[:, :, 1]) ** 2)

    whole = noise_power(noise.samples, noise.times.is_sample)
    measured = 10 * np.log10(noise_power(cleaned.repair(noise.samples), cleaned.weight) / whole)
    size = int(frame.times.num_samples[1])
    n = np.arange(size)
    window = np.sin(np.pi * (n + 0.5) / size) ** 2
    away = np.maximum(np.maximum(500 - n, n - (499 + length)), 0)
    reach = round(taper * frame.times.rate) + 1
    window *= 0.5 * (1 - np.cos(np.pi * np.minimum(away / reach, 1.0)))
    expected = -10 * np.log10(np.sum(window) ** 2 / np.sum(window**2) / (size / 1.5))
    compare(
        page="mitigation",
        case=f"blanking {length} of {size} samples, taper {taper * 1e6:g} samples",
        quantity="loss of SNR, dB",
        expected=float(expected),
        measured=float(measured),
        tolerance=4.34 * 2 / np.sqrt(1600),  # two standard deviations of as many powers
        source="(Σwu)²/Σw²u²",
    )


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"factor": 1.0}, "factor"),
        ({"guard": -1e-6}, "guard"),
        ({"taper": -1e-6}, "taper"),
        ({"whitening": -1}, "whitening"),
    ],
)
def test_what_cannot_be_is_refused(wrong, word):
    with pytest.raises(InputError, match=word):
        Blanking(**wrong)
