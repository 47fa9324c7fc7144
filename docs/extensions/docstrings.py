"""Docstrings as the site shows them: units in the texts of parameters, types without marks."""

import re
from collections.abc import Iterator
from functools import cache
from typing import Any, Final

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util.nodes import make_refnode

SECTION: Final = re.compile(r"^[A-Z][A-Za-z ]+$")
PARAMETER: Final = re.compile(r"^([\w*][\w*, ]*?) : (.*)$")
LITERAL: Final = re.compile(r"(``.*?``|`.*?`)")
MARKED: Final = "Annotated["
BEFORE_NAPOLEON: Final = 400


def convert(app: Sphinx, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """Put the text of a parameter, which begins with its unit, where napoleon expects a text."""
    del app, what, name, item, options
    lines[:] = [*escaped(parameters(lines))]


def parameters(lines: list[str]) -> Iterator[str]:
    """The lines; in a section of parameters, ``name : text`` becomes two lines."""
    inside = False
    for number, line in enumerate(lines):
        following = lines[number + 1] if number + 1 < len(lines) else ""
        if SECTION.match(line) and following and set(following) == {"-"}:
            inside = line == "Parameters"
        found = PARAMETER.match(line) if inside else None
        if found:
            yield found[1]
            yield f"    {found[2]}"
        else:
            yield line


def escaped(lines: Iterator[str]) -> Iterator[str]:
    """The lines with bars, as in ``|x|``, that are no markup; code and equations as they are."""
    depth = -1  # of an equation's directive
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if line.strip() and indent <= depth:
            depth = -1
        if line.lstrip().startswith(".. math::"):
            depth = indent
        if depth >= 0 or line.lstrip().startswith((">>>", "...")):
            yield line
            continue
        parts = LITERAL.split(line)
        parts[::2] = [part.replace("|", "\\|") for part in parts[::2]]
        yield "".join(parts)


def without_marks(text: str) -> str:
    """Types of a signature without what `Annotated` adds to them.

    >>> without_marks("(a: Annotated[float, Unit(symbol='s')], b: list[Annotated[int, [1]]])")
    '(a: float, b: list[int])'
    """
    while (start := text.find(MARKED)) >= 0:
        head = text[:start].removesuffix("~typing.").removesuffix("typing.")
        depth, inner, end = 0, None, start + len(MARKED)
        for place in range(end, len(text)):
            depth += {"[": 1, "(": 1, "]": -1, ")": -1}.get(text[place], 0)
            if text[place] == "," and depth == 0 and inner is None:
                inner = text[end:place]
            if depth < 0:
                text = head + (inner or text[end:place]) + text[place + 1 :]
                break
    return text


def shorten(*event: Any) -> tuple[str | None, str | None]:
    """Signature and result without marks of types; they are the last two values of the event."""
    signature, result = event[-2:]
    return without_marks(signature or "") or signature, without_marks(result or "") or result


def be_exact(app: Sphinx, doctree: nodes.document) -> None:
    """Leave names that Sphinx would search among all endings, one by one, to `resolve`."""
    del app
    for node in doctree.findall(pending_xref):
        if node.get("refdomain") == "py":
            node["refspecific"] = False


def resolve(app: Sphinx, env: BuildEnvironment, node: pending_xref, text: nodes.TextElement) -> Any:
    """Link a name, such as `IfFrame` or `model.paths`, that means one object of the package."""
    if node.get("refdomain") != "py":
        return None
    found = by_ending(env).get(node["reftarget"].lstrip("~."))
    if found is None:
        return None
    name, page, anchor = found
    return make_refnode(app.builder, node["refdoc"], page, anchor, text, name)


@cache
def by_ending(env: BuildEnvironment) -> dict[str, tuple[str, str, str] | None]:
    """Objects by every ending of their names that no other object has; fields are left out."""
    found: dict[str, tuple[str, str, str] | None] = {}
    for name, entry in env.domains.python_domain.objects.items():
        if entry.objtype in ("attribute", "property") or entry.aliased:
            continue
        words = name.split(".")
        for first in range(len(words)):
            ending = ".".join(words[first:])
            found[ending] = None if ending in found else (name, entry.docname, entry.node_id)
    return found


def setup(app: Sphinx) -> dict[str, bool]:
    """Register all changes."""
    app.connect("autodoc-process-docstring", convert, priority=BEFORE_NAPOLEON)
    app.connect("autodoc-process-signature", shorten)
    app.connect("doctree-read", be_exact)
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
