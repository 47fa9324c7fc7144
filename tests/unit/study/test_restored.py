"""A study comes back from the text that its results are stored with."""

import json
from pathlib import Path

import pytest

from polychirp.bounded_text import toml_tables
from polychirp.cli.init import TEMPLATES, template
from polychirp.config.load import build, load_study, with_defaults
from polychirp.errors import InputError
from polychirp.study.paper.scenarios import WAVEFORMS, paper_study
from polychirp.study.provenance import canonical_json
from polychirp.study.restored import restored
from polychirp.study.spec import Study
from polychirp.waveform import AnyWaveform

STUDIES = sorted((Path(__file__).parents[3] / "studies").rglob("*.toml"))


def again(study: Study) -> Study:
    return restored(Study, json.loads(canonical_json(study)))


@pytest.mark.parametrize(
    "path",
    [path for path in STUDIES if path.parent.name not in ("captures", "league")],
    ids=lambda path: path.stem,
)
def test_the_studies_of_the_repository_come_back(path):
    study = load_study(path)
    assert again(study) == study


@pytest.mark.parametrize("name", TEMPLATES)
def test_the_templates_come_back(name):
    tables = toml_tables(template(name))
    tables.pop("monte_carlo", None)
    study = build(Study, with_defaults(tables))
    assert again(study) == study


@pytest.mark.parametrize("waveform", WAVEFORMS)
def test_the_street_of_the_paper_comes_back(waveform):
    assert again(paper_study(waveform)) == paper_study(waveform)


def test_an_unknown_kind_is_refused():
    with pytest.raises(InputError, match="nothing of the kind 'square'"):
        restored(AnyWaveform, {"kind": "square"})
