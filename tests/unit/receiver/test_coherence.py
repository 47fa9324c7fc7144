"""Whether ramps move like one point."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.chain import LEAST_COHERENCE, Receiver
from polychirp.receiver.coherence import coherence
from polychirp.receiver.point import replica
from polychirp.rng import Streams
from polychirp.testing.points import frame_of
from polychirp.waveform import Triangular

RAMPS = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(num_sweeps=16, streams=Streams(1))
MIDDLE = RAMPS.start_time + 0.5 * RAMPS.duration
FREQUENCY = RAMPS.centre_frequency


def turned(rate, acceleration):
    """Amplitudes of a point whose rate and acceleration were fitted that much wrong: (1, 1, K)."""
    elapsed = MIDDLE - MIDDLE.mean()
    way = rate * elapsed + 0.5 * acceleration * elapsed**2
    return np.exp(4j * np.pi * FREQUENCY / SPEED_OF_LIGHT * way)[None, None]


@pytest.mark.parametrize(("rate", "acceleration"), [(0.0, 0.0), (0.08, -9.0), (-0.1, 30.0)])
def test_one_point_coheres_whatever_its_fit_left_open(rate, acceleration):
    """Steps of a third of a cycle: at most an eighth of a cycle rms is lost, sinc² > 0.8."""
    assert coherence(turned(rate, acceleration), FREQUENCY, MIDDLE)[0] > 0.8


def test_a_false_pair_does_not_cohere():
    """Up-ramps of one echo with down-ramps of another, of a metre per second between them."""
    pair = turned(0.0, 0.0)
    pair[..., 1::2] = 1j * turned(1.1, 3.0)[..., 1::2]
    assert coherence(pair, FREQUENCY, MIDDLE)[0] < LEAST_COHERENCE


def test_noise_does_not_cohere():
    draw = np.random.default_rng(3)
    noise = draw.normal(size=(200, 4, 32)) + 1j * draw.normal(size=(200, 4, 32))
    assert coherence(noise, FREQUENCY, MIDDLE).max() < LEAST_COHERENCE


def test_an_echo_whose_phase_jumps_from_ramp_to_ramp_is_not_claimed():
    """Strong on every ramp, but no body moves like that."""
    frame = frame_of(RAMPS, [])
    times = sample_times(RAMPS, Converter())
    signal = replica(RAMPS, times, motion=np.array([9.0, 3.0, 0.0]), time=0.0)
    phase = np.exp(2j * np.pi * np.random.default_rng(5).random(RAMPS.num_ramps))
    jumping = frame.with_samples(frame.samples + 30.0 * (phase[:, None] * signal))
    steady = frame.with_samples(frame.samples + 30.0 * signal)
    assert Receiver().detect(jumping).num_detections == 0
    assert Receiver().detect(steady).num_detections == 1
