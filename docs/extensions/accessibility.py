"""What screen readers and keyboards need, and the theme leaves out.

Sphinx gives the captions of the sidebar the role ``heading`` without the level that this role needs
(WAI-ARIA). A block of code or a table that is wider than the page scrolls by the keyboard only if
it can have the focus.
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


def with_focus(html: str) -> str:
    """HTML whose blocks of code and wide tables can have the focus.

    >>> with_focus("<pre>x = 1</pre>")
    '<pre tabindex="0">x = 1</pre>'
    """
    html = html.replace('<div class="table-wrapper', '<div tabindex="0" class="table-wrapper')
    return html.replace("<pre>", '<pre tabindex="0">')


def change(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Change sidebar and text of a page before it is written."""
    del app, page, template, doctree
    for name, changed in ((TREE, with_levels), ("body", with_focus)):
        if name in context:
            context[name] = changed(context[name])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the change."""
    app.connect("html-page-context", change, priority=AFTER_THEME)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
