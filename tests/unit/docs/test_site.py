"""The site shows the pages and docstrings of the repository as they are meant."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("sphinx", reason="the packages of requirements-docs.lock are not installed")
DOCS = Path(__file__).parents[3] / "docs"
sys.path.insert(0, str(DOCS / "extensions"))

import accessibility  # noqa: E402
import docstrings  # noqa: E402
import packages  # noqa: E402
import root_pages  # noqa: E402
import study_file  # noqa: E402


def test_links_lead_to_the_same_pages_from_their_place_on_the_site():
    text = (
        "[a](docs/how-to/plot.md#maps), [b](ARCHITECTURE.md), [c](docs/gallery), [d](https://e.f)"
    )
    page = DOCS / "project" / "readme.md"
    assert root_pages.with_links(text, source=DOCS.parent / "README.md", page=page) == (
        "[a](../how-to/plot.md#maps), [b](architecture.md), [c](../generated/gallery/index.rst), "
        "[d](https://e.f)"
    )


@pytest.mark.parametrize(
    "stub", sorted((DOCS / "project").glob("*.md")), ids=lambda path: path.stem
)
def test_a_stub_names_the_root_page_of_its_name(stub):
    assert root_pages.page_of(root_pages.shown_file(stub.read_text(encoding="utf-8"))) == stub


def test_the_text_of_a_parameter_is_no_type():
    lines = ["Parameters", "----------", "a, b : Hz, |x|", "    more : not a name", "", "`c|d`"]
    assert [*docstrings.escaped(docstrings.parameters(lines))] == [
        "Parameters", "----------", "a, b", "    Hz, \\|x\\|", "    more : not a name", "", "`c|d`",
    ]  # fmt: skip


def test_types_have_no_marks():
    text = "(a: Annotated[float, Unit(symbol='s')], b: list[Annotated[int, [1]]])"
    assert docstrings.without_marks(text) == "(a: float, b: list[int])"


def test_every_package_is_in_a_layer():
    named = {name for names in packages.layers().values() for name in names}
    there = {path.name for path in packages.packages(packages.SOURCE)}
    modules = {path.stem for path in packages.modules(packages.SOURCE)}
    assert there | modules == named


def test_the_page_of_study_files_has_every_table_and_key():
    schema = study_file.study_schema()
    text = "\n".join(study_file.page(schema))
    for name, table in schema["$defs"].items():
        assert f".. _study-{name.lower()}:" in text
        assert all(f"``{key}``" in text for key in table["properties"] if key != "kind")


def test_headings_of_the_sidebar_have_a_level_and_code_can_be_scrolled_by_keys():
    tree = '<p class="caption" role="heading">Start</p><h3 role="heading" aria-level="3">'
    context = {accessibility.TREE: tree, "body": "<pre>x</pre>"}
    accessibility.change(None, "index", "page.html", context, None)
    assert context == {
        accessibility.TREE: tree.replace('role="heading">', 'role="heading" aria-level="2">'),
        "body": '<pre tabindex="0">x</pre>',
    }
