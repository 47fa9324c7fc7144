import base64
import io
import json
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from PIL import Image
from rich.console import Console

from polychirp.report import paper
from polychirp.report.figures.drawing import Drawing, new_figure
from polychirp.report.html import page
from polychirp.report.page_data import row_key
from polychirp.report.tables import claims_table, variants_table

VOID = {"meta", "img", "br", "input"}


def picture(size=(8, 6)):
    """A PNG file of many colours."""
    file = io.BytesIO()
    Image.linear_gradient("L").resize(size).convert("RGB").save(file, format="PNG")
    return file.getvalue()


class Reader(HTMLParser):
    """Checks that elements close in order; keeps attributes and text."""

    def __init__(self):
        super().__init__()
        self.open, self.loads, self.links, self.ids, self.text = [], [], [], [], []
        self.data = ""

    def handle_starttag(self, tag, attrs):
        loaded = {"src", "srcset", "data", "poster"} | ({"href"} if tag == "link" else set())
        self.loads += [value for name, value in attrs if name in loaded]
        self.links += [value for name, value in attrs if name == "href"]
        self.ids += [value for name, value in attrs if name == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.data = self.data or data
        else:
            self.text.append(data)


@pytest.fixture
def html(results):
    names = ("fig08-view", "fig09a", "fig11b", "floor-and-masking")
    return page(results, dict.fromkeys(names, picture()))


@pytest.fixture
def read(html):
    reader = Reader()
    reader.feed(html)
    reader.close()
    return reader


def printed(table):
    console = Console(width=200)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


def test_the_page_asks_nobody_for_anything(html, read):
    for address in ("http:", "https:", "@import", "url(", "import(", "fetch("):
        assert address not in html
    assert len(read.loads) == 4
    assert all(link.startswith("data:image/") for link in read.loads)


def test_links_lead_to_places_of_the_page_or_to_files_beside_it(read):
    places = {link[1:] for link in read.links if link.startswith("#")}
    files = {link for link in read.links if not link.startswith("#")}
    assert places <= set(read.ids)
    assert {"question", "claims", "explorer", "conclusion", "fig09a"} <= places
    assert files == {"results.json"} | {
        f"figures/{name}.{kind}"
        for name in ("fig08-view", "fig09a", "fig11b", "floor-and-masking")
        for kind in ("png", "svg", "csv")
    }


def test_every_place_of_the_page_has_a_name_of_its_own(read):
    assert len(set(read.ids)) == len(read.ids)


def test_the_page_has_the_data_of_every_row(read, results):
    """Rows of random starts without interference are those of common starts."""
    data = json.loads(read.data)
    assert {row["key"] for row in data["rows"]} == {row_key(row) for row in results.rows}
    assert all(row["profile"]["power"] and row["map"]["cells"] for row in data["rows"])
    assert data["headline"]["ghost"] == {"range": 6.6}


def test_a_page_without_maps_has_no_explorer(results):
    rows = tuple(replace(row, map=None) for row in results.rows)
    html = page(replace(results, rows=rows), {})
    assert 'id="explorer"' not in html
    assert 'id="headline"' not in html
    assert 'href="#explorer"' not in html


def test_every_element_of_the_page_is_closed(html, read):
    assert html.startswith("<!DOCTYPE html>")
    assert html.rstrip().endswith("</html>")
    assert read.open == []


def test_names_cannot_break_the_page(html, read):
    assert "<car>" not in html
    assert "<1>" not in html
    assert "far &lt;car&gt;" in html
    assert "far <car>: 21.00 m" in "".join(read.text)
    assert "Made-up numbers &amp; no physics." in html


def test_the_page_says_what_holds_and_what_differs(read):
    text = " ".join(read.text)
    assert "5 of 6 claims" in text
    assert "no target is found at 13.65 m" in text
    assert text.count("as claimed") >= 5


def test_the_page_opens_with_the_answer(html, read):
    """The ghost at 6.6 m is 22.5 dB above the strongest target; rises are those of the fixtures."""
    text = " ".join(read.text)
    assert (
        "radar 2 detects a ghost at 6.60 m that is 22 dB stronger than the strongest target" in text
    )
    assert "with diverse slopes it detects no ghosts of interference" in text
    assert "raises the floor by 28 dB; blanking lowers this rise to 3.0 dB" in text
    order = [html.index(f'id="{name}"') for name in ("answer", "question", "claims", "the-street")]
    assert order == sorted(order)


def test_the_page_has_a_fold_for_every_row(html, results):
    assert html.count("<details>") == len(results.rows)


def test_the_page_follows_the_readers_light(html):
    assert "prefers-color-scheme: dark" in html
    assert 'name="viewport"' in html


def test_the_page_says_where_its_numbers_come_from(read):
    text = " ".join(read.text)
    for words in ("seed", "12.3 s", "numpy", "equation 12"):
        assert words in text


def test_the_terminal_shows_the_claims_and_every_variant(results):
    claims = printed(claims_table(results))
    for words in ("11a", "direct 6.60, +22.5 dB", "as claimed", "no target is found at 13.65 m"):
        assert words in claims
    variants = printed(variants_table(results.rows))
    assert variants.count("blanking") == 12
    assert variants.count("fixed slope, different for each radar") == 8


def test_rows_without_an_interferer_are_shown_once(results, make_row):
    """In scenario A no interferer starts, so that both starts are one row."""
    twice = (*results.rows, make_row("A", "radar 1", synchronous=False))
    assert printed(variants_table(twice)) == printed(variants_table(results.rows))
    tables = [page(replace(results, rows=rows), {}) for rows in (results.rows, twice)]
    cells = [html.split('id="cases"')[1].count(">conventional</td>") for html in tables]
    assert cells[0] == cells[1] > 0


def test_everything_is_written_where_it_is_looked_for(results, tmp_path, monkeypatch):
    def blank(*_, **__):
        return Drawing(figure=new_figure(1.0, 1.0), data={"x": [1.0]})

    for name in (
        "spectrogram",
        "street_plan",
        "street_view",
        "range_profile",
        "profile_pair",
        "floor_and_masking",
    ):
        monkeypatch.setattr(paper, name, blank)
    told = []
    report = paper.write_paper(results, tmp_path / "new" / "out", progress=told.append)
    assert report.name == "report.html"
    assert report.read_text(encoding="utf-8").count("<img") == 13  # one on paper only
    written = {p.relative_to(report.parent).as_posix() for p in report.parent.rglob("*.*")}
    figures = [f"fig{n}" for n in ("04a", "04b", "08-plan", "08-view")]
    figures += ["fig11-both", *(f"fig{n}{s}" for n in ("09", "10", "11") for s in "ab")]
    figures += ["floor-and-masking"]
    expected = {f"figures/{name}.{kind}" for name in figures for kind in ("png", "svg", "csv")}
    assert written == expected | {"results.json", "report.html"}
    assert [name for name in told if name.endswith(".png")] == [f"figures/{n}.png" for n in figures]


def test_pictures_in_the_page_have_the_size_of_their_files(results):
    reader = Reader()
    reader.feed(page(results, {"fig08-view": picture((40, 30)), "fig09a": picture((64, 48))}))
    for address, form, size in zip(
        reader.loads, ("JPEG", "PNG"), ((40, 30), (64, 48)), strict=True
    ):
        kind, data = address.split(",")
        assert kind == f"data:image/{form.lower()};base64"
        with Image.open(io.BytesIO(base64.b64decode(data))) as image:
            assert image.format == form
            assert image.size == size
