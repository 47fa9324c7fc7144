"""Alignment of recordings with their reference."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.correlation.alignment import aligned, at_baseband, comparable
from polychirp.correlation.base import correlate
from polychirp.correlation.lobes import lobes
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband
from polychirp.rng import Streams
from polychirp.waveform import Sawtooth, Triangular
from polychirp.waveform.playing import played

RATE = 130e6


def triangle():
    wave = Triangular(start_frequency=3.96e9, bandwidth=80e6, ramp_duration=50e-6)
    plan = wave.schedule(num_sweeps=1, streams=Streams(seed=1))
    return played(plan, sample_rate=RATE, centre_frequency=4e9)


def late(signal, delay, offset=0.0, *, noise=0.0):
    """A longer recording of the signal, delayed and shifted in frequency."""
    time = np.arange(3 * signal.num_samples) / RATE
    samples = signal.at(time - delay) * np.exp(2j * np.pi * offset * time)
    draw = np.random.default_rng(1).standard_normal((time.size, 2)).view(complex)[:, 0]
    return replace(signal, samples=samples + noise * draw / np.sqrt(2))


@pytest.mark.parametrize("delay", [0.0, 61.3e-6, 61.3e-6 + 3.1e-9])
def test_a_delay_is_found_within_a_fraction_of_a_sample_and_removed(delay):
    """The samples are 7.7 ns apart, and the delay is right to 50 ps."""
    found = aligned(late(triangle(), delay), triangle())
    assert found.delay == pytest.approx(delay, abs=5e-11)
    assert found.signal.num_samples == triangle().num_samples
    assert lobes(correlate(found.signal, triangle())).peak > 0.999


def test_noise_changes_the_delay_by_no_more_than_the_bound():
    """At 0 dB: 1/(2π·23 MHz·√(2·13 000)) = 43 ps rms (Cramér and Rao); here within four of them."""
    found = aligned(late(triangle(), 20e-6, noise=1.0), triangle())
    assert found.delay == pytest.approx(20e-6, abs=4 * 43e-12)


@pytest.mark.parametrize("offset", [7.3e3, -31e3])
def test_a_triangle_separates_a_frequency_offset_from_a_delay(offset):
    """Half a cell is 5 kHz; the parabola finds it to a few percent of that."""
    found = aligned(late(triangle(), 20e-6, offset), triangle(), greatest_offset=40e3)
    assert found.frequency_offset == pytest.approx(offset, abs=500.0)
    assert found.delay == pytest.approx(20e-6, abs=1e-9)
    assert lobes(correlate(found.signal, triangle())).peak > 0.99


def test_an_offset_that_is_not_searched_lowers_the_peak():
    found = aligned(late(triangle(), 20e-6, 31e3), triangle())
    assert lobes(correlate(found.signal, triangle())).peak < 0.8


def test_another_rate_and_carrier_are_converted_to_those_of_the_reference():
    """The same radio signal recorded at 200 MS/s about 4.02 GHz."""
    wave = Triangular(start_frequency=3.96e9, bandwidth=80e6, ramp_duration=50e-6)
    plan = wave.schedule(num_sweeps=1, streams=Streams(seed=1))
    other = played(plan, sample_rate=200e6, centre_frequency=4.02e9)
    back = comparable(other, triangle())
    assert (back.sample_rate, back.centre_frequency) == (RATE, 4e9)
    found = lobes(correlate(back, triangle(), oversampling=8))
    assert found.peak == pytest.approx(1.0, abs=1e-3)
    assert found.lag == pytest.approx(0.0, abs=1e-11)


def test_carriers_without_a_common_band_are_refused():
    far = replace(triangle(), centre_frequency=3.75e9)
    with pytest.raises(InputError, match="the two share no frequency; compare basebands instead"):
        comparable(far, triangle())
    assert at_baseband(far).centre_frequency == 0.0


def test_too_many_shifts_are_refused():
    with pytest.raises(InputError, match="search for less than"):
        aligned(triangle(), triangle(), greatest_offset=1e9)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"sample_rate": 100e6}, "resample one of them"),
        ({"centre_frequency": 1e9}, "retune one of them, or compare basebands"),
        ({"samples": np.zeros(10)}, "a signal has no energy"),
    ],
)
def test_what_cannot_be_compared_is_refused(change, sentence):
    with pytest.raises(InputError, match=sentence):
        correlate(replace(triangle(), **change), triangle())


def test_a_single_ramp_hardly_separates_offset_and_delay():
    """Its ridge: an offset of 100 kHz is a delay of −100 kHz/slope, and costs f/B of the peak."""
    wave = Sawtooth(start_frequency=3.96e9, bandwidth=80e6, ramp_duration=100e-6)
    ramp = played(
        wave.schedule(num_sweeps=1, streams=Streams(seed=1)), sample_rate=RATE, centre_frequency=4e9
    )
    shifted = Baseband(
        samples=ramp.samples * np.exp(2j * np.pi * 100e3 * ramp.time),
        sample_rate=RATE,
        centre_frequency=4e9,
    )
    found = lobes(correlate(shifted, ramp, oversampling=8))
    assert found.lag == pytest.approx(-100e3 / 0.8e12, abs=1e-10)
    assert found.peak == pytest.approx(1 - 100e3 / 80e6, abs=1e-3)
