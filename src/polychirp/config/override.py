"""Changes to a study by dotted paths: ``a.b.0.c=value`` from the command line, and in grids."""

import tomllib
from copy import deepcopy
from typing import Any, Final

from polychirp.bounded_text import MOST_LEVELS, toml_tables
from polychirp.errors import InputError, did_you_mean

LONGEST_PATH: Final = 1000
"""Greatest number of characters in a path; paths to keys of a study are far shorter."""


def apply_override(data: dict[str, Any], change: str) -> None:
    """Set one value of a study's tables, in place, as ``path=value`` says; see `set_value`.

    The value is TOML where it can be read so, and text otherwise, because shells take quotes
    away.

    Raises
    ------
    InputError
        The change has no '=', or leads through something that is no table or list.

    Examples
    --------
    >>> data = {"radars": [{"name": "front"}]}
    >>> apply_override(data, "radars.0.converter.sample_rate=2 MS/s")
    >>> data["radars"][0]["converter"]
    {'sample_rate': '2 MS/s'}
    """
    path, equals, text = change.partition("=")
    if not equals or not all(key.strip() for key in path.split(".")):
        raise InputError(f"'{change}' changes nothing; write it like 'radars.0.start_time=1 ms'")
    set_value(data, path, read_value(text))


def set_value(data: dict[str, Any], path: str, value: Any) -> None:
    """Set one value of a study's tables, in place.

    Entries of a list go by their number, counted from 0, or by their name; ``*`` stands for all.

    Tables on the way are made where they are missing; entries of lists are not.

    Raises
    ------
    InputError
        The path leads through something that is no table or list.

    Examples
    --------
    >>> data = {"radars": [{"name": "front"}, {"name": "rear"}]}
    >>> set_value(data, "radars.*.start_time", "1 ms")
    >>> [radar["start_time"] for radar in data["radars"]]
    ['1 ms', '1 ms']
    """
    _set(data, _keys(path), value, place=[])


def _keys(path: str) -> list[str]:
    """Keys of a dotted path."""
    keys = [key.strip() for key in path.split(".", MOST_LEVELS)]
    # such as '²', a digit in which no number is written
    is_odd = any(key.isdigit() and not key.isdecimal() for key in keys)
    if not all(keys) or is_odd or len(keys) > MOST_LEVELS or len(path) > LONGEST_PATH:
        shown = path if len(path) <= 40 else f"{path[:37]}…"
        raise InputError(f"'{shown}' is no path; write it like 'radars.0.start_time'")
    return keys


def _set(here: Any, keys: list[str], value: Any, *, place: list[str]) -> None:
    key, *rest = keys
    if key == "*":
        if not isinstance(here, list):
            where = ".".join(place) or "the study"
            raise InputError(f"{where} is no list; '*' stands for every entry of one")
        for number in range(len(here)):
            _set(here, [str(number), *rest], value, place=place)
    elif rest:
        _set(_enter(here, key, place=[*place, key]), rest, value, place=[*place, key])
    else:
        _assign(here, key, deepcopy(value), place=[*place, key])


def read_value(text: str) -> Any:
    """Value of ``text``: TOML if it can be read as such, else the text itself.

    >>> read_value("3"), read_value("79 GHz"), read_value('["1 ms", "2 ms"]')
    (3, '79 GHz', ['1 ms', '2 ms'])
    """
    try:
        table = toml_tables(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text.strip()
    return table["value"] if table.keys() == {"value"} else text.strip()


def _enter(here: Any, key: str, *, place: list[str]) -> Any:
    if isinstance(here, list):
        return here[_index(here, key, place=place)]
    if not isinstance(here, dict):
        raise InputError(f"{'.'.join(place[:-1])} is a value; it has no '{key}'")
    return here.setdefault(key, {})


def _assign(here: Any, key: str, value: Any, *, place: list[str]) -> None:
    if isinstance(here, list):
        here[_index(here, key, place=place)] = value
    elif isinstance(here, dict):
        here[key] = value
    else:
        raise InputError(f"{'.'.join(place[:-1])} is a value; it has no '{key}'")


def _index(entries: list[Any], key: str, *, place: list[str]) -> int:
    """Number of the entry that ``key`` means: itself, or the entry of that name."""
    if key.isdigit() and int(key) < len(entries):
        return int(key)
    names = [str(entry.get("name", "")) for entry in entries if isinstance(entry, dict)]
    if names.count(key) == 1 and len(names) == len(entries):
        return names.index(key)
    known = [name for name in names if name]
    named = f": {', '.join(known)}; {did_you_mean(key, known)}" if known else ""
    raise InputError(
        f"{'.'.join(place)} does not exist; {'.'.join(place[:-1])} has {len(entries)} entries, "
        f"counted from 0{named}"
    )
