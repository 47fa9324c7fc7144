"""docs/validation says what the stored comparisons say, and keeps what people wrote there."""

from dataclasses import replace
from pathlib import Path

import pytest

from polychirp.channel.materials.library import known_materials
from polychirp.errors import InputError
from tools.pages.material_tables import (
    USES,
    amplitudes,
    doubts,
    loss_tangent,
    paper_materials,
    sensitivity,
)
from tools.pages.validation import Comparison, read_comparisons, write_comparisons
from tools.pages.validation_pages import GUIDES, RECORD, rendered, rendered_guides, write_pages

PAGES = Path(__file__).parents[3] / "docs" / "validation"
ROW = Comparison(
    page="bodies", case="disc", quantity="RCS, dBsm", expected=20.48, measured=20.5,
    tolerance=0.3, source="4πA²/λ²",
)  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "bodies.md").write_text(
        "# Bodies\n\nBefore.\n\n<!-- generated: comparisons -->\nold\n"
        "<!-- end of comparisons -->\n\nAfter.\n",
        encoding="utf-8",
    )
    write_comparisons([ROW], tmp_path / RECORD)
    return tmp_path


def test_the_pages_say_what_is_stored():
    """`./run validation` makes them agree again."""
    pages = rendered(PAGES)
    assert set(pages) == {path.name for path in PAGES.glob("*.md")}
    for name, text in pages.items():
        assert (PAGES / name).read_text(encoding="utf-8") == text, name
    guides = rendered_guides(PAGES)
    assert guides
    for name, text in guides.items():
        assert (PAGES.parent / GUIDES / name).read_text(encoding="utf-8") == text, name


def test_all_that_is_stored_was_met():
    """To the six digits that are stored."""
    for row in read_comparisons(PAGES / RECORD):
        slack = 1e-5 * abs(row.expected)
        assert replace(row, tolerance=row.tolerance + slack).is_met, str(row)


def test_what_people_wrote_stays(folder):
    text = rendered(folder)["bodies.md"]
    assert text.startswith("# Bodies\n\nBefore.\n\n<!-- generated: comparisons -->\n")
    assert text.endswith("<!-- end of comparisons -->\n\nAfter.\n")
    assert "old" not in text
    assert "| disc | 20.48 | 20.50 | 0.02 | 0.3 | 4πA²/λ² |" in text


def test_writing_twice_is_writing_once(folder):
    write_pages(folder)
    once = (folder / "bodies.md").read_text(encoding="utf-8")
    write_pages(folder)
    assert (folder / "bodies.md").read_text(encoding="utf-8") == once


def test_a_page_without_marks_or_file_gets_its_table_all_the_same(folder):
    (folder / "bodies.md").write_text("# Bodies\n\nBy hand.\n", encoding="utf-8")
    write_comparisons([ROW, replace(ROW, page="new-page")], folder / RECORD)
    pages = rendered(folder)
    assert pages["bodies.md"].startswith("# Bodies\n\nBy hand.\n")
    assert pages["new-page.md"].startswith("# New page\n")
    assert all("| disc |" in text for text in pages.values())


def test_a_case_compared_twice_is_refused(folder):
    write_comparisons([ROW, replace(ROW, measured=20.4)], folder / RECORD)
    with pytest.raises(InputError, match="page 'bodies' has 'RCS, dBsm' of 'disc' twice"):
        rendered(folder)


def test_a_block_that_nobody_makes_is_refused(folder):
    marks = "<!-- generated: poem -->\n<!-- end of poem -->\n"
    (folder / "bodies.md").write_text(marks, encoding="utf-8")
    with pytest.raises(InputError, match="no generated block 'poem'; there are agreement"):
        rendered(folder)


def test_the_surfaces_of_the_paper_name_their_constants_and_sources():
    text = paper_materials()
    for use, name in USES:
        assert f"| {use} | {name} |" in text
        assert known_materials()[name].source in text


def test_doubts_lie_around_what_is_in_use():
    for doubt in doubts():
        assert doubt.variants[1] == known_materials()[doubt.material]
        low, used, high = (
            (row.relative_permittivity, row.conductivity, row.roughness) for row in doubt.variants
        )
        assert all(a <= b <= c for a, b, c in zip(low, used, high, strict=True))
        assert low != used != high


def test_a_permittivity_moves_with_its_loss_tangent():
    """ε″/ε′ says more of a mixture than ε″."""
    for variant in doubts()[0].variants:
        assert loss_tangent(variant) == pytest.approx(0.1, abs=1e-3)


def test_the_least_rubber_reflects_as_fresnel_says():
    """ε = 2.5 − j0.25 straight on: |(1 − √ε)/(1 + √ε)| = 0.2277 by hand."""
    lossy = (2.5 - 0.25j) ** 0.5
    expected = abs((1 - lossy) / (1 + lossy))
    assert expected == pytest.approx(0.2277, abs=1e-4)
    assert amplitudes(doubts()[0].variants[0])[0] == pytest.approx(expected, abs=1e-4)
    assert "| 2.5 | 0.228 (−2.6 dB) |" in sensitivity()
