"""Interference that is stronger at some ranges than at others, and arrives from one direction."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import poisson

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.coherent_map import MapLimits, map_axes
from polychirp.receiver.coherent.noise_directions import NoiseDirections
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.search import adapted
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of

RECEIVER = CoherentReceiver(greatest_range=20.0, greatest_speed=12.0, false_alarm_probability=1e-5)
POWER = 10.0
STEERING = np.exp(1j * np.pi * np.sin(0.3) * np.arange(4))


def interfered(seed: int, points=(), *, power: float = POWER):
    """White noise of 1 W, and noise from 0.3 rad that rises to ``power`` at the beats of 20 m."""
    ramps = DiverseTriangular().schedule(num_sweeps=8, streams=Streams(3))
    one = frame_of(ramps, points, seed=seed)
    shape = one.samples.shape[1:]
    draw = np.random.default_rng([seed, 1]).normal(scale=np.sqrt(0.5 * power), size=(2, *shape))
    beat = np.fft.fftfreq(shape[1], 1.0 / one.times.rate)
    distance = 0.5 * SPEED_OF_LIGHT * np.abs(beat) / np.abs(ramps.slope)[:, None]
    burst = np.fft.ifft(np.fft.fft(draw[0] + 1j * draw[1]) * np.minimum(distance / 20.0, 1.0) ** 4)
    return replace(one, samples=one.samples + STEERING[:, None, None] * burst)


def noise_of(one):
    """Noise by direction of a frame without points, and the observation."""
    seen = Observation.of(one, mitigated(None, one))
    residual = Residual.of(seen, Points.none(4))
    axes = map_axes(seen, MapLimits.of(RECEIVER))
    seen, profiles = adapted(seen, residual, axes, is_rough=False)
    return NoiseDirections.of(seen, profiles), seen


@pytest.mark.parametrize("distance", [3.4, 17.1])
def test_the_noise_towards_a_direction_is_that_of_the_covariance_at_the_range(distance):
    """Kay's test of known covariance C, in the middle of a band: the statistic is z* C⁻¹ z."""
    noise, seen = noise_of(interfered(1))
    power = POWER * (distance / 20.0) ** 8
    covariance = np.eye(4) + power * np.outer(STEERING, STEERING.conj())
    white = seen.mixing @ covariance @ seen.mixing.conj().T
    draw = np.random.default_rng(2).normal(size=(2, 50, 4))
    amplitude = np.vstack([seen.mixing @ STEERING, draw[0] + 1j * draw[1]])
    test = np.einsum("pm,mn,pn->p", amplitude.conj(), np.linalg.inv(white), amplitude).real
    expected = np.sum(np.abs(amplitude) ** 2, axis=1) / test
    found = noise.towards(amplitude, np.full(len(amplitude), distance))
    assert found == pytest.approx(expected, rel=0.2)


def test_white_noise_is_equal_in_all_directions():
    noise, _ = noise_of(interfered(1, power=0.0))
    amplitude = np.random.default_rng(2).normal(size=(20, 4)) + 0j
    found = noise.towards(amplitude, np.linspace(0.5, 20.0, 20))
    assert np.all(noise.whitening == np.eye(4))
    assert found == pytest.approx(1.0, rel=0.15)


def test_interference_at_some_ranges_causes_no_more_detections_than_stated():
    """Of six frames; one covariance for all ranges let 167 pass, and 2.5 are stated."""
    frames = [interfered(seed) for seed in range(20, 26)]
    false = [RECEIVER.detect(one).num_detections for one in frames]
    stated = sum(RECEIVER.expected_false_detections(one) for one in frames)
    assert sum(false) <= poisson.ppf(0.999, stated)


def test_a_point_from_another_direction_stands_out_of_less_noise():
    """Of 20 dB over the noise of its own direction, and below that of the interference."""
    points = [HandPoint(range=17.5, range_rate=-3.0, azimuth=-0.5, power=0.012)]
    frames = [interfered(seed, points) for seed in range(60, 72)]
    found = [RECEIVER.detect(one) for one in frames]
    is_point = [
        (np.abs(one.range - 17.5 + 3.0 * one.time) < 0.05)
        & (np.abs(one.range_rate + 3.0) < 0.1)
        & (np.abs(one.azimuth + 0.5) < 0.06)
        for one in found
    ]
    assert [np.count_nonzero(some) for some in is_point] == [1] * len(frames)
    stated = sum(RECEIVER.expected_false_detections(one) for one in frames)
    assert sum(np.count_nonzero(~some) for some in is_point) <= poisson.ppf(0.999, stated)
