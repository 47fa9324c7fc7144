import re
from html.parser import HTMLParser

import pytest
from rich.console import Console

from polychirp.report import paper
from polychirp.report.figures.drawing import Drawing, new_figure
from polychirp.report.html import page
from polychirp.report.tables import claims_table, variants_table

PNG = b"\x89PNG\r\n\x1a\n made up"
VOID = {"meta", "img", "br"}


class Reader(HTMLParser):
    """Checks that elements close in order; keeps attributes and text."""

    def __init__(self):
        super().__init__()
        self.open, self.links, self.text = [], [], []

    def handle_starttag(self, tag, attrs):
        self.links += [value for name, value in attrs if name in {"src", "href", "srcset"}]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture
def html(results):
    return page(results, {"fig09a": PNG, "fig11b": PNG, "floor-and-masking": PNG})


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
    assert "http" not in html
    assert "<script" not in html
    assert "@import" not in html
    assert "url(" not in html
    assert len(read.links) == 3
    assert all(link.startswith("data:image/png;base64,") for link in read.links)


def test_every_element_of_the_page_is_closed(html, read):
    assert html.startswith("<!DOCTYPE html>")
    assert html.rstrip().endswith("</html>")
    assert read.open == []


def test_names_cannot_break_the_page(html, read):
    assert "<car>" not in html
    assert "far &lt;car&gt;" in html
    assert "far <car>: 21.00 m" in "".join(read.text)
    assert "Made-up numbers &amp; no physics." in html


def test_the_page_says_what_holds_and_what_differs(read):
    text = " ".join(read.text)
    assert "5 of 6 claims" in text
    assert "no target is found at 13.65 m" in text
    assert text.count("as claimed") >= 5


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


def test_everything_is_written_where_it_is_looked_for(results, tmp_path, monkeypatch):
    def blank(*_, **__):
        return Drawing(figure=new_figure(1.0, 1.0), data={"x": [1.0]})

    for name in ("spectrogram", "street_plan", "street_view", "range_profile", "floor_and_masking"):
        monkeypatch.setattr(paper, name, blank)
    told = []
    report = paper.write_paper(results, tmp_path / "new" / "out", progress=told.append)
    assert report.name == "report.html"
    assert report.read_text(encoding="utf-8").count("<img") == 11
    written = {p.relative_to(report.parent).as_posix() for p in report.parent.rglob("*.*")}
    figures = [f"fig{n}" for n in ("04a", "04b", "08-plan", "08-view")]
    figures += [f"fig{n}{s}" for n in ("09", "10", "11") for s in "ab"] + ["floor-and-masking"]
    expected = {f"figures/{name}.{kind}" for name in figures for kind in ("png", "csv")}
    assert written == expected | {"results.json", "report.html"}
    assert [name for name in told if name.endswith(".png")] == [f"figures/{n}.png" for n in figures]


def test_pictures_in_the_page_are_the_files_themselves(html):
    found = re.findall(r"base64,([A-Za-z0-9+/=]+)", html)
    assert len(set(found)) == 1
