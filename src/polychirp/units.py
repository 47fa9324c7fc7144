"""Units of study files: text such as ``"79 GHz"`` becomes an SI number.

A field declared ``duration: Seconds`` states its unit once. This annotation documents the field,
reads it from a study file, bounds it, and describes it in the JSON schema. All numbers inside
polychirp are SI, linear and in radians; only this module and `config.quantity` convert them.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from numbers import Real
from typing import Annotated, Any, Final, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polychirp.errors import InputError, short


def need_number(owner: str, name: str, value: object) -> None:
    """Refuse a quantity with its unit, which study files alone can have.

    >>> need_number("a radar", "transmit_power", "12 dBm")
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: a radar needs a number in SI units as transmit_power, not '12 dBm';
    quantities with units are read from study files alone
    """
    if not isinstance(value, Real):
        raise InputError(
            f"{owner} needs a number in SI units as {name}, not {value!r}; quantities with units "
            "are read from study files alone"
        )


def from_db(level: float) -> float:
    """Power ratio of a level in dB; `InputError` is raised for text such as ``"3 dB"``.

    >>> from_db(30.0)
    1000.0
    """
    given: object = level
    if not isinstance(given, Real):
        raise InputError(f"from_db needs a number of dB, not {given!r}; write it like from_db(3.0)")
    return float(10.0 ** (level / 10.0))


def to_db(ratio: ArrayLike) -> NDArray[np.float64]:
    """Level in dB of a power ratio; at least −400 dB, so that zero has a level as well.

    >>> float(to_db(1000.0))
    30.0
    """
    return np.asarray(10.0 * np.log10(np.maximum(np.asarray(ratio, dtype=np.float64), 1e-40)))


_PREFIX: Final = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}


def _scaled(factor: float) -> Callable[[float], float]:
    return lambda value: value * factor


def _prefixed(symbol: str, prefixes: str) -> dict[str, Callable[[float], float]]:
    names = [*prefixes.split(), ""]
    return {f"{name}{symbol}": _scaled(_PREFIX[name]) for name in names}


_READERS: Final[Mapping[str, Mapping[str, Callable[[float], float]]]] = {
    "Hz": _prefixed("Hz", "k M G"),
    "S/s": _prefixed("S/s", "k M G"),
    "Hz/s": {
        **_prefixed("Hz/s", "k M G"),
        "MHz/us": _scaled(1e12),
        "MHz/µs": _scaled(1e12),
        "MHz/ms": _scaled(1e9),
        "GHz/ms": _scaled(1e12),
    },
    "s": _prefixed("s", "n u µ m"),
    "m": {**_prefixed("m", "m u µ k"), "cm": _scaled(1e-2)},
    "m/s": {"m/s": _scaled(1.0), "km/h": _scaled(1 / 3.6)},
    "rad": {"rad": _scaled(1.0), "deg": math.radians, "°": math.radians},
    "rad/s": {"rad/s": _scaled(1.0), "deg/s": math.radians, "°/s": math.radians},
    "W": {**_prefixed("W", "n u µ m"), "dBm": lambda v: from_db(v - 30.0), "dBW": from_db},
    "dB": {"dB": from_db, "dBi": from_db},
    "m^2": {"m^2": _scaled(1.0), "m2": _scaled(1.0), "dBsm": from_db},
    "ppm": {"ppm": _scaled(1e-6), "ppb": _scaled(1e-9)},
    "S/m": {"S/m": _scaled(1.0)},
    "dB/m": {"dB/m": _scaled(math.log(10.0) / 10.0)},
    "dBc/Hz": {"dBc/Hz": from_db},
    "ppm/s": {"ppm/s": _scaled(1e-6), "ppb/s": _scaled(1e-9)},
}
"""Units that a study file may use for each `Unit.symbol`, and functions from their values to SI."""

_EXAMPLE: Final = {
    "Hz": "79 GHz",
    "S/s": "1 MS/s",
    "Hz/s": "60 MHz/us",
    "s": "1.5 ms",
    "m": "0.5 m",
    "m/s": "50 km/h",
    "rad": "30 deg",
    "rad/s": "20 deg/s",
    "W": "10 dBm",
    "dB": "4.5 dB",
    "m^2": "10 dBsm",
    "ppm": "20 ppm",
    "S/m": "1.4 S/m",
    "dB/m": "0.4 dB/m",
    "dBc/Hz": "-93 dBc/Hz",
    "ppm/s": "0.1 ppm/s",
}

_PLAUSIBLE: Final[Mapping[str, tuple[str, str]]] = {
    "Hz": ("-1000 GHz", "1000 GHz"),
    "S/s": ("-1000 GS/s", "1000 GS/s"),
    "Hz/s": ("-1e6 MHz/us", "1e6 MHz/us"),
    "s": ("-1000 s", "1000 s"),
    "m": ("-1000 km", "1000 km"),
    "m/s": ("-300 m/s", "300 m/s"),
    "rad": ("-3600 deg", "3600 deg"),
    "rad/s": ("-360 deg/s", "360 deg/s"),
    "W": ("0 W", "90 dBm"),
    "dB": ("-300 dB", "300 dB"),
    "m^2": ("0 m^2", "100 dBsm"),
    "ppm": ("-1e6 ppm", "1e6 ppm"),
    "S/m": ("0 S/m", "1e9 S/m"),
    "dB/m": ("0 dB/m", "1e6 dB/m"),
    "dBc/Hz": ("-300 dBc/Hz", "100 dBc/Hz"),
    "ppm/s": ("-1e6 ppm/s", "1e6 ppm/s"),
}
"""Least and greatest plausible value in each unit. They are chosen wide, so that they refuse
mistakes of the unit and numbers that overflow, but no unusual radar. A field may have narrower
bounds (`Unit`)."""

_QUANTITY: Final = re.compile(r"^\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S.*?)\s*$")

_LONGEST_TEXT: Final = 100
"""Most characters of a quantity's text; longer text is refused without being parsed (chosen)."""


