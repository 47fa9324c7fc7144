"""A spec from the plain values that `provenance.plain` made of it."""

from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from polychirp.errors import InputError
from polychirp.spec import chosen_by_kind


def restored(hint: Any, value: Any) -> Any:
    """The value that the type ``hint`` describes, from its plain form in SI.

    >>> from polychirp.study.provenance import plain
    >>> from polychirp.waveform import AnyWaveform, Triangular
    >>> restored(AnyWaveform, plain(Triangular(bandwidth=1e9))).bandwidth
    1000000000.0

    Raises
    ------
    InputError
        No member of a union has the value's type or ``kind``.
    """
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        choices = chosen_by_kind(hint)
        return restored(_of_kind(choices, value) if choices else inner[0], value)
    if origin in (Union, UnionType):
        return restored(_member(inner, value), value)
    if is_dataclass(hint):
        return _restored_spec(hint, value)
    if origin in (tuple, dict):
        return _restored_entries(origin, inner, value)
    is_plain = value is None or not (isinstance(hint, type) and issubclass(hint, Enum | float))
    return value if is_plain else hint(value)


def _restored_entries(origin: type, inner: tuple[Any, ...], value: Any) -> Any:
    if origin is dict:
        return {key: restored(inner[1], one) for key, one in value.items()}
    entries = inner[:1] * len(value) if inner[1:] == (...,) else inner
    return tuple(restored(entry, one) for entry, one in zip(entries, value, strict=True))


def _restored_spec(spec: Any, value: dict[str, Any]) -> Any:
    hints = _hints(spec)
    known = {field.name for field in fields(spec) if field.init}
    return spec(**{name: restored(hints[name], value[name]) for name in known & value.keys()})


@cache
def _hints(spec: type) -> dict[str, Any]:
    return get_type_hints(spec, include_extras=True)


def _of_kind(members: tuple[Any, ...], value: dict[str, Any]) -> Any:
    for member in members:
        if value["kind"] in get_args(_hints(member)["kind"]):
            return member
    raise InputError(f"there is nothing of the kind '{value['kind']}'")


def _member(members: tuple[Any, ...], value: Any) -> Any:
    """The member of a union that a plain value is of: None, a spec with its keys, or plain."""
    if value is None:
        return NoneType
    others = [member for member in members if member is not NoneType]
    for member in others:
        spec = get_args(member)[0] if get_origin(member) is Annotated else member
        is_spec = is_dataclass(spec) or get_origin(spec) in (Union, UnionType)
        if is_spec == isinstance(value, dict) and _fits(spec, value):
            return member
    if len(others) == 1:
        return others[0]
    raise InputError(f"no member of {members} has a value like {value!r}")


def _fits(spec: Any, value: Any) -> bool:
    if is_dataclass(spec):
        return set(value) <= {field.name for field in fields(spec)}
    is_sequence = get_origin(spec) is tuple
    return is_sequence == isinstance(value, list)
