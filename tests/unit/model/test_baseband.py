"""Samples about a carrier: between them, at other rates, about other carriers."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.baseband import Baseband, SampleSource

RATE = 100e6


def burst(frequency, *, rate=RATE, duration=20e-6, centre=1e9):
    """A tone under a Gaussian, which has no ends and no side lobes."""
    time = np.arange(round(duration * rate)) / rate
    return Baseband(
        samples=tone(frequency, time, duration), sample_rate=rate, centre_frequency=centre
    )


def tone(frequency, time, duration=20e-6):
    bell = np.exp(-0.5 * ((time - 0.5 * duration) / (0.05 * duration)) ** 2)
    return bell * np.exp(2j * np.pi * frequency * time)


@pytest.mark.parametrize("frequency", [0.0, -20e6, 45e6])
def test_between_samples_is_what_was_sampled(frequency):
    """To 1e-6, up to nine tenths of half the rate."""
    time = np.random.default_rng(1).uniform(0, 20e-6, 500)
    np.testing.assert_allclose(burst(frequency).at(time), tone(frequency, time), atol=2e-6)


def test_outside_its_samples_a_signal_is_zero():
    assert np.abs(burst(1e6).at(np.array([-1e-3, 1e-3]))).max() == 0.0


@pytest.mark.parametrize("rate", [130e6, 75e6, 61.44e6])
def test_another_rate_gives_the_same_signal(rate):
    there = burst(20e6).resampled(rate)
    assert there.sample_rate == rate
    np.testing.assert_allclose(there.samples, tone(20e6, there.time), atol=2e-6)


def test_a_lower_rate_does_not_fold():
    """A tone at 40 MHz is not there at 60 MS/s, where it would appear at −20 MHz."""
    assert np.abs(burst(40e6).resampled(60e6).samples).max() < 1e-6


def test_another_carrier_turns_the_samples():
    turned = burst(20e6).retuned(1.015e9)
    assert turned.centre_frequency == 1.015e9
    np.testing.assert_allclose(turned.samples, tone(5e6, turned.time), atol=1e-9)


def test_power_and_energy_are_those_of_the_samples():
    signal = Baseband(samples=np.array([3.0, 4j]), sample_rate=10.0)
    assert (signal.power, signal.energy, signal.duration) == (12.5, pytest.approx(2.5), 0.2)


def test_a_signal_in_memory_is_a_source_of_samples():
    source = burst(1e6)
    assert isinstance(source, SampleSource)
    assert (source.num_samples, source.sample_rate, source.centre_frequency) == (2000, RATE, 1e9)
    np.testing.assert_array_equal(source.read(5, 9), burst(1e6).samples[5:9])


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"samples": np.zeros(0), "sample_rate": 1.0}, "needs at least one sample"),
        ({"samples": np.zeros(2), "sample_rate": 0.0}, "sample rate must be positive"),
        ({"samples": np.zeros((2, 2)), "sample_rate": 1.0}, "has 2 axes"),
    ],
)
def test_what_is_no_signal_is_refused(fields, sentence):
    with pytest.raises(InputError, match=sentence):
        Baseband(**fields)
