"""Captions of the sidebar as headings of a level, which screen readers announce.

Sphinx gives captions the role ``heading`` without the level that this role needs (WAI-ARIA).
"""

from typing import Any, Final

from sphinx.application import Sphinx

TREE: Final = "furo_navigation_tree"
"""Name of the sidebar's HTML among the values of a page."""

AFTER_THEME: Final = 900
"""Priority of an event's reader that is called after the theme's, which has 500."""


def with_levels(html: str) -> str:
    """HTML whose headings without a level have level 2.

    >>> with_levels('<p class="caption" role="heading">Start</p>')
    '<p class="caption" role="heading" aria-level="2">Start</p>'
    """
    return html.replace('role="heading">', 'role="heading" aria-level="2">')


def change(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Change the sidebar of a page before it is written."""
    del app, page, template, doctree
    if TREE in context:
        context[TREE] = with_levels(context[TREE])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the change."""
    app.connect("html-page-context", change, priority=AFTER_THEME)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
