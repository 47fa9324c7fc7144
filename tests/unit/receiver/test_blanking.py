"""Blanking before the range transform."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.mitigation.blanking import Blanking
from polychirp.rng import Streams
from polychirp.testing.points import HandPoint, frame_of
from polychirp.waveform import Triangular

RAMPS = Triangular().schedule(num_sweeps=1, streams=Streams(1))
ECHO = HandPoint(range=9.0, power=1e4)


def test_echoes_alone_are_not_touched():
    """A steady echo has one amplitude; noise 40 dB below never triples it."""
    frame = frame_of(RAMPS, [ECHO])
    assert not Blanking().hit(frame).any()
    assert np.array_equal(Blanking().apply(frame).samples, frame.samples)


def test_a_burst_goes_with_its_neighbours_and_nothing_else():
    frame = frame_of(RAMPS, [ECHO])
    samples = frame.samples.copy()
    samples[:, 1, 500:504] += 1e4
    cleaned = Blanking(guard=8e-6).apply(frame.with_samples(samples))
    zeroed = np.all(cleaned.samples == 0.0, axis=0) & frame.times.is_sample
    assert np.flatnonzero(zeroed[1]).tolist() == list(range(492, 512))
    assert not zeroed[0].any()
    assert np.array_equal(cleaned.samples[:, 0], frame.samples[:, 0])


def test_an_interferer_that_fills_the_ramp_is_not_touched():
    """A synchronous ghost looks like an echo: no blanking can tell."""
    frame = frame_of(RAMPS, [ECHO, HandPoint(range=6.6, power=1e7)])
    assert not Blanking().hit(frame).any()


def test_a_factor_of_one_is_refused():
    with pytest.raises(InputError, match="factor"):
        Blanking(factor=1.0)
