"""Reader and template of the TOML file that describes a recording."""

import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import MISSING, fields, replace
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin, get_type_hints

from polychirp.bounded_text import text_of, toml_tables
from polychirp.capture.parameters import CaptureParameters
from polychirp.errors import InputError, did_you_mean, short, suggestion
from polychirp.units import Between, Unit

TEMPLATE: Final = """\
# Parameters of a recording; this file has the name of the recording and stands beside it.
# Values carry their unit, as in study files. Lines that begin with '#' show the default.

# the ramps: each waits for idle_time, then rises for ramp_end_time
start_frequency = "77 GHz"      # at the start of the rise
slope = "30 MHz/us"
idle_time = "10 us"
ramp_end_time = "40 us"
adc_start = "6 us"              # time of the first sample, from the start of the rise
num_ramps = 128                 # number in a frame, for all transmitters together

# the converter
sample_rate = "10 MS/s"
num_samples = 256               # samples of a ramp
#sampling = "complex"           # or "real"
#highest_beat = "9 MHz"         # edge of the pass band; default: 0.9 of sample_rate (real: 0.45)
#adc_bits = 16                  # bits of a converted sample; or 14 or 12
#full_scale = 32768.0           # stored value of 0 dBFS; default: 2 to the power (adc_bits - 1)

# the antennas: transmitters take turns ramp by ramp; the distance from one to the next is the
# length of the receiving array
num_transmitters = 2
num_receivers = 4
#spacing = "1.95 mm"            # of receiving elements; default: half a wavelength
# places to the left and up, in multiples of spacing and seen from behind the radar, of elements
# that are not on these lines, as in [[0, 0], [2, 1]]
#channel_positions = []         # of receivers
#transmitter_positions = []
#first_receiver = "right"       # side of receiver 0, seen from behind the radar; or "left"

# the file
#num_frames = 1                 # frames that the recording should have; default: not checked
#conjugate = false              # true if targets beat at negative frequencies, or I and Q swap
# for raw files (.bin): "xwr14xx" (and xWR12xx), "xwr16xx", "xwr18xx" or "xwr68xx"
#device = "xwr16xx"
#enabled_receivers = []         # numbers of receivers, as [2, 3]; default: the first num_receivers
# for NumPy and Zarr: names of the array's axes, the slowest first. They are frame, fast (samples
#   of a ramp), sweep (one ramp of every transmitter), transmitter and receiver; two of them may be
#   one axis: ramp (sweep and transmitter) or channel (transmitter and receiver)
#axes = ["frame", "ramp", "receiver", "fast"]
#stored_as = "signed"           # "unsigned" if int16 samples were saved as if they were uint16
"""
"""Parameter file with examples and defaults, which ``polychirp process --describe`` prints."""


def read_parameters(path: Path | str) -> CaptureParameters:
    """Parameters of a recording from a TOML file.

    `InputError` is raised if the file cannot be read or is not TOML, or a key is unknown, missing
    or has a wrong value. It names the place of every problem, as in "walk.toml: slope: …".
    """
    path = Path(path)
    try:
        data = toml_tables(text_of(path))
    except FileNotFoundError:
        raise InputError(
            f"there is no parameter file '{path}'; name another one with --params, or begin with "
            "the example that 'polychirp process --describe' prints"
        ) from None
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(
            f"{path.name}: is not text in UTF-8; a parameter file is TOML text"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path.name}: is not TOML: {error}") from None
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    return parameters_from(data, name=path.name)


def parameters_from(data: dict[str, Any], *, name: str) -> CaptureParameters:
    """Parameters from the keys and values of a TOML file called ``name``.

    `InputError` is raised if a key is unknown, missing or has a wrong value.

    >>> parameters_from({"slope": 3e13}, name="walk.toml")
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: walk.toml: slope: 30000000000000.0 needs a unit; write it like
    '60 MHz/us'
    walk.toml: start_frequency: is missing; give it, as in "79 GHz"
    ...
    """
    values = _values(data, name=name, problems=_missing(data))
    try:
        return CaptureParameters(**values)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def with_values(
    parameters: CaptureParameters, values: dict[str, Any], *, name: str
) -> CaptureParameters:
    """Parameters with other values of some keys, written as in a file; ``name`` is their source.

    `InputError` is raised as by `parameters_from`.
    """
    given = _values(values, name=name)
    try:
        return replace(parameters, **given)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def _values(data: dict[str, Any], *, name: str, problems: Iterable[str] = ()) -> dict[str, Any]:
    """Values of keys by the types of their fields; `InputError` names all problems of the file."""
    values: dict[str, Any] = {}
    found: list[str] = []
    is_listed = False
    hints = get_type_hints(CaptureParameters, include_extras=True)
    hints = {one.name: hints[one.name] for one in fields(CaptureParameters)}
    for key, value in data.items():
        try:
            if key not in hints:
                hint = suggestion(key, hints)
                if not is_listed:
                    # a file of another kind has many unknown keys; the known are listed once
                    hint, is_listed = did_you_mean(key, hints), True
                raise InputError(f"unknown key; {hint}" if hint else "unknown key")
            values[key] = _read(hints[key], value)
        except InputError as error:
            found.append(f"{key}: {error}")
    found += problems
    if found:
        raise InputError("\n".join(f"{name}: {problem}" for problem in found))
    return values


def _missing(data: dict[str, Any]) -> Iterator[str]:
    """Problem of every key that is not in the file and has no default."""
    hints = get_type_hints(CaptureParameters, include_extras=True)
    for field in fields(CaptureParameters):
        if field.default is MISSING and field.name not in data:
            unit = _unit(hints[field.name])
            example = f', as in "{unit.example}"' if unit is not None else ""
            yield f"{field.name}: is missing; give it{example}"


def _read(hint: Any, value: object) -> Any:
    """A file's value as the type ``hint`` of its field; raises `InputError` if it does not fit."""
    unit = _unit(hint)
    if unit is not None:
        return unit.read(value)
    kind = next(member for member in _members(hint) if member is not type(None))
    if get_origin(kind) is Annotated:
        plain, *notes = get_args(kind)
        number = _read_plain(plain, value)
        for note in notes:
            if isinstance(note, Between) and isinstance(number, int | float):
                note.checked(number)
        return number
    if get_origin(kind) is tuple:
        if not isinstance(value, list):
            raise InputError(f"must be a list in square brackets, not {short(repr(value))}")
        return tuple(_read(get_args(kind)[0], entry) for entry in value)
    if get_origin(kind) is Literal:
        if not isinstance(value, str) or value not in get_args(kind):
            hint_text = did_you_mean(str(value), get_args(kind))
            raise InputError(f"{short(repr(value))} is not one of its values; {hint_text}")
        return value
    return _read_plain(kind, value)


def _read_plain(kind: Any, value: object) -> object:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if kind is bool and not isinstance(value, bool):
        raise InputError(f"must be true or false, not {short(repr(value))}")
    if kind is int and not (is_number and isinstance(value, int)):
        raise InputError(f"must be a whole number, not {short(repr(value))}")
    if kind is float and not is_number:
        raise InputError(f"must be a number, not {short(repr(value))}")
    return value


def _members(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)


def _unit(hint: Any) -> Unit | None:
    """Unit in a field's type; None if it has none."""
    for member in _members(hint):
        for note in getattr(member, "__metadata__", ()):
            if isinstance(note, Unit):
                return note
    return None
