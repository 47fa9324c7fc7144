"""Cost of a frame: counted by hand on small frames."""

from dataclasses import replace

import pytest

from polychirp.model.antenna import AntennaArray
from polychirp.model.radar import Converter
from polychirp.receiver.selection import AutoReceiver
from polychirp.study.processing_cost import processing_cost
from polychirp.study.spec import Study, StudyRadar
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import DiverseSawtooth, Sawtooth

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
