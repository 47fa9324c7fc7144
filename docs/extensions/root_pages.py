"""Pages of the repository's root, such as README.md, on the site, and links to them.

A page of ``docs/project`` holds a link alone; the site shows the linked file in its place. Links
lead to the same pages on the site as in the repository.
"""

import os
import re
from pathlib import Path
from typing import Final

from sphinx.application import Sphinx

DOCS: Final = Path(__file__).parents[1]
ROOT: Final = DOCS.parent
PLACE: Final = "project"
LINK: Final = re.compile(r"(?<=\]\()([^)\s#:]+)")
"""The path in a Markdown link to a file."""


def shown_file(stub: str) -> Path:
    """The file that a page of ``docs/project`` links to."""
    found = LINK.search(stub)
    assert found is not None
    return (DOCS / PLACE / found[1]).resolve()


def page_of(file: Path) -> Path:
    """Path of a file's page in the documentation.

    That of a root file is in ``docs/project``; folders of scripts have generated pages.
    """
    if file in (DOCS / "gallery", DOCS / "tutorials"):
        return DOCS / "generated" / file.name / "index.rst"
    if file.parent == ROOT and file.suffix == ".md":
        return DOCS / PLACE / f"{file.stem.lower()}.md"
    return file


def with_links(text: str, *, source: Path, page: Path) -> str:
    """Text of the file ``source``, with its links changed for the place of its ``page``."""

    def link(found: re.Match[str]) -> str:
        file = (source.parent / found[1]).resolve()
        return os.path.relpath(page_of(file), page.parent) if file.exists() else found[0]

    return LINK.sub(link, text)


def read(app: Sphinx, name: str, content: list[str]) -> None:
    """Put the linked file in place of a stub, and change links to root pages."""
    page = Path(app.env.doc2path(name))
    if page.suffix != ".md":
        return
    source = page
    if name.startswith(f"{PLACE}/"):
        source = shown_file(content[0])
        content[0] = source.read_text(encoding="utf-8")
        app.env.note_dependency(source)
    content[0] = with_links(content[0], source=source, page=page)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the reader."""
    app.connect("source-read", read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
