"""Writer of quantities: the shortest text that reads back as the same number."""

import math
from collections.abc import Callable, Iterator
from typing import Final

from polychirp.errors import InputError
from polychirp.units import Unit, to_db


def _level(value: float) -> float:
    return float(to_db(value))


_SPELLINGS: Final[dict[str, dict[str, Callable[[float], float]]]] = {
    "Hz": {"GHz": lambda v: v / 1e9, "MHz": lambda v: v / 1e6, "kHz": lambda v: v / 1e3},
    "S/s": {"MS/s": lambda v: v / 1e6, "kS/s": lambda v: v / 1e3},
    "Hz/s": {"GHz/ms": lambda v: v / 1e12, "MHz/us": lambda v: v / 1e12},
    "s": {"ms": lambda v: v * 1e3, "us": lambda v: v * 1e6, "ns": lambda v: v * 1e9},
    "m": {"mm": lambda v: v * 1e3, "um": lambda v: v * 1e6},
    "m/s": {"km/h": lambda v: v * 3.6},
    "rad": {"deg": math.degrees},
    "rad/s": {"deg/s": math.degrees},
    "W": {"dBm": lambda v: _level(v) + 30.0},
    "dB": {"dB": _level},
    "m^2": {"dBsm": _level},
    "ppm": {"ppm": lambda v: v * 1e6},
    "S/m": {},
    "dB/m": {"dB/m": lambda v: v * 10.0 / math.log(10.0)},
    "dBc/Hz": {"dBc/Hz": _level},
    "ppm/s": {"ppm/s": lambda v: v * 1e6},
}
"""For each unit symbol, its customary units, with the conversion of an SI value to them."""

_NEVER_BARE: Final = {"dB", "dB/m", "dBc/Hz", "ppm", "ppm/s", "W"}
"""Symbols that never follow an SI value: their quantities are written as levels or in ppm."""


def write_quantity(value: float, unit: Unit) -> str:
    """Shortest text of an SI value in its SI unit or a customary one.

    It reads back as exactly ``value`` if there is such a text. Levels in dB do not represent every
    number; then the last of 16 digits may differ. Bounds of the unit are not checked. `InputError`
    is raised if the value is not finite, or has no level in dB.

    >>> write_quantity(79e9, Unit("Hz")), write_quantity(1.5e-3, Unit("s"))
    ('79 GHz', '1.5 ms')
    >>> write_quantity(1000.0, Unit("dB"))
    '30 dB'
    """
    if not math.isfinite(value):
        raise InputError(f"{value} cannot be written as a value in {unit.symbol}")
    exact = [text for text in _spellings(value, unit) if unit.parse(text) == value]
    if exact:
        return min(exact, key=_effort)
    close = min(_spellings(value, unit), key=lambda text: abs(unit.parse(text) - value))
    if not math.isclose(unit.parse(close), value, rel_tol=1e-12):
        raise InputError(f"{value:g} cannot be written as a value in {unit.symbol}")
    return close


def _spellings(value: float, unit: Unit) -> Iterator[str]:
    """Candidate texts; those in the SI unit are first, and so win among equally short ones."""
    scales = dict(_SPELLINGS[unit.symbol])
    if unit.symbol not in _NEVER_BARE:
        scales = {unit.symbol: float, **scales}
    for name, scale in scales.items():
        for digits in (*range(1, 13), 15, 16, 17):
            number = f"{scale(value):.{digits}g}"
            yield f"{_plain(number)} {name}"


def _effort(text: str) -> int:
    """Length of a text, plus 1 for a number below 1: 800 MHz is easier to read than 0.8 GHz."""
    return len(text) + text.lstrip("-").startswith("0.")


def _plain(number: str) -> str:
    """The number without an exponent if it is whole and below 10 000: 1e+02 becomes 100."""
    value = float(number)
    return str(int(value)) if value == int(value) and abs(value) < 1e4 else number
