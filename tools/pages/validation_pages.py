"""Pages of docs/validation: generated tables between written text.

A page is a Markdown file. Lines between the marks ``<!-- generated: NAME -->`` and
``<!-- end of NAME -->`` are replaced by `write_pages`; all others are kept. The block
``comparisons`` has the page's rows of ``comparisons.json``, which ``./run validation`` records;
``index`` lists the pages; ``stamps`` lists the records; the blocks of `tools.pages.material_tables`
follow the table of materials; all other blocks come from the records of their modules here.

``python -m tools.pages.validation_pages docs/validation`` writes all pages.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from polychirp.errors import InputError
from tools.pages.benchmark_table import RECORD as BENCHMARK
from tools.pages.benchmark_table import benchmark_tables
from tools.pages.body_table import RECORD as BODIES
from tools.pages.body_table import body_table
from tools.pages.chirp_sequence_table import RECORD as CHIRP_SEQUENCE
from tools.pages.chirp_sequence_table import chirp_sequence_tables
from tools.pages.diversity_table import RECORD as DIVERSITY
from tools.pages.diversity_table import diversity_table
from tools.pages.ghost_table import RECORD as GHOSTS
from tools.pages.ghost_table import ghost_table
from tools.pages.impairment_table import RECORD as IMPAIRMENTS
from tools.pages.impairment_table import impairment_table
from tools.pages.league_table import RECORD as LEAGUE
from tools.pages.league_table import league_tables
from tools.pages.markdown import table, three_digits
from tools.pages.material_tables import paper_materials, sensitivity
from tools.pages.mechanism_table import RECORD as MECHANISMS
from tools.pages.mechanism_table import mechanism_table
from tools.pages.mitigation_table import RECORD as MITIGATIONS
from tools.pages.mitigation_table import mitigation_table
from tools.pages.published_table import RECORD as PUBLISHED
from tools.pages.published_table import published_table
from tools.pages.receiver_table import RECORD as RECEIVER
from tools.pages.receiver_table import receiver_tables
from tools.pages.road_table import RECORD as ROADS
from tools.pages.road_table import road_table
from tools.pages.speed_table import RECORD as SPEED
from tools.pages.speed_table import speed_tables
from tools.pages.statistics_table import RECORD as STATISTICS
from tools.pages.statistics_table import statistics_table
from tools.pages.street_table import RECORD as STREETS
from tools.pages.street_table import street_table
from tools.pages.validation import Comparison, read_comparisons

RECORD: Final = "comparisons.json"
"""File that ``pytest --record`` writes in the folder of the pages."""

INDEX: Final = "README.md"

GUIDES: Final = "how-to"
"""Folder of the guides, beside that of the pages."""

CLOSE_LEVELS: Final = 0.1
"""Difference in dB up to which two levels count as close in the table of agreement."""

STAMPS: Final = "stamps.json"
"""File that holds when each record was measured and with which code."""

_MARKS: Final = "<!-- generated: comparisons -->\n<!-- end of comparisons -->\n"

_BLOCK: Final = re.compile(
    r"(?P<start><!-- generated: (?P<name>[a-z-]+) -->\n).*?(?P<end><!-- end of (?P=name) -->\n)",
    re.DOTALL,
)


def comparison_tables(rows: Sequence[Comparison]) -> str:
    """One table for every quantity, in the order of the tests.

    Numbers have one digit more than their tolerance, and at least two decimals.

    >>> print(comparison_tables([Comparison(page="p", case="disc", quantity="RCS, dBsm",
    ...     expected=20.48, measured=20.5, tolerance=0.3, source="theory")]))
    **RCS, dBsm**
    <BLANKLINE>
    | case | expected | measured | difference | tolerance | source |
    |---|---:|---:|---:|---:|---|
    | disc | 20.48 | 20.50 | 0.02 | 0.3 | theory |
    """
    head = ("case", "expected", "measured", "difference", "tolerance", "source")
    parts = []
    for quantity in dict.fromkeys(row.quantity for row in rows):
        mine = [_cells(row) for row in rows if row.quantity == quantity]
        parts.append(f"**{quantity}**\n\n{table(head, mine)}")
    return "\n\n".join(parts)


def _cells(row: Comparison) -> tuple[str, ...]:
    digits = max(2, 1 - math.floor(math.log10(row.tolerance))) if row.tolerance > 0 else 6
    return (
        row.case,
        _fixed(row.expected, digits),
        _fixed(row.measured, digits),
        _fixed(row.measured - row.expected, digits),
        three_digits(row.tolerance),
        row.source,
    )


def _fixed(value: float, digits: int) -> str:
    return f"{round(value, digits) + 0.0:.{digits}f}"  # + 0.0: a zero has no sign


def index_table(titles: Mapping[str, str], rows: Sequence[Comparison]) -> str:
    """Every page by name: its title, the number of comparisons on it, and their quantities."""
    body = []
    for name in sorted(titles):
        mine = [row for row in rows if row.page == name]
        quantities = "; ".join(dict.fromkeys(row.quantity for row in mine))
        body.append((f"[{titles[name]}]({name}.md)", str(len(mine)), quantities))
    return table(("page", "comparisons", "of"), body)


def agreement_table(titles: Mapping[str, str], rows: Sequence[Comparison]) -> str:
    """Number of rows in dB of every page, and of those that differ by at most 0.1 dB.

    >>> row = Comparison(page="p", case="disc", quantity="RCS, dBsm", expected=20.48,
    ...     measured=20.5, tolerance=0.3, source="theory")
    >>> print(agreement_table({"p": "Page"}, [row]))
    | page | rows in dB | of these within 0.1 dB |
    |---|---:|---:|
    | [Page](p.md) | 1 | 1 |
    | all pages | 1 | 1 |
    """
    levels = [row for row in rows if "dB" in row.quantity]
    close = [row for row in levels if abs(row.measured - row.expected) <= CLOSE_LEVELS]
    body = []
    for name in sorted(titles):
        found = sum(row.page == name for row in levels)
        if found:
            near = sum(row.page == name for row in close)
            body.append((f"[{titles[name]}]({name}.md)", str(found), str(near)))
    body.append(("all pages", str(len(levels)), str(len(close))))
    return table(("page", "rows in dB", "of these within 0.1 dB"), body)


def stamp_table(folder: Path) -> str:
    """Table of the date and code of every record; `tools.renew` writes the stamps."""
    if not (folder / STAMPS).exists():
        return "No record has a stamp yet."
    stamps = json.loads((folder / STAMPS).read_text(encoding="utf-8"))
    body = [(name, row["date"], f"`{row['code']}`") for name, row in sorted(stamps.items())]
    return table(("record", "measured", "hash of the code"), body)


def filled(text: str, blocks: Mapping[str, str]) -> str:
    r"""Page with the text between the marks of every block replaced.

    Raises
    ------
    InputError
        The page marks an unknown block.

    Examples
    --------
    >>> print(filled("Mine.\n<!-- generated: a -->\nold\n<!-- end of a -->\n", {"a": "new"}))
    Mine.
    <!-- generated: a -->
    <BLANKLINE>
    new
    <BLANKLINE>
    <!-- end of a -->
    <BLANKLINE>
    """

    def replaced(found: re.Match[str]) -> str:
        name = found["name"]
        if name not in blocks:
            raise InputError(
                f"there is no generated block '{name}'; there are {', '.join(sorted(blocks))}"
            )
        return f"{found['start']}\n{blocks[name]}\n\n{found['end']}"

    return _BLOCK.sub(replaced, text)


_RECORDED: Final = (
    ("mechanisms", MECHANISMS, mechanism_table),
    ("impairments", IMPAIRMENTS, impairment_table),
    ("mitigations", MITIGATIONS, mitigation_table),
    ("published", PUBLISHED, published_table),
    ("benchmark", BENCHMARK, benchmark_tables),
    ("diversity", DIVERSITY, diversity_table),
    ("statistics", STATISTICS, statistics_table),
    ("ghosts", GHOSTS, ghost_table),
    ("roads", ROADS, road_table),
    ("bodies", BODIES, body_table),
)
"""Blocks of a page, their records, and the functions that make blocks from records."""


def rendered(folder: Path) -> dict[str, str]:
    """All pages of a folder with new tables, by file name.

    If a page has comparisons but no marks for them, the marks are added at its end; a page without
    a file begins with its name as the title.

    Raises
    ------
    InputError
        Two rows of the record compare the same quantity of the same case, or marks name an
        unknown block.
    """
    rows = read_comparisons(folder / RECORD)
    _refuse_twins(rows)
    texts = {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.md"))}
    for name in sorted({row.page for row in rows}):
        text = texts.get(f"{name}.md", f"# {name.replace('-', ' ').capitalize()}\n")
        texts[f"{name}.md"] = text if _MARKS.partition("\n")[0] in text else f"{text}\n{_MARKS}"
    titles = {
        Path(name).stem: text.partition("\n")[0].removeprefix("# ")
        for name, text in texts.items()
        if name != INDEX
    }
    common = {
        "agreement": agreement_table(titles, rows),
        "index": index_table(titles, rows),
        "paper-materials": paper_materials(),
        "sensitivity": sensitivity(),
        "stamps": stamp_table(folder),
    }
    for name, record, made in _RECORDED:
        if (folder / record).exists():
            common[name] = made(folder)
    if (folder / SPEED).exists():
        common |= speed_tables(folder)
    if (folder / LEAGUE).exists():
        common |= league_tables(folder)
    if (folder / RECEIVER).exists():
        common |= receiver_tables(folder)
    if (folder / STREETS).exists():
        common["receiver-streets"] = street_table(folder)
    pages = {}
    for name, text in texts.items():
        mine = [row for row in rows if row.page == Path(name).stem]
        tables = comparison_tables(mine) or "Nothing is compared here yet."
        pages[name] = filled(text, {**common, "comparisons": tables})
    return pages


def rendered_guides(folder: Path) -> dict[str, str]:
    """How-to guides with new tables from the records of a folder, by file name."""
    if not (folder / CHIRP_SEQUENCE).exists():
        return {}
    name = "chirp-sequence.md"
    text = (folder.parent / GUIDES / name).read_text(encoding="utf-8")
    return {name: filled(text, chirp_sequence_tables(folder))}


def _refuse_twins(rows: Sequence[Comparison]) -> None:
    seen = set()
    for row in rows:
        key = (row.page, row.quantity, row.case)
        if key in seen:
            raise InputError(
                f"page '{row.page}' has '{row.quantity}' of '{row.case}' twice; "
                "give the two cases different names"
            )
        seen.add(key)


def write_pages(folder: Path) -> None:
    """Write all pages of a folder with new tables, and the guides beside it."""
    for name, text in rendered(folder).items():
        (folder / name).write_text(text, encoding="utf-8")
    for name, text in rendered_guides(folder).items():
        (folder.parent / GUIDES / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_pages(Path(sys.argv[1]))
