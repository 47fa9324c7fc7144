"""Every work that a docstring cites by author and year is in the bibliography."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NAME = r"[A-ZÅÖ][\w'-]+"
YEAR = r"1[89]\d\d|20[0-2]\d"
CITED = re.compile(
    rf"(?P<author>{NAME})(?:(?:,| and| &) {NAME}(?: {NAME})?)*(?: et al\.)?,? \(?(?P<year>{YEAR})\b"
)
NO_AUTHORS = {"CODATA", "DBSCAN", "Of"}
"""Words before a year that are no author of a work."""


def cited(text: str) -> set[tuple[str, str]]:
    """First author and year of every work that a text cites."""
    flat = re.sub(r"\s+(?:# )?", " ", text)
    found = {(one["author"], one["year"]) for one in CITED.finditer(flat)}
    return {(author, year) for author, year in found if author not in NO_AUTHORS}


def test_citations_are_found_in_their_usual_forms():
    text = "(Van Trees 2002, 8), Golub and\n    Pereyra 1973; J. Wang (2022), Bazzi et al. 2024, "
    text += "Ling, Chou and Lee 1989"
    assert {year for _, year in cited(text)} == {"2002", "1973", "2022", "2024", "1989"}
    assert ("Golub", "1973") in cited(text)
    assert ("Ling", "1989") in cited(text)


@pytest.mark.parametrize("folder", ["src/polychirp", "tests/physics", "docs/explanation"])
def test_every_cited_work_is_in_the_bibliography(folder):
    page = (ROOT / "docs/reference/bibliography.md").read_text(encoding="utf-8")
    for accented, letter in (('{\\"o}', "ö"), ("{\\'e}", "é")):
        page = page.replace(accented, letter)
    works = re.split(r"\n(?=@)|\n\n", page)
    missing = []
    for path in sorted((ROOT / folder).rglob("*")):
        if path.suffix not in (".py", ".toml", ".md"):
            continue
        for author, year in sorted(cited(path.read_text(encoding="utf-8"))):
            if not any(year in work and author in work for work in works):
                missing.append(f"{path.relative_to(ROOT)}: {author} {year}")
    assert missing == []
