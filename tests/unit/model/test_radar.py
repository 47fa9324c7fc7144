"""A radar that Python code makes has numbers in SI units."""

import pytest

from polychirp.errors import InputError
from polychirp.model.radar import Converter, Radar
from polychirp.study.spec import StudyRadar
from polychirp.units import from_db
from polychirp.waveform import Sawtooth


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Radar(name="front", transmit_power="12 dBm"), "radar 'front' .* transmit_power"),
        (lambda: Radar(name="front", noise_figure="11 dB"), "radar 'front' .* noise_figure"),
        (lambda: Converter(sample_rate="1 MS/s"), "a converter .* sample_rate"),
        (
            lambda: StudyRadar(name="f", vehicle="ego", waveform=Sawtooth(), start_time="1 ms"),
            "radar 'f' .* start_time",
        ),
        (lambda: Sawtooth(bandwidth="300 MHz"), "a sawtooth .* bandwidth"),
    ],
)
def test_text_with_a_unit_is_refused_in_one_sentence(make, name):
    kind, _, field = name.partition(" .* ")
    said = f"{kind} needs a number in SI units as {field}, not '.*'; quantities with units are read"
    with pytest.raises(InputError, match=said):
        make()


def test_a_level_in_db_is_a_number():
    with pytest.raises(InputError, match=r"needs a number of dB, not '3 dB'; write it like"):
        from_db("3 dB")
