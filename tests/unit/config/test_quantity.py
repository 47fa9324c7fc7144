"""Written quantities are short and read back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from polychirp.config.quantity import write_quantity
from polychirp.errors import InputError
from polychirp.units import Unit

LINEAR = ("Hz", "S/s", "Hz/s", "s", "m", "m/s", "S/m")


@pytest.mark.parametrize(
    ("symbol", "text"),
    [
        ("Hz", "79 GHz"),
        ("Hz", "800 MHz"),
        ("Hz", "0 Hz"),
        ("S/s", "1 MS/s"),
        ("Hz/s", "60 GHz/ms"),
        ("s", "1.5 ms"),
        ("s", "10 us"),
        ("s", "-3 ns"),
        ("m", "1.75 m"),
        ("m/s", "50 km/h"),
        ("rad", "90 deg"),
        ("W", "10 dBm"),
        ("dB", "4.5 dB"),
        ("dB", "-30 dB"),
        ("m^2", "10 m^2"),
        ("ppm", "20 ppm"),
        ("dBc/Hz", "-93 dBc/Hz"),
        ("ppm/s", "0.1 ppm/s"),
        ("S/m", "1.4 S/m"),
    ],
)
def test_what_people_write_is_written_again(symbol, text):
    unit = Unit(symbol)
    assert write_quantity(unit.parse(text), unit) == text


@pytest.mark.parametrize("symbol", LINEAR)
@given(value=st.floats(-1e15, 1e15))
def test_a_written_quantity_reads_back_exactly(symbol, value):
    assert Unit(symbol).parse(write_quantity(value, Unit(symbol))) == value


@given(level=st.floats(-150.0, 150.0))
def test_a_written_level_reads_back_to_its_last_digits(level):
    """A double holds 16 digits; a level of 150 dB turns its last one into 8e-15 of the ratio."""
    ratio = 10.0 ** (level / 10.0)
    assert math.isclose(Unit("dB").parse(write_quantity(ratio, Unit("dB"))), ratio, rel_tol=1e-13)


@pytest.mark.parametrize(("value", "symbol"), [(math.inf, "rad"), (0.0, "dB"), (-1.0, "W")])
def test_what_has_no_text_is_refused(value, symbol):
    with pytest.raises(InputError, match="cannot be written as a value in"):
        write_quantity(value, Unit(symbol))


def test_the_greek_letter_is_read_like_the_micro_sign_that_it_looks_like():
    greek, micro = "\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}"
    assert Unit("s").read(f"200 {greek}s") == Unit("s").read(f"200 {micro}s")
    assert Unit("Hz/s").read(f"60 MHz/{greek}s") == 60e12
