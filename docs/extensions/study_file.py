"""The page of all tables and keys of a study file, from the schema."""

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import rst
from sphinx.application import Sphinx

from polychirp.config.dump import inline
from polychirp.config.schema import study_schema

Node = Mapping[str, Any]


def page(schema: Node) -> list[str]:
    """The page: the study itself, then every table that it can hold."""
    lines = [
        *rst.heading("Study file", "="),
        "A study is a TOML file. This page lists every table that it can hold, with all keys. It "
        "is generated from the schema by which editors and ``polychirp check`` read files.",
        "",
        'A quantity is text with its unit, such as ``"79 GHz"``. A key without a default must be '
        "given. The column of values names further tables; several tables in one cell are "
        "alternatives, of which the key ``kind`` chooses one.",
        "",
        *rst.heading("The study", "-"),
        f"{schema['description']}",
        "",
        *keys(schema),
    ]
    for name, table in schema["$defs"].items():
        lines += [f".. _study-{name.lower()}:", "", *rst.heading(title(name, table), "-")]
        lines += [plain(table.get("description", "")), "", *keys(table)]
    return lines


def title(name: str, table: Node) -> str:
    """Name of a table, with the value of ``kind`` that chooses it."""
    kinds = table["properties"].get("kind", {})
    chosen = [kinds["const"]] if "const" in kinds else kinds.get("enum", [])
    return f"{name}: kind = {' or '.join(inline(kind) for kind in chosen)}" if chosen else name


def keys(table: Node) -> list[str]:
    """The keys of a table, as a table of the page."""
    required = set(table.get("required", []))
    rows = [
        (
            rst.literal(name),
            ", ".join(values(node)),
            default(node, is_required=name in required),
            plain(node.get("description", "")),
        )
        for name, node in table["properties"].items()
        if name != "kind"
    ]
    return (
        rst.table(("key", "value", "default", "meaning"), rows) if rows else ["It has no keys.", ""]
    )


def values(node: Node) -> Iterator[str]:
    """Values that a key can have, each as reStructuredText."""
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        yield f":ref:`{name} <study-{name.lower()}>`"
    elif "x-unit" in node:
        least, greatest = node["x-minimum"], node["x-maximum"]
        yield f"{rst.literal(node['examples'][0])}: {least} to {greatest}"
    elif "enum" in node:
        yield from (rst.literal(inline(one)) for one in node["enum"])
    elif "prefixItems" in node:
        kinds = dict.fromkeys(one for item in node["prefixItems"] for one in values(item))
        yield f"list of {len(node['prefixItems'])}: {' and '.join(kinds)}"
    elif node.get("type") == "array":
        yield f"list of {' or '.join(values(node['items']))}"
    elif "anyOf" in node or "oneOf" in node:
        for one in node.get("anyOf", node.get("oneOf", [])):
            if one.get("type") != "null":
                yield from values(one)
    elif node.get("type") == "object":
        yield (
            ", ".join(
                f"{rst.literal(name)}: {' '.join(values(inner))}"
                for name, inner in node.get("properties", {}).items()
            )
            or "table"
        )
    else:
        yield number(node)


def number(node: Node) -> str:
    """Type and bounds of a value without a unit."""
    words = {"string": "text", "integer": "whole number", "boolean": "true or false"}
    text = words.get(node.get("type", ""), str(node.get("type", "any value")))
    least, greatest = node.get("minimum"), node.get("maximum")
    bounds = [
        f"{word} {value:,}".replace(",", " ")
        for word, value in (("at least", least), ("at most", greatest))
        if value is not None
    ]
    return f"{text}, {', '.join(bounds)}" if bounds else text


def default(node: Node, *, is_required: bool) -> str:
    """Default of a key as a study file writes it."""
    if is_required:
        return "must be given"
    if "default" in node:
        return rst.literal(inline(node["default"]))
    return "that of its table" if "$ref" in node or "oneOf" in node else "none"


def plain(text: str) -> str:
    """A description whose stars and bars are no markup."""
    return re.sub(r"(?<![`\\])([*|])", r"\\\1", text)


def write_page(app: Sphinx) -> None:
    """Write the page before the builder reads it."""
    schema = json.loads(json.dumps(study_schema()))
    rst.write(Path(app.srcdir) / "generated" / "study-file.rst", page(schema))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the writer."""
    app.connect("builder-inited", write_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
