"""What the documentation prints is what the code prints."""

import doctest
import re
import tomllib
from pathlib import Path

import pytest

from polychirp.config.load import build, with_defaults
from polychirp.study.random_draw import sample_street
from polychirp.study.spec import Study

ROOT = Path(__file__).parents[3]
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


def test_the_impairments_of_the_guide_are_read_by_a_study():
    guide = (ROOT / "docs/how-to/radars-as-they-are.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(.*?)```", guide, flags=re.DOTALL)
    extra = tomllib.loads(text)["defaults"]["radar"]
    example = tomllib.loads((ROOT / "studies/quickstart.toml").read_text(encoding="utf-8"))
    merged = {**example["defaults"]["radar"], **extra, "waveform": {"kind": "triangular"}}
    for radar in example["radars"]:
        radar.pop("waveform", None)
    study = build(Study, with_defaults({**example, "defaults": {"radar": merged}}))
    radar = study.radars[0]
    assert radar.oscillator.phase_noise.offset[2] == 1e6
    assert radar.front_end.digitiser.gain_control.back_off == pytest.approx(10**0.6)
    assert (radar.leakage[0].delay, radar.bumper.distance) == (0.3e-9, 0.1)
    assert study.radars[0].coding.kind == "time-division"


def test_the_traffic_of_the_guide_is_read_and_can_be_drawn():
    guide = (ROOT / "docs/how-to/monte-carlo.md").read_text(encoding="utf-8")
    text = next(t for t in re.findall(r"```toml\n(.*?)```", guide, re.DOTALL) if "[traffic]" in t)
    example = tomllib.loads((ROOT / "studies/quickstart.toml").read_text(encoding="utf-8"))
    example["street"]["vehicles"] = example["street"]["vehicles"][:1]
    example["radars"] = example["radars"][:1]
    example.pop("victims")
    study = build(Study, with_defaults({**example, **tomllib.loads(text)}))
    one = sample_street(study)
    assert [radar.name for radar in one.radars] == ["front", "carrier-1", "carrier-2"]
    assert len(one.targets) == 5
    assert 0.0 < one.radars[1].start_time < 3e-3
