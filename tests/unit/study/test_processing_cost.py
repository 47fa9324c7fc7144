"""Cost of a frame: counted by hand on small frames."""

from dataclasses import replace

import pytest

from polychirp.model.antenna import AntennaArray
from polychirp.model.radar import Converter
from polychirp.receiver.selection import AutoReceiver
from polychirp.study.processing_cost import processing_cost
from polychirp.study.spec import Study, StudyRadar
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import DiverseSawtooth, Mfsk, Noise, PhaseCodedRamp, Pmcw, Sawtooth

CHIRPS = Sawtooth(bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)


def study(waveform):
    radar = StudyRadar(
        name="front",
        vehicle="car",
        waveform=waveform,
        array=AntennaArray(num_channels=2),
        converter=Converter(sample_rate=12.75e6, start=0.0, margin=0.0),
    )
    street = Street(vehicles=(Vehicle(name="car", x=0.0, y=0.0),))
    return Study(name="one", num_sweeps=64, street=street, radars=(radar,))


def test_two_transforms_of_64_chirps_of_256_samples():
    """64·128·8 + 256·32·6 + 2·64·256 in each of two channels; samples and spectra of 8 bytes."""
    cost = processing_cost(study(CHIRPS))
    assert cost.receiver == "range-doppler"
    assert cost.multiplications == 2 * (64 * 128 * 8 + 256 * 32 * 6 + 2 * 64 * 256)
    assert cost.memory == 2 * 8 * 2 * 64 * 256
    assert cost.peak_to_average == 1.0
    assert cost.duty == pytest.approx(64 * 20 / (64 * 25 - 5))


def test_a_code_is_removed_before_the_two_transforms():
    """Four transforms of 256 samples on a chirp, with three products; one of each on a carrier."""
    after = 64 * 128 * 8 + 256 * 32 * 6 + 2 * 64 * 256
    chirps = PhaseCodedRamp(bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)
    cost = processing_cost(study(chirps))
    assert cost.receiver == "decoding"
    assert cost.multiplications == 2 * (after + 64 * (4 * 128 * 8 + 3 * 256))
    carrier = Pmcw(order=7, chip_duration=20e-6 / 254, periods=2, idle=5e-6)
    cost = processing_cost(study(carrier))
    assert cost.multiplications == 2 * (after + 64 * (128 * 8 + 256))
    assert cost.peak_to_average == pytest.approx(1.0)


def test_steps_have_a_window_and_two_transforms():
    """256 sums of samples and windows, 2·64·7 of each sequence of 128 in two channels."""
    one = study(Mfsk(bandwidth=300e6, num_steps=128, step_duration=10e-6))
    cost = processing_cost(replace(one, num_sweeps=1))
    assert cost.receiver == "mfsk"
    assert cost.multiplications == 2 * (256 + 2 * 64 * 7)
    assert cost.memory == 8 * (2 * 256 * 128 + 2 * 256)


def test_noise_has_a_peak_8_db_above_its_mean_power():
    noise = Noise(bandwidth=5e6, chip_duration=0.1e-6, num_chips=64, periods=3)
    assert processing_cost(study(noise)).peak_to_average == pytest.approx(10.0**0.8, rel=0.01)


def test_a_map_of_chirps_that_differ_takes_a_multiplication_for_each_ramp_and_cell():
    """With all chirps alike, the cells are those of the band and of the frame's duration."""
    drawn = DiverseSawtooth(bandwidth=(300e6, 300e6), ramp_duration=20e-6, idle=(5e-6, 5.1e-6))
    one = replace(study(drawn), receiver=AutoReceiver(greatest_range=30.0, greatest_speed=20.0))
    cost = processing_cost(one)
    assert cost.receiver == "coherent"
    ranges = 29.5 / (299792458.0 / 600e6)
    span = 64 * 25.05e-6 - 5e-6
    rates = 40.0 / (299792458.0 / 76.65e9 / (2 * span))
    expected = 2 * (64 * 128 * 8 + 64 * ranges * rates)
    assert cost.multiplications == pytest.approx(expected, rel=2e-3)
