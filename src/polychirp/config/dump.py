"""Specs as TOML text, from which the same specs can be read."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from pathlib import PurePath
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from polychirp.config.quantity import write_quantity
from polychirp.errors import InputError
from polychirp.units import Unit


def dump(spec: Any) -> str:
    """TOML text of a spec, without values that equal their defaults.

    >>> from polychirp.waveform import DiverseTriangular
    >>> print(dump(DiverseTriangular(ramp_duration=(1e-3, 1.2e-3))))
    kind = "diverse-triangular"
    ramp_duration = ["1 ms", "1.2 ms"]
    """
    return "\n".join(_lines(as_tables(spec), prefix=())).strip()


def as_tables(spec: Any, declared: type | None = None) -> dict[str, Any]:
    """A spec as nested dicts and lists of its values as a study file has them, without defaults.

    Of a spec of a class below ``declared``, such as a point that a trial has drawn, only the fields
    of ``declared`` are written: files know no others.
    """
    declared = declared or type(spec)
    hints = get_type_hints(declared, include_extras=True)
    tables = {}
    for field in fields(declared):
        value = getattr(spec, field.name)
        if field.name == "kind" or (value is not None and value != _default(field)):
            tables[field.name] = written(value, hints[field.name], field.name)
    return tables


def _default(field: Field[Any]) -> Any:
    if field.default is not MISSING:
        return field.default
    return MISSING if field.default_factory is MISSING else field.default_factory()


def written(value: Any, hint: Any, place: str) -> Any:
    """A value of type ``hint`` as a study file has it; error messages name ``place``."""
    if is_dataclass(value):
        return as_tables(value, hint if is_dataclass(hint) and isinstance(hint, type) else None)
    if get_origin(hint) is Annotated:
        inner, *notes = get_args(hint)
        for note in notes:
            if isinstance(note, Unit):
                return _quantity(value, note, place)
        return written(value, inner, place)
    if get_origin(hint) in (Union, UnionType):
        (inner,) = (member for member in get_args(hint) if member is not type(None))
        return written(value, inner, place)
    if isinstance(value, tuple):
        entries = get_args(hint)
        inner = (
            [entries[0]] * len(value)
            if len(entries) == 2 and entries[1] is Ellipsis
            else list(entries)
        )
        return [written(v, h, place) for v, h in zip(value, inner, strict=True)]
    return value.as_posix() if isinstance(value, PurePath) else value


def _quantity(value: float, unit: Unit, place: str) -> str:
    try:
        return write_quantity(value, unit)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None


def _lines(tables: Mapping[str, Any], prefix: tuple[str, ...]) -> Iterator[str]:
    """TOML lines of a table: its values, then its tables, then its lists of tables."""
    for key, value in tables.items():
        if not _is_table(value) and not _is_list_of_tables(value):
            yield f"{_key(key)} = {inline(value)}"
    for key, value in tables.items():
        path = (*prefix, _key(key))
        entries = value if _is_list_of_tables(value) else [value] if _is_table(value) else []
        header = "[[{}]]" if _is_list_of_tables(value) else "[{}]"
        for entry in entries:
            yield ""
            yield header.format(".".join(path))
            yield from _lines(entry, path)


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping)


def _is_list_of_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(_is_table(entry) for entry in value)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key)


def inline(value: Any) -> str:
    """A value as TOML on one line.

    >>> inline({"kind": "triangular", "ramp_duration": ["1 ms", "2 ms"]})
    '{ kind = "triangular", ramp_duration = ["1 ms", "2 ms"] }'
    """
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(k)} = {inline(v)}' for k, v in value.items())} }}"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list):
        return f"[{', '.join(inline(entry) for entry in value)}]"
    return repr(value)


def _text(value: str) -> str:
    """A TOML basic string: JSON's escapes, and one for DEL, which JSON does not escape."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
