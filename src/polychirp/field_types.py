"""`need_field_types`: dataclasses made in Python whose values do not have the declared types."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from polychirp.errors import InputError, short
from polychirp.spec import ByKind, chosen_by_kind, kinds_of
from polychirp.units import Unit

Reader = Callable[[Any, str], str]
"""Function of a value and its place; it gives the sentence of what is wrong, empty if nothing."""

PLAIN: Final[dict[type, tuple[type | tuple[type, ...], str, str]]] = {
    bool: ((bool, np.bool_), "true or false", "True"),
    int: (Integral, "whole number", "4"),
    float: (Real, "number", "1.5"),
    str: (str, "text", "'front'"),
}
"""For each plain type: the types that a field accepts, its name in a sentence, an example."""

ENDLESS: Final = frozenset(
    {
        "azimuth_beamwidth",
        "elevation_beamwidth",
        "conductivity",
        "dynamic_range",
        "max_length",
        "refresh_interval",
    }
)
"""Names of quantities that may be infinite, in Python alone, as no study file has such a value: of
an isotropic antenna, an ideal conductor, paths of any length or power, and paths traced once."""


def need_field_types(spec: Any) -> None:
    """Refuse a dataclass with a value that has another type than its field, at any depth.

    A whole number may stand for a number, and a list or an array for a tuple; NaN is no number,
    and quantities are finite, but for those of `ENDLESS`. The bounds of study files are not
    applied: a radar in the far field of a truck is 12 000 km away.
    Where a field chooses a spec by its kind (`ByKind`), a class of your own may stand for it if it
    has the method that the others have. `InputError` is raised at the first such value; its message
    has the place of the value, what it is, and what would work.

    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Ramps:
    ...     count: int
    >>> need_field_types(Ramps(count=4.0))
    Traceback (most recent call last):
        ...
    polychirp.errors.InputError: Ramps.count: 4.0 is no whole number; write it like 4
    """
    kind: Any = type(spec)
    wrong = _fields_of(kind)(spec, kind.__name__)
    if wrong:
        raise InputError(wrong)


@cache
def _fields_of(kind: Any) -> Reader:
    """Reader of all fields of a dataclass."""
    hints = get_type_hints(kind, include_extras=True)
    readers = [(one.name, _reader(hints[one.name])) for one in fields(kind)]

    def read(value: Any, place: str) -> str:
        for name, reader in readers:
            wrong = reader(getattr(value, name), f"{place}.{name}")
            if wrong:
                return wrong
        return ""

    return read


@cache
def _reader(hint: Any) -> Reader:
    """Reader of one declared type; types that no study file has are not read."""
    plain, unit, mark = _unwrapped(hint)
    origin = get_origin(plain)
    if plain in PLAIN:
        return _plain(plain, unit)
    if origin is Literal:
        return _literal(get_args(plain))
    if origin is tuple:
        return _tuple(get_args(plain))
    if mark is not None or origin in (Union, UnionType) or is_dataclass(plain):
        return _choice(hint)
    return lambda _value, _place: ""


def _unwrapped(hint: Any) -> tuple[Any, Unit | None, ByKind | None]:
    """A type without its annotations, its unit, and its mark of a choice by kind."""
    if get_origin(hint) is not Annotated:
        return hint, None, None
    plain, *notes = get_args(hint)
    unit = next((note for note in notes if isinstance(note, Unit)), None)
    return plain, unit, next((note for note in notes if isinstance(note, ByKind)), None)


def _plain(kind: type, unit: Unit | None) -> Reader:
    accepted, name, example = PLAIN[kind]

    def read(value: Any, place: str) -> str:
        number: Any = value
        is_flag = isinstance(value, bool | np.bool_) and kind is not bool
        if is_flag or not isinstance(value, accepted):
            advice = _in_si(value, unit) if unit is not None else _like(value, kind, example)
            return f"{place}: {_shown(value)} is no {name}; {advice}"
        if kind is float and math.isnan(number):
            return f"{place}: is NaN, which is no number; write it like {example}"
        may_be_endless = number == math.inf and place.rpartition(".")[2] in ENDLESS
        if kind is float and unit is not None and math.isinf(number) and not may_be_endless:
            return f"{place}: is {number}; give a finite number"
        return ""

    return read


def _like(value: Any, kind: type, example: str) -> str:
    """Advice with the value itself where it is almost right, as 4.0 is for 4."""
    is_whole = kind is int and isinstance(value, float) and value.is_integer()
    return f"write it like {int(value) if is_whole else example}"


def _in_si(value: Any, unit: Unit) -> str:
    """Advice for a quantity that is no number."""
    try:
        return f"in Python write {unit.parse(value)!r}, which is in SI units and linear"
    except InputError:
        return "write a number in SI units; quantities with units are read from study files alone"


def _literal(values: tuple[Any, ...]) -> Reader:
    known = ", ".join(repr(one) for one in values)
    advice = f"write {known}" if len(values) == 1 else f"write one of {known}"

    def read(value: Any, place: str) -> str:
        if isinstance(value, str) and value in values:
            return ""
        return f"{place}: cannot be {_shown(value)}; {advice}"

    return read


def _tuple(entries: tuple[Any, ...]) -> Reader:
    has_any_length = len(entries) == 2 and entries[1] is Ellipsis
    readers = [_reader(entry) for entry in (entries[:1] if has_any_length else entries)]

    def read(value: Any, place: str) -> str:
        is_array = isinstance(value, np.ndarray) and value.ndim > 0
        if not (isinstance(value, tuple | list) or is_array):
            inside = _inside(value) if not readers[0](value, place) else "…"
            advice = f"({inside},)" if has_any_length else f"({', '.join('…' for _ in readers)})"
            return f"{place}: {_shown(value)} is no tuple; write it like {advice}"
        if has_any_length:
            own: Sequence[Reader] = readers * len(value)
        elif len(value) != len(readers):
            return f"{place}: has {len(value)} entries; it needs {len(readers)}"
        else:
            own = readers
        for number, (reader, entry) in enumerate(zip(own, value, strict=True)):
            wrong = reader(entry, f"{place}[{number}]")
            if wrong:
                return wrong
        return ""

    return read


def _choice(hint: Any) -> Reader:
    """Reader of a dataclass, or of a union of any types."""
    members = list(_members(hint))
    classes: tuple[Any, ...] = tuple(one for one, _ in members if is_dataclass(one))
    methods = {mark.method for _, mark in members if mark is not None}
    others = [(one, _reader(one)) for one, _ in members if one not in (*classes, NoneType)]
    may_be_none = any(one is NoneType for one, _ in members)

    def read(value: Any, place: str) -> str:
        if isinstance(value, classes):
            kind: Any = type(value)
            return _fields_of(kind)(value, place)
        if value is None and may_be_none:
            return ""
        is_class = isinstance(value, type)
        if not is_class and any(callable(getattr(value, name, None)) for name in methods):
            return ""
        wrong = [reader(value, place) for _, reader in others]
        if not all(wrong):
            return ""
        # of several types, the sentence of the one that the value resembles is about its entries
        inner = [one for one in wrong if not one.startswith(f"{place}:")]
        if inner or (wrong and not classes):
            return (inner or wrong)[0] + (" or None" if may_be_none and not inner else "")
        advice = f"{_advised(value, classes)}{', or None' if may_be_none else ''}"
        return f"{place}: {_shown(value)} is no {_listed(classes)}; write {advice}"

    return read


def _members(hint: Any) -> Iterator[tuple[Any, ByKind | None]]:
    """Members of a union, each with the mark if a kind chooses it; of other types, that type."""
    plain, _, mark = _unwrapped(hint)
    if mark is not None:
        yield from ((one, mark) for one in chosen_by_kind(hint))
    elif get_origin(plain) in (Union, UnionType):
        for member in get_args(plain):
            yield from _members(member)
    else:
        yield hint, None


def _advised(value: Any, classes: Sequence[type]) -> str:
    """The class that a value names by its kind or its own name, or the first, as a call."""
    by_kind = {kind: one for one in classes if hasattr(one, "kind") for kind in kinds_of(one)}
    known = by_kind.get(value, classes[0]) if isinstance(value, str) else classes[0]
    known = value if isinstance(value, type) and issubclass(value, tuple(classes)) else known
    needs = any(one.default is one.default_factory for one in fields(known))
    return f"{known.__name__}({'…' if needs else ''})"


def _listed(classes: Sequence[type]) -> str:
    """Names of classes as the end of a sentence; of many, the first three."""
    names = [one.__name__ for one in classes]
    if len(names) > 4:
        return f"{', '.join(names[:3])} or another of its kind"
    return " or ".join(names)


def _shown(value: Any) -> str:
    """A value in a sentence: dataclasses by their name, classes as such, others as written."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if is_dataclass(value):
        return f"a {type(value).__name__}"
    return short(repr(value))


def _inside(value: Any) -> str:
    """A value as the only entry of a tuple that is written in Python."""
    if is_dataclass(value) and not isinstance(value, type):
        return f"{type(value).__name__}(…)"
    return short(repr(value))
