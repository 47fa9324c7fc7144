"""The IF signal of a moving point, and its removal."""

import numpy as np
import pytest

from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.signal_model.point_signal import (
    beat_frequency,
    beat_phase,
    fit_amplitudes,
    hann_weights,
    matched_amplitudes,
    replica,
)
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular

RAMPS = DiverseTriangular().schedule(num_sweeps=2, streams=Streams(3))
TIMES = sample_times(RAMPS, Converter())
MOTION = np.array([[9.0, -17.0, 6.0], [21.0, 30.0, 0.0]])


def test_a_point_is_taken_out_completely():
    """Kernel (recurrence) and reference (phase evaluated at every sample) are one signal.

    Not quite with acceleration: the kernel leaves out the cubic of a ramp, b a t³/c cycles, here
    6e11 · 6 · (1 ms)³ / 3e8 = 1e-5 turns in its middle half.
    """
    weight = hann_weights(TIMES.is_sample)
    signals = [replica(RAMPS, TIMES, motion=m, time=0.0) for m in MOTION]
    samples = np.stack([2.0j * signals[0] + 0.01 * signals[1], signals[0] - 3.0 * signals[1]])
    phases = beat_phase(RAMPS, TIMES, motion=MOTION, time=0.0)
    amplitude, residual = fit_amplitudes(samples, weight, phases, TIMES.rate)
    expected = np.array([[2.0j, 1.0], [0.01, -3.0]])
    assert amplitude == pytest.approx(np.repeat(expected[:, :, None], 4, axis=2), abs=5e-4)
    assert np.abs(residual).max() < 1e-2 * np.abs(samples).max()


def test_a_match_is_the_fit_of_a_point_alone():
    weight = hann_weights(TIMES.is_sample)
    random = np.random.default_rng(3)
    samples = random.standard_normal((2, *weight.shape)) + 1j
    phases = beat_phase(RAMPS, TIMES, motion=MOTION, time=0.0)
    found = matched_amplitudes(samples, weight, phases, TIMES.rate)
    for p in range(len(MOTION)):
        alone, _ = fit_amplitudes(samples, weight, phases[p : p + 1], TIMES.rate)
        np.testing.assert_allclose(found[p], alone[0], rtol=1e-12)


def test_a_point_without_acceleration_is_taken_out_to_rounding():
    weight = hann_weights(TIMES.is_sample)
    motion = MOTION * [1.0, 1.0, 0.0]
    samples = 2.0j * replica(RAMPS, TIMES, motion=motion[0], time=0.0)[None]
    phases = beat_phase(RAMPS, TIMES, motion=motion, time=0.0)
    _, residual = fit_amplitudes(samples, weight, phases, TIMES.rate)
    assert np.abs(residual).max() < 1e-6  # the ridge of fit_amplitudes is 1e-7


def test_the_beat_is_the_mean_slope_of_the_phase():
    """Frequency in the middle of a ramp equals its phase's run over the ramp, by their length."""
    still = MOTION * [1.0, 1.0, 0.0]
    phases = beat_phase(RAMPS, TIMES, motion=still, time=0.0)
    middle = 0.5 * (TIMES.num_samples - 1) / TIMES.rate
    expected = phases[:, :, 1] + phases[:, :, 2] * middle
    beats = beat_frequency(RAMPS, TIMES, distance=still[:, 0], range_rate=still[:, 1], time=0.0)
    assert beats == pytest.approx(expected, rel=1e-9)
