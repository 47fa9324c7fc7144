"""Changes to a study by dotted paths: ``a.b.0.c=value`` from the command line, and in grids."""

import re
import tomllib
from copy import deepcopy
from typing import Any, Final

from polychirp.bounded_text import MOST_LEVELS, toml_tables
from polychirp.errors import InputError, short, suggestion

LONGEST_PATH: Final = 1000
"""Greatest number of characters in a path. Chosen: paths to keys of a study are far shorter."""

_EXAMPLES: Final = {
    r"\{.*": '{kind="blanking"}',
    r"\[.*,.*\]": '["1 ms", "2 ms"]',
}
"""Values of TOML by the form of a text that is meant as one; names may begin with a bracket."""


def apply_override(data: dict[str, Any], change: str) -> None:
    """Set one value of a study's tables, in place, as ``path=value`` says; see `set_value`.

    The value is read as TOML if it is TOML, and as text otherwise, because shells remove quotes.
    `InputError` is raised if the change has no '=' or an empty key, its value looks like a list or
    a table of TOML but is none, or `set_value` refuses its path.

    >>> data = {"radars": [{"name": "front"}]}
    >>> apply_override(data, "radars.0.converter.sample_rate=2 MS/s")
    >>> data["radars"][0]["converter"]
    {'sample_rate': '2 MS/s'}
    """
    path, equals, text = change.partition("=")
    if not equals or not all(key.strip() for key in path.split(".")):
        raise InputError(f"'{change}' is not PATH=VALUE; write it like 'radars.0.start_time=1 ms'")
    try:
        value = read_value(text)
    except InputError as error:
        raise InputError(f"{path.strip()}: {error}") from None
    set_value(data, path, value)


def set_value(data: dict[str, Any], path: str, value: Any) -> None:
    """Set one value of a study's tables, in place.

    A key selects an entry of a list by its number, counted from 0, or by its name; ``*`` selects
    all entries. Tables on the path that are missing are added; entries of lists are not.
    `InputError` is raised if the path is malformed, names a missing entry, or leads through a plain
    value.

    >>> data = {"radars": [{"name": "front"}, {"name": "rear"}]}
    >>> set_value(data, "radars.*.start_time", "1 ms")
    >>> [radar["start_time"] for radar in data["radars"]]
    ['1 ms', '1 ms']
    """
    _set(data, _keys(path), value, place=[])


def _keys(path: str) -> list[str]:
    """Keys of a dotted path."""
    keys = [key.strip() for key in path.split(".", MOST_LEVELS)]
    # `str.isdigit` accepts characters such as '²', which `int` refuses
    is_odd = any(key.isdigit() and not key.isdecimal() for key in keys)
    if not all(keys) or is_odd or len(keys) > MOST_LEVELS or len(path) > LONGEST_PATH:
        raise InputError(
            f"'{short(path)}' is not a path of keys; write it like 'radars.0.start_time'"
        )
    return keys


def _set(here: Any, keys: list[str], value: Any, *, place: list[str]) -> None:
    key, *rest = keys
    if key == "*":
        if not isinstance(here, list):
            where = ".".join(place) or "the study"
            raise InputError(f"{where} is not a list; '*' stands for every entry of a list")
        for number in range(len(here)):
            _set(here, [str(number), *rest], value, place=place)
    elif rest:
        _set(_enter(here, key, place=[*place, key]), rest, value, place=[*place, key])
    else:
        _assign(here, key, deepcopy(value), place=[*place, key])


def read_value(text: str) -> Any:
    """Value of ``text``: what it means as TOML, or the text itself if it is not TOML.

    `InputError` is raised if the text looks like a list or a table of TOML, but is none.

    >>> read_value("3"), read_value("79 GHz"), read_value('["1 ms", "2 ms"]')
    (3, '79 GHz', ['1 ms', '2 ms'])
    """
    try:
        table = toml_tables(f"value = {text}")
    except tomllib.TOMLDecodeError as error:
        text = text.strip()
        forms = (example for form, example in _EXAMPLES.items() if re.fullmatch(form, text))
        example = next(forms, None)
        if example is None:
            return text
        reason = str(error).partition(" (at ")[0]
        raise InputError(
            f"'{short(text)}' is not TOML ({reason[:1].lower()}{reason[1:]}); text in it stands in "
            f"quotes, as in {example}, and single quotes around the whole change keep these"
        ) from None
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
    """Number of the entry that ``key`` selects by its number or by its name."""
    if key.isdigit() and int(key) < len(entries):
        return int(key)
    names = [str(entry.get("name", "")) for entry in entries if isinstance(entry, dict)]
    if names.count(key) == 1 and len(names) == len(entries):
        return names.index(key)
    known = [name for name in names if name]
    named = f": {', '.join(known)}" if known else ""
    close = suggestion(key, known)
    raise InputError(
        f"{'.'.join(place)} does not exist; {'.'.join(place[:-1])} has {len(entries)} entries, "
        f"counted from 0{named}{f'; {close}' if close else ''}"
    )
