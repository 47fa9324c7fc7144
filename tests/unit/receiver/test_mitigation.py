"""Rules that every mitigation obeys."""

import numpy as np
import pytest

from polychirp.model.radar import Converter
from polychirp.receiver.mitigation import Autoregression, Blanking, Imat, StftExcision
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.signal_model.point_signal import (
    beat_phase,
    hann_weights,
    matched_amplitudes,
)
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=3, streams=Streams(2))
POINTS = [
    HandPoint(range=9.0, range_rate=-5.0, azimuth=0.3, power=1e4),
    HandPoint(range=17.0, range_rate=3.0, azimuth=-0.5, power=1e3),
]
METHODS = {
    "blanking": Blanking(),
    "tapered blanking": Blanking(taper=8e-6),
    "autoregression": Autoregression(),
    "imat": Imat(),
    "zeroing excision": StftExcision(),
    "levelling excision": StftExcision(cells="levelled"),
    "filling excision": StftExcision(cells="filled"),
}


PARAMS = [
    pytest.param(method, marks=[pytest.mark.slow] if name == "filling excision" else [], id=name)
    for name, method in METHODS.items()
]


@pytest.fixture(params=PARAMS)
def method(request):
    return request.param


def bursts(frame, level=300.0):
    """One burst of 12 samples in every ramp, the same in all channels."""
    out = np.zeros_like(frame.samples)
    draw = np.random.default_rng(1)
    for k, length in enumerate(frame.times.num_samples):
        start = draw.integers(100, length - 100)
        out[:, k, start : start + 12] = level * np.exp(2j * np.pi * draw.random(12))
    return out


def amplitudes(cleaned, frame, point):
    motion = np.array([[point.range, point.range_rate, 0.0]])
    phases = beat_phase(RAMPS, frame.times, motion=motion, time=float(RAMPS.start_time[0]))
    return matched_amplitudes(
        cleaned.samples, hann_weights(cleaned.weight), phases, frame.times.rate
    )[0]


def test_parts_go_through_it_one_by_one_and_still_sum_to_the_whole(method):
    echo, noise = frame_of(RAMPS, POINTS, noise=0.0), frame_of(RAMPS, [], seed=5)
    other = bursts(echo)
    cleaned = mitigated(method, echo.with_samples(echo.samples + noise.samples + other))
    parts = cleaned.repair(np.stack([echo.samples, noise.samples, other]))
    assert np.abs(parts.sum(axis=0) - cleaned.samples).max() < 1e-11 * np.abs(cleaned.samples).max()
    assert not np.allclose(cleaned.samples, echo.samples + noise.samples + other)


def test_bursts_go_and_echoes_stay(method):
    """What is left of 300 times the noise is less than noise; a weak echo keeps its amplitude."""
    clean = frame_of(RAMPS, POINTS)
    other = bursts(clean)
    cleaned = mitigated(method, clean.with_samples(clean.samples + other))
    left = cleaned.repair(other) * cleaned.weight
    assert np.mean(np.abs(left) ** 2) < 0.05
    for point in POINTS:
        expected = amplitudes(mitigated(None, clean), clean, point)
        found = amplitudes(cleaned, clean, point)
        error = np.sqrt(np.mean(np.abs(found - expected) ** 2) / np.mean(np.abs(expected) ** 2))
        assert error < 0.05


def test_a_frame_without_interference_is_not_touched(method):
    frame = frame_of(RAMPS, POINTS)
    cleaned = mitigated(method, frame)
    assert np.array_equal(cleaned.weight, frame.times.is_sample)
    assert cleaned.samples == pytest.approx(frame.samples, abs=1e-9)


def test_nothing_is_present_in_the_padding_or_without_weight(method):
    frame = frame_of(RAMPS, POINTS)
    cleaned = mitigated(method, frame.with_samples(frame.samples + bursts(frame)))
    assert not cleaned.samples[:, cleaned.weight == 0.0].any()
    assert not cleaned.weight[~frame.times.is_sample].any()
    assert cleaned.weight.min() >= 0.0
    assert cleaned.weight.max() <= 1.0


def test_azimuths_are_kept(method):
    """From channel to channel the amplitude of a single echo turns as it did before."""
    frame = frame_of(RAMPS, POINTS[:1], noise=1e-6)
    cleaned = mitigated(method, frame.with_samples(frame.samples + bursts(frame, 1e4)))
    before = amplitudes(mitigated(None, frame), frame, POINTS[0])
    after = amplitudes(cleaned, frame, POINTS[0])
    turn = np.angle(after[1:] * after[:-1].conj() / (before[1:] * before[:-1].conj()))
    assert np.abs(turn).max() < 1e-3


@pytest.mark.parametrize(
    ("default", "explicit"),
    [
        (Blanking(), Blanking(guard=8e-6)),
        (Autoregression(), Autoregression(guard=8e-6)),
        (Imat(), Imat(guard=8e-6)),
    ],
    ids=["blanking", "autoregression", "imat"],
)
def test_on_the_papers_ramps_the_default_guard_is_8_us(default, explicit):
    frame = frame_of(RAMPS, POINTS)
    frame = frame.with_samples(frame.samples + bursts(frame))
    assert np.array_equal(mitigated(default, frame).samples, mitigated(explicit, frame).samples)
    assert np.array_equal(mitigated(default, frame).weight, mitigated(explicit, frame).weight)


def test_the_default_guard_shrinks_as_the_sample_rate_grows():
    """A chirp of 40 µs at 20 MS/s: 8 samples on either side of a burst of 4, not 160."""
    ramps = Sawtooth(start_frequency=77e9, bandwidth=4e8, ramp_duration=40e-6).schedule(
        num_sweeps=2, streams=Streams(1)
    )
    converter = Converter(sample_rate=20e6, start=3e-6, margin=1e-6)
    frame = frame_of(ramps, POINTS[:1], converter=converter)
    samples = frame.samples.copy()
    samples[:, 1, 300:304] += 1e4
    cleaned = mitigated(Blanking(), frame.with_samples(samples))
    assert np.flatnonzero(cleaned.weight[1] == 0.0).tolist() == list(range(292, 312))


def test_without_mitigation_all_samples_are_present():
    frame = frame_of(RAMPS, POINTS)
    cleaned = mitigated(None, frame)
    assert np.array_equal(cleaned.samples, frame.samples)
    assert np.array_equal(cleaned.weight, frame.times.is_sample)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_the_mitigation_of_a_frame_is_cached(method):
    frame = frame_of(RAMPS, POINTS)
    cleaned = mitigated(method, frame)
    assert mitigated(method, frame) is cleaned
    assert mitigated(method, frame.with_samples(2.0 * frame.samples)) is not cleaned
