"""Equations as MathML, which browsers show themselves: no script, no font, no request.

The converter is docutils's own; an equation that it cannot convert stops the build.
"""

import re
from typing import Any, Final

from docutils import nodes
from docutils.utils.math import MathError, latex2mathml, pick_math_environment
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError


SIZES: Final = re.compile(r"\\[bB]igg?[lmr]?(?![A-Za-z])")
"""Commands for the size of a bracket, which docutils does not know; MathML chooses it itself."""


def mathml(text: str, *, is_block: bool) -> str:
    """MathML of an equation in LaTeX."""
    text = SIZES.sub("", text)
    # docutils converts the rows of `align` alone
    environment = pick_math_environment(text) if is_block else ""
    if environment.startswith("align"):
        text = f"\\begin{{{environment}}}{text}\\end{{{environment}}}"
    try:
        return str(latex2mathml.tex2mathml(text, as_block=is_block))
    except (MathError, SyntaxError) as error:
        raise ExtensionError(f"the equation '{text}' cannot be shown: {error}") from error


def without_tag(text: str) -> tuple[str, str]:
    """An equation without its ``\\tag``, which docutils does not know, and the number in the tag."""
    head, tag, tail = text.partition(r"\tag{")
    number, _, rest = tail.partition("}")
    return (head + rest, number) if tag else (text, "")


def block(text: str) -> str:
    """An equation of its own, with its number if it has one."""
    equation, number = without_tag(text)
    shown = f'<span class="eqno">({number})</span>' if number else ""
    return f'<span class="equation">{mathml(equation, is_block=True)}{shown}</span>'


def visit_inline(self: Any, node: nodes.math) -> None:
    """Write an equation in a line of text; one between ``$$`` there is an equation of its own."""
    text = node.astext()
    is_block = "\\tag{" in text
    self.body.append(block(text) if is_block else mathml(text, is_block=False))
    raise nodes.SkipNode


def visit_block(self: Any, node: nodes.math_block) -> None:
    """Write an equation of its own."""
    self.body.append(block(node.astext()))
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer(
        "mathml", inline_renderers=(visit_inline, None), block_renderers=(visit_block, None)
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}