@dataclass(frozen=True, slots=True)
class Unit:
    """The unit of a field, the reader of its text, and the bounds of its plausible values.

    Parameters
    ----------
    symbol : SI unit; for ratios the unit of their text, such as dB or ppm, while values are linear
    least, greatest : bounds as a study file writes them; where none is given, those that are
        plausible for any field of this unit

    Examples
    --------
    >>> Unit("Hz").read("79 GHz")
    79000000000.0
    >>> Unit("Hz").read("79 ms")
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: '79 ms' is not a value in Hz; write it like '79 GHz'
    >>> Unit("m", least="0 m", greatest="100 m").read("3 km")
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: '3 km' is outside of 0 m to 100 m; give a value between them
    """

    symbol: str
    least: str = ""
    greatest: str = ""

    @property
    def example(self) -> str:
        """A value as a study file writes it."""
        return _EXAMPLE[self.symbol]

    @property
    def bounds(self) -> tuple[str, str]:
        """Least and greatest plausible value, as a study file writes them."""
        least, greatest = _PLAUSIBLE[self.symbol]
        return self.least or least, self.greatest or greatest

    def read(self, text: object) -> float:
        """SI value of ``text``.

        `InputError` is raised if the text is a bare number, has another dimension, or lies outside
        of the bounds.
        """
        value = self.parse(text)
        least, greatest = self.bounds
        if not self.parse(least) <= value <= self.parse(greatest):
            raise InputError(
                f"'{text}' is outside of {least} to {greatest}; give a value between them"
            )
        return value

    def parse(self, text: object) -> float:
        """SI value of ``text``, even out of bounds; raises `InputError` if it is no quantity."""
        if isinstance(text, bool) or not isinstance(text, str):
            raise InputError(f"{short(repr(text))} needs a unit; write it like '{self.example}'")
        # the Greek letter looks like the micro sign, which the readers have
        usual = text.replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
        match = _QUANTITY.match(usual) if len(text) <= _LONGEST_TEXT else None
        reader = _READERS[self.symbol].get(match[2]) if match else None
        if match is None or reader is None:
            raise InputError(
                f"'{short(text)}' is not a value in {self.symbol}; write it like '{self.example}'"
            )
        try:
            value = reader(float(match[1]))
        except OverflowError:  # levels are powers of ten
            value = math.inf
        if not math.isfinite(value):
            raise InputError(f"'{text}' is too large to be a number")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> dict[str, Any]:
        """Read text before the number is checked (pydantic's hook, a plain dictionary)."""
        return {
            "type": "function-before",
            "function": {"type": "no-info", "function": self.read},
            "schema": handler(source),
        }

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """Unit, bounds and an example for editors; JSON schema cannot bound values in text."""
        del core, handler
        least, greatest = self.bounds
        return {
            "type": "string",
            "x-unit": self.symbol,
            "x-minimum": least,
            "x-maximum": greatest,
            "examples": [self.example],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Between:
    """Bounds of a number without a unit, such as a count.

    >>> Between(greatest=10).checked(11)
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: 11 is too large; use at most 10
    """

    least: float = -math.inf
    greatest: float

    def checked(self, value: float) -> float:
        """The value itself; raises `InputError` if it lies outside of the bounds."""
        # whole numbers may be too large for `math.isnan`
        if isinstance(value, float) and math.isnan(value):
            raise InputError("is not a number; write one")
        if value > self.greatest:
            raise InputError(f"{_written(value)} is too large; use at most {self.greatest}")
        if not value >= self.least:
            raise InputError(f"{_written(value)} is too small; use at least {self.least}")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> dict[str, Any]:
        """Check the value after it was read as a number (pydantic's hook, a plain dictionary)."""
        return {
            "type": "function-after",
            "function": {"type": "no-info", "function": self.checked},
            "schema": handler(source),
        }

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """The number's own schema with its bounds."""
        least = {} if math.isinf(self.least) else {"minimum": self.least}
        return {**handler(core), **least, "maximum": self.greatest}


def _written(value: float) -> str:
    """A number as text; of huge integers, which Python refuses to write, the number of bits."""
    if isinstance(value, int) and value.bit_length() > 128:
        return f"a number of {value.bit_length()} bits"
    return f"{value}"


def need_numbers(spec: Any, owner: str) -> None:
    """Refuse a dataclass with a quantity that is no number, such as text with its unit."""
    kind: Any = type(spec)
    for name in _quantities(kind):
        need_number(owner, name, getattr(spec, name))


@cache
def _quantities(kind: type) -> tuple[str, ...]:
    """Names of the fields that are one number with a unit."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple(
        name
        for name, hint in hints.items()
        if get_origin(hint) is Annotated and any(isinstance(note, Unit) for note in get_args(hint))
    )


Hertz = Annotated[float, Unit("Hz")]
HertzPerSecond = Annotated[float, Unit("Hz/s")]
SamplesPerSecond = Annotated[float, Unit("S/s")]
Seconds = Annotated[float, Unit("s")]
Metres = Annotated[float, Unit("m")]
MetresPerSecond = Annotated[float, Unit("m/s")]
Radians = Annotated[float, Unit("rad")]
RadiansPerSecond = Annotated[float, Unit("rad/s")]
Watts = Annotated[float, Unit("W")]
Ratio = Annotated[float, Unit("dB")]
"""A linear power ratio; study files write it in dB."""
SquareMetres = Annotated[float, Unit("m^2")]
Fraction = Annotated[float, Unit("ppm")]
"""A small relative deviation; study files write it in ppm."""
SiemensPerMetre = Annotated[float, Unit("S/m")]
PerMetre = Annotated[float, Unit("dB/m")]
"""Attenuation of power, α in e^{−αx}; study files write it in dB/m."""
PerHertz = Annotated[float, Unit("dBc/Hz")]
"""Noise in a band of 1 Hz relative to its carrier, 1/Hz; study files write it in dBc/Hz."""
FractionPerSecond = Annotated[float, Unit("ppm/s")]
"""Growth of a small relative deviation, 1/s; study files write it in ppm/s."""
