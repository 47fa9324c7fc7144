"""Parts that all HTML pages share: templates, tables, and pictures that they contain."""

import base64
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Final

import jinja2
from markupsafe import Markup
from PIL import Image

PALETTE_COLOURS: Final = 200
"""Number of colours of curves in the page; chosen: no difference is seen, and the files have less
than half of their length."""

JPEG_QUALITY: Final = 88
"""Quality of pictures with many colours in the page, of 100; chosen: edges have no visible marks.
"""

SCRIPTS: Final = ("theme.js", "plots.js", "explorer.js", "street.js", "start.js")
"""Scripts of the page, in the order in which they run."""


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a table: its lines of text and its class in the style sheet."""

    lines: Sequence[str]
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """A table of the page: titles of its columns and its rows of cells."""

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]


def rendered(template: str, *, title: str, data: Mapping[str, Any], **content: Any) -> str:
    """A page with the style sheet, the scripts and the ``data`` that they draw."""
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_read), autoescape=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template(template).render(
        title=title,
        style=Markup(_read("page.css")),
        script=Markup("\n".join(map(_read, SCRIPTS))),
        data=_as_script(data),
        **content,
    )


def _as_script(data: Mapping[str, Any]) -> Markup:
    """Values as JSON for an element ``script``; no name in them can end the element."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c"))


def _read(name: str) -> str:
    return files("polychirp.report.templates").joinpath(name).read_text(encoding="utf-8")


def figure_of(
    name: str, picture: bytes, *, caption: str, is_wide: bool, is_photo: bool = False
) -> dict[str, str]:
    """A figure with its picture, a PNG file; photos have many colours and stay as they are."""
    return {
        "name": name,
        "caption": caption,
        "source": _photo(picture) if is_photo else _chart(picture),
        "width": "wide" if is_wide else "panel",
        "kind": "photo" if is_photo else "chart",
    }


def _photo(picture: bytes) -> str:
    """Address of a picture with many colours, which contains the picture as JPEG."""
    file = io.BytesIO()
    with Image.open(io.BytesIO(picture)) as image:
        image.convert("RGB").save(file, format="JPEG", quality=JPEG_QUALITY, optimize=True)
    return _address("jpeg", file.getvalue())


def _chart(picture: bytes) -> str:
    """Address of a picture of curves, which contains it as PNG with few colours."""
    file = io.BytesIO()
    with Image.open(io.BytesIO(picture)) as image:
        few = image.convert("RGB").quantize(PALETTE_COLOURS, dither=Image.Dither.NONE)
        few.save(file, format="PNG", optimize=True)
    return _address("png", file.getvalue())


def _address(form: str, picture: bytes) -> str:
    return f"data:image/{form};base64,{base64.b64encode(picture).decode('ascii')}"


def text_cell(text: str, kind: str = "") -> Cell:
    """A cell of words; ``kind`` is its class in the style sheet."""
    return Cell((text,), kind)


def number_cell(text: str) -> Cell:
    """A cell of a number."""
    return Cell((text,), "number")


def verdict_cell(is_found: bool) -> Cell:
    """A cell that says whether a target was found."""
    return text_cell("found", "good") if is_found else text_cell("missed", "bad")


def lines_cell(texts: Iterable[str]) -> Cell:
    """One text per line, or a dash for none."""
    return Cell(tuple(texts) or ("–",), "lines")


def words_and_numbers(texts: Sequence[str], *, num_words: int) -> list[Cell]:
    """A row of a table: ``num_words`` cells of words, then cells of numbers."""
    return [*map(text_cell, texts[:num_words]), *map(number_cell, texts[num_words:])]
