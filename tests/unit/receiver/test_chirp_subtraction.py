"""Chirps of nearly parallel interferers, subtracted beside echoes."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.axes import axes_of
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.radar import Converter
from polychirp.receiver.mitigation import ChirpSubtraction
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth
from tests.support.points import HandPoint, frame_of

CHIRPS = Sawtooth(start_frequency=77e9, bandwidth=4e8, ramp_duration=40e-6).schedule(
    num_sweeps=8, streams=Streams(1)
)
UNEQUAL = DiverseTriangular(bandwidth=(300e6, 400e6), ramp_duration=(30e-6, 50e-6)).schedule(
    num_sweeps=2, streams=Streams(3)
)
FAST = Converter(sample_rate=10e6, start=3e-6, margin=1e-6)
POINTS = [
    HandPoint(range=9.0, range_rate=-5.0, azimuth=0.3, power=1e4),
    HandPoint(range=17.0, range_rate=3.0, azimuth=-0.5, power=1e3),
]


def chirps(*, points=POINTS, ramps=CHIRPS, seed=0, noise=1.0):
    return frame_of(ramps, points, seed=seed, converter=FAST, noise=noise)


def long_burst(frame, *, sweep=60.0, level=300.0, turn=0.4, curve=0.0):
    """A chirp of ``sweep`` cells on every ramp from one direction; ``curve`` bends amplitudes."""
    out = np.zeros_like(frame.samples)
    draw = np.random.default_rng(4)
    direction = np.exp(1j * turn * np.arange(len(out)))
    for k, length in enumerate(frame.times.num_samples):
        place = np.arange(length) - 0.5 * length
        middle = draw.uniform(-0.2, 0.2)
        cycles = 0.5 * sweep / length**2 * place**2 + middle * place + draw.random()
        amplitude = level * (1.0 + curve * (2.0 * place / length) ** 2)
        out[:, k, :length] = direction[:, None] * amplitude * np.exp(2j * np.pi * cycles)
    return out


def power(samples, frame):
    return float(np.mean(np.abs(samples[:, frame.times.is_sample]) ** 2))


@pytest.mark.parametrize("ramps", [CHIRPS, UNEQUAL], ids=["equal", "unequal"])
@pytest.mark.parametrize("sweep", [-90.0, 30.0, 60.0])
def test_a_burst_as_long_as_the_ramp_goes_and_echoes_stay(ramps, sweep):
    """50 dB above the noise before and below it after; echoes lose less than 1 % of their power."""
    echo, noise = chirps(ramps=ramps, noise=0.0), chirps(points=[], ramps=ramps, seed=5)
    other = long_burst(echo, sweep=sweep)
    method = ChirpSubtraction().mitigate(echo.with_samples(echo.samples + noise.samples + other))
    assert power(method.repair(other), echo) < 0.5 * power(noise.samples, echo)
    changed = method.repair(echo.samples) - echo.samples
    assert power(changed, echo) < 0.01 * power(echo.samples, echo)
    parts = method.repair(np.stack([echo.samples, noise.samples, other]))
    assert np.abs(parts.sum(axis=0) - method.samples).max() < 1e-9 * np.abs(other).max()
    assert np.array_equal(method.weight, echo.times.is_sample)


def test_an_amplitude_that_changes_over_the_ramp_is_followed():
    """A parabola of half the amplitude is within the polynomial of degree 2."""
    echo, noise = chirps(noise=0.0), chirps(points=[], seed=5)
    other = long_burst(echo, curve=-0.5)
    method = ChirpSubtraction().mitigate(echo.with_samples(echo.samples + noise.samples + other))
    assert power(method.repair(other), echo) < 0.5 * power(noise.samples, echo)


def test_clean_frames_and_short_bursts_are_left_as_they_are():
    frame = chirps()
    assert np.array_equal(ChirpSubtraction().mitigate(frame).samples, frame.samples)
    short = frame.samples.copy()
    short[:, 3, 100:120] += 300.0
    short[:, 4, 100:130] += 300.0 * np.exp(1j * np.pi * 0.03 * np.arange(30.0) ** 2)
    found = ChirpSubtraction().mitigate(frame.with_samples(short)).samples
    assert np.array_equal(found, short)


def test_a_sweep_of_few_cells_stays_like_an_extended_body():
    frame = chirps()
    spoiled = frame.with_samples(frame.samples + long_burst(frame, sweep=3.0, level=30.0))
    assert np.array_equal(ChirpSubtraction().mitigate(spoiled).samples, spoiled.samples)


def test_real_samples_stay_real_and_lose_the_burst():
    """A real chirp is two complex ones, of opposite rates and frequencies."""
    echo, noise = (
        frame.with_samples(frame.samples.real + 0j)
        for frame in (chirps(noise=0.0), chirps(points=[], seed=5))
    )
    other = long_burst(echo).real + 0j
    method = ChirpSubtraction().mitigate(echo.with_samples(echo.samples + noise.samples + other))
    assert np.abs(method.samples.imag).max() < 1e-9 * np.abs(other).max()
    assert power(method.repair(other), echo) < power(noise.samples, echo)


def test_of_noise_alone_no_more_ramps_change_than_is_stated():
    """With one in ten stated for the threshold, the first chirp must exceed 100 times that."""
    frame = frame_of(
        Sawtooth(start_frequency=77e9, bandwidth=4e8, ramp_duration=20e-6).schedule(
            num_sweeps=200, streams=Streams(1)
        ),
        [],
        converter=FAST,
    )
    found = ChirpSubtraction(false_mitigation=0.1).mitigate(frame)
    assert np.array_equal(found.samples, frame.samples)


def test_one_ramp_alone_is_repaired_as_among_others():
    frame = chirps(ramps=UNEQUAL)
    frame = frame.with_samples(frame.samples + long_burst(frame))
    whole = ChirpSubtraction().mitigate(frame).samples
    length = int(frame.times.num_samples[1])
    one = {name: getattr(UNEQUAL, name)[1:2] for name in axes_of(type(UNEQUAL))}
    alone = IfFrame(
        samples=frame.samples[:, 1:2, :length],
        times=SampleTimes(
            first=frame.times.first[1:2], num_samples=[length], rate=frame.times.rate
        ),
        schedule=replace(UNEQUAL, **one),
        array=frame.array,
    )
    found = ChirpSubtraction().mitigate(alone).samples[:, 0]
    assert np.abs(found - whole[:, 1, :length]).max() < 1e-9 * np.abs(whole).max()


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"shortest": 0.0}, "shortest"),
        ({"least_sweep": 1.0}, "sweep"),
        ({"most": 0}, "choice"),
        ({"false_mitigation": 0.5}, "false_mitigation"),
    ],
)
def test_settings_that_cannot_be_are_refused(wrong, word):
    with pytest.raises(InputError, match=word):
        ChirpSubtraction(**wrong)
