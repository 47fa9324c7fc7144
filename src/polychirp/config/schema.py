"""JSON schema of study files, made from the dataclasses, for completion and checks in editors."""

import json
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from inspect import cleandoc
from types import UnionType
from typing import Annotated, Any, Final, Union, get_args, get_origin, get_type_hints

from pydantic import TypeAdapter

from polychirp.config.dump import written
from polychirp.config.load import MONTE_CARLO
from polychirp.spec import ByKind, chosen_by_kind
from polychirp.study.monte_carlo.grid import MonteCarlo
from polychirp.study.spec import Study

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


def study_schema() -> dict[str, Any]:
    """The schema of a study file, as JSON data.

    It describes the text of the file: quantities are strings with ``x-unit``, ``x-minimum``,
    ``x-maximum`` and ``examples``, and ``kind`` chooses a member of a union. No key of a radar is
    required, because ``[defaults.radar]`` may give it; `config.load` finds keys that both lack.
    """
    schema = TypeAdapter(Study).json_schema()
    definitions: dict[str, Any] = schema["$defs"]
    table = TypeAdapter(MonteCarlo).json_schema()
    definitions |= {**table.pop("$defs"), MonteCarlo.__name__: table}
    for spec in dict.fromkeys((*_specs(Study), *_specs(MonteCarlo))):
        described = schema if spec is Study else definitions.get(spec.__name__)
        if described is not None:
            _describe(described, spec)
    radar = definitions["StudyRadar"]
    radar.pop("required", None)
    schema["properties"]["defaults"] = {
        "type": "object",
        "description": "Keys that every radar shares unless it gives them itself.",
        "properties": {"radar": {"$ref": "#/$defs/StudyRadar"}},
        "additionalProperties": False,
    }
    schema["properties"][MONTE_CARLO] = {"$ref": f"#/$defs/{MonteCarlo.__name__}"}
    _walk(schema, _without_noise)
    return {"$schema": DIALECT, "title": "polychirp study", **schema}


def schema_text() -> str:
    """The text of ``schemas/study.schema.json``."""
    return json.dumps(study_schema(), indent=2, sort_keys=True, ensure_ascii=False) + "\n"


def _specs(hint: Any, seen: frozenset[type] = frozenset()) -> Iterator[type]:
    """Every dataclass that a type can hold, the type itself first if it is one."""
    if get_origin(hint) is Annotated:
        for member in chosen_by_kind(hint) or get_args(hint)[:1]:
            yield from _specs(member, seen)
    elif get_origin(hint) in (Union, UnionType, tuple):
        for member in get_args(hint):
            yield from _specs(member, seen)
    elif isinstance(hint, type) and is_dataclass(hint) and hint not in seen:
        yield hint
        for member in get_type_hints(hint, include_extras=True).values():
            yield from _specs(member, seen | {hint})


def _describe(described: dict[str, Any], spec: type) -> None:
    """Add descriptions and defaults of a spec and its fields in the units of a study file."""
    described["description"] = cleandoc(spec.__doc__ or "").partition("\n")[0]
    texts, hints = parameter_texts(spec), get_type_hints(spec, include_extras=True)
    for field in fields(spec):
        entry = described["properties"][field.name]
        if field.name in texts:
            entry["description"] = texts[field.name]
        entry.pop("default", None)
        if field.name == "kind" and spec in _default_members():
            entry["default"] = field.default
        elif field.name == "kind":
            described.setdefault("required", []).append("kind")
        elif field.default is not MISSING and field.default is not None:
            entry["default"] = written(field.default, hints[field.name], field.name)


def _kinds(spec: type) -> tuple[str, ...]:
    """Values of ``kind`` that stand for a spec."""
    return get_args(get_type_hints(spec)["kind"])


@cache
def _default_members() -> frozenset[type]:
    """Specs that a table without a ``kind`` means."""
    found: set[type] = set()
    for spec in _specs(Study):
        for hint in get_type_hints(spec, include_extras=True).values():
            for mark in getattr(hint, "__metadata__", ()):
                if isinstance(mark, ByKind) and mark.default is not None:
                    found.update(
                        m for m in get_args(get_args(hint)[0]) if mark.default in _kinds(m)
                    )
    return frozenset(found)


def parameter_texts(spec: type) -> dict[str, str]:
    """Text of each parameter in the docstrings of a spec and its bases, on one line.

    >>> from polychirp.waveform import Triangular
    >>> parameter_texts(Triangular)["idle"]
    's, silence between triangles'
    """
    texts: dict[str, str] = {}
    for base in reversed(spec.__mro__):
        found = re.search(
            r"^Parameters\n-+\n(.*?)(?=^\w+\n-+\n|\Z)",
            cleandoc(base.__doc__ or ""),
            re.MULTILINE | re.DOTALL,
        )
        # each statement "a, b : text" begins on an unindented line and may go on on indented ones
        joined = re.sub(r"\n\s+", " ", found[1]) if found else ""
        for names, text in re.findall(r"^([\w, ]+?) : (.+)$", joined, re.MULTILINE):
            texts.update(dict.fromkeys(names.split(", "), text.strip()))
    return texts


def _walk(node: Any, change: Callable[[dict[str, Any]], None]) -> None:
    if isinstance(node, dict):
        change(node)
    for child in node.values() if isinstance(node, dict) else node:
        if isinstance(child, dict | list):
            _walk(child, change)


def _without_noise(node: dict[str, Any]) -> None:
    """Drop titles that repeat a key, and OpenAPI's discriminator, which JSON schema lacks."""
    if isinstance(node.get("title"), str) and "type" in node:
        del node["title"]
    node.pop("discriminator", None)


if __name__ == "__main__":
    sys.stdout.write(schema_text())
