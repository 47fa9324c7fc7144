"""Sentences for the problems that pydantic finds: place, what is wrong, what would work."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from types import UnionType
from typing import Annotated, Any, Final, Union, get_args, get_origin, get_type_hints

from polychirp.errors import did_you_mean, short
from polychirp.spec import chosen_by_kind

Place = tuple[str | int, ...]

TABLES_OF_FILES: Final = ("defaults", "monte_carlo")
"""Tables of a study file that are no fields of a `Study`, and are taken out before it is made."""


def problems(errors: Iterable[Mapping[str, Any]], *, spec: type) -> list[tuple[Place, str]]:
    """Place and sentence of each of pydantic's errors about a ``spec``."""
    found = []
    for error in errors:
        place, owner = _locate(error["loc"], spec)
        if error["type"].startswith("union_tag"):
            place = (*place, "kind")
        found.append((place, _SENTENCES.get(error["type"], _fallback)(error, owner)))
    return found


def _locate(loc: Sequence[str | int], spec: type) -> tuple[Place, Any]:
    """Keys of the file on the way to ``loc``, and the type that owns the last of them.

    Pydantic's location ``loc`` also names the member of each union, which is no key of the file.
    """
    place: list[str | int] = []
    here: Any = spec
    owner: Any = spec
    is_chosen = False
    for part in loc:
        kinds = {kind_of(member): member for member in members(here)}
        chosen = kinds.get(part) if isinstance(part, str) and part else None
        # after a member's name there is a key, even if it is the same word
        is_chosen = chosen is not None and not is_chosen
        if is_chosen:
            here = chosen
            continue
        place.append(part)
        owner, here = here, below(here, part)
    return tuple(place), owner


def members(hint: Any) -> list[Any]:
    """Members of a union without None and annotations; of another type, that type alone."""
    if get_origin(hint) is Annotated:
        choices = chosen_by_kind(hint)
        return list(choices) if choices else members(get_args(hint)[0])
    if get_origin(hint) in (Union, UnionType):
        return [
            inner
            for member in get_args(hint)
            if member is not type(None)
            for inner in members(member)
        ]
    return [hint]


def kind_of(member: Any) -> str:
    """Value of ``kind`` by which a file chooses the spec; empty if the spec has none."""
    if not is_dataclass(member):
        return ""
    hint = get_type_hints(member).get("kind")
    return str(get_args(hint)[0]) if hint is not None and get_args(hint) else ""


def below(hint: Any, part: str | int) -> Any:
    """Type of the field or entry ``part`` of a type; None if there is no such field."""
    for member in members(hint):
        if isinstance(part, int) and get_origin(member) is tuple:
            entries = get_args(member)
            if len(entries) == 2 and entries[1] is Ellipsis:
                return entries[0]
            return entries[part] if part < len(entries) else None
        if is_dataclass(member) and part in {f.name for f in fields(member)}:
            return get_type_hints(member, include_extras=True)[part]
    return None


def _keys(hint: Any) -> list[str]:
    found = [f.name for member in members(hint) if is_dataclass(member) for f in fields(member)]
    return [name for name in found if not name.startswith("_")]


def _shown(value: object) -> str:
    """Text of a value for a sentence, of at most 40 characters."""
    return short(str(value).lower() if isinstance(value, bool) else repr(value))


def _value(error: Mapping[str, Any], owner: Any) -> str:
    del owner
    return str(error["ctx"]["error"])


def _unknown_key(error: Mapping[str, Any], owner: Any) -> str:
    tables = TABLES_OF_FILES if len(error["loc"]) == 1 and "radars" in _keys(owner) else ()
    return f"unknown key; {did_you_mean(str(error['loc'][-1]), [*_keys(owner), *tables])}"


def _missing(error: Mapping[str, Any], owner: Any) -> str:
    del owner
    return "an entry is missing" if isinstance(error["loc"][-1], int) else "is missing; give it"


def _no_kind(error: Mapping[str, Any], owner: Any) -> str:
    del error, owner
    return "is missing; give the kind, which decides which other keys are allowed"


def _wrong_kind(error: Mapping[str, Any], owner: Any) -> str:
    del owner
    known = [name.strip("' ") for name in error["ctx"]["expected_tags"].split(",")]
    tag = str(error["ctx"]["tag"])
    return f"there is no '{tag}'; {did_you_mean(tag, known)}"


def _literal(error: Mapping[str, Any], owner: Any) -> str:
    del owner
    known = error["ctx"]["expected"].replace(" or ", ", ").split(", ")
    hint = did_you_mean(str(error["input"]), [name.strip("'") for name in known])
    return f"{_shown(error['input'])} is not one of its values; {hint}"


def _too_long(error: Mapping[str, Any], owner: Any) -> str:
    del owner
    ctx = error["ctx"]
    return f"has {ctx['actual_length']} entries; give at most {ctx['max_length']}"


def _needs(what: str) -> Callable[[Mapping[str, Any], Any], str]:
    def sentence(error: Mapping[str, Any], owner: Any) -> str:
        del owner
        return f"must be {what}, not {_shown(error['input'])}"

    return sentence


def _fallback(error: Mapping[str, Any], owner: Any) -> str:
    del owner
    return f"{error['msg']}, not {_shown(error['input'])}"


_SENTENCES: Final[Mapping[str, Callable[[Mapping[str, Any], Any], str]]] = {
    "value_error": _value,
    "unexpected_keyword_argument": _unknown_key,
    "missing": _missing,
    "union_tag_not_found": _no_kind,
    "union_tag_invalid": _wrong_kind,
    "literal_error": _literal,
    "too_long": _too_long,
    "int_type": _needs("a whole number"),
    "int_from_float": _needs("a whole number"),
    "float_type": _needs("a number"),
    "bool_type": _needs("true or false"),
    "string_type": _needs("text in quotes"),
    "path_type": _needs("text in quotes"),
    "tuple_type": _needs("a list in square brackets"),
    "dataclass_type": _needs("a table"),
    "dict_type": _needs("a table"),
}
