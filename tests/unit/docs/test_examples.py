"""What the documentation prints is what the code prints."""

import doctest
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from polychirp.cli.init import template
from polychirp.config.load import build, with_defaults
from polychirp.study.random_draw import drawn
from polychirp.study.spec import Study
from tests.support.snippets import blocks_of, pasted

ROOT = Path(__file__).parents[3]
HOW_TO = ROOT / "docs" / "how-to"
PAGES = sorted(
    [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")], key=lambda page: page.as_posix()
)


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_example_of_a_page_runs(page):
    failed, _ = doctest.testfile(
        str(page),
        module_relative=False,
        encoding="utf-8",
        optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE,
    )
    assert failed == 0


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_link_between_pages_leads_somewhere(page):
    shown = re.sub(r"<!--.*?-->", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", shown)
    inner = [target for target in targets if "://" not in target]
    assert [t for t in inner if not (page.parent / t).exists()] == []


def test_the_pages_with_derivations_do_have_examples():
    text = (ROOT / "docs" / "explanation" / "errata.md").read_text(encoding="utf-8")
    assert len(doctest.DocTestParser().get_examples(text)) > 20


def study_with(snippet: str) -> Study:
    """The study of ``polychirp init`` with a snippet of a page in it."""
    tables = tomllib.loads(pasted(template(), snippet))
    tables.pop("monte_carlo")
    return build(Study, with_defaults(tables))


def test_the_impairments_of_the_guide_are_read_by_a_study():
    (block,) = [b for b in blocks_of(HOW_TO / "radars-as-they-are.md") if b.language == "toml"]
    radar = study_with(block.text).radars[0]
    assert radar.oscillator.phase_noise.offset[2] == 1e6
    assert radar.front_end.digitiser.gain_control.back_off == pytest.approx(10**0.6)
    assert (radar.leakage[0].delay, radar.bumper.distance) == (0.3e-9, 0.1)
    assert radar.coding.kind == "time-division"


def test_the_traffic_of_the_guide_is_read_and_can_be_drawn():
    (block,) = [b for b in blocks_of(HOW_TO / "monte-carlo.md") if b.mark == "traffic"]
    study = study_with(block.text)
    street = replace(study.street, vehicles=study.street.vehicles[:1])
    one = drawn(replace(study, street=street, radars=study.radars[:1], victims=()))
    assert [radar.name for radar in one.radars] == ["front", "carrier-1", "carrier-2"]
    assert len(one.targets) == 5
    assert 0.0 < one.radars[1].start_time < 3e-3
