"""The committed schema is the dataclasses', and accepts what the reader accepts."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from polychirp.config.schema import parameter_texts, schema_text, study_schema
from polychirp.model.radar import Radar
from polychirp.study.spec import StudyRadar

ROOT = Path(__file__).parents[3]
STUDIES = [
    path
    for path in sorted((ROOT / "studies").rglob("*.toml"))
    if "street" in tomllib.loads(path.read_text(encoding="utf-8"))
]
"""Other files there describe captures."""
SCHEMA = json.loads((ROOT / "schemas" / "study.schema.json").read_text(encoding="utf-8"))


def problems(data: object) -> list[str]:
    validator = jsonschema.Draft202012Validator(SCHEMA)
    return [error.message for error in validator.iter_errors(data)]


@pytest.fixture
def quickstart() -> dict:
    return tomllib.loads((ROOT / "studies" / "quickstart.toml").read_text(encoding="utf-8"))


def test_the_committed_schema_has_not_drifted():
    committed = (ROOT / "schemas" / "study.schema.json").read_text(encoding="utf-8")
    assert committed == schema_text(), "renew it with: python -m polychirp.config.schema"


def test_there_are_studies_to_look_at():
    assert ROOT / "studies" / "quickstart.toml" in STUDIES


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.name)
def test_the_schema_accepts_every_shipped_study(path):
    assert problems(tomllib.loads(path.read_text(encoding="utf-8"))) == []


def test_the_schema_refuses_an_unknown_key(quickstart):
    assert problems({**quickstart, "sed": 1})


def test_the_schema_refuses_a_bare_number(quickstart):
    quickstart["radars"][0]["start_time"] = 1e-3
    assert problems(quickstart)


def test_the_schema_refuses_an_unknown_kind(quickstart):
    quickstart["defaults"]["radar"]["waveform"]["kind"] = "magic"
    assert problems(quickstart)


def quantities(node: object):
    """Every part of a schema that is a quantity."""
    if isinstance(node, dict):
        if "x-unit" in node:
            yield node
        for child in node.values():
            yield from quantities(child)
    elif isinstance(node, list):
        for child in node:
            yield from quantities(child)


def test_every_quantity_has_a_unit_an_example_and_a_readable_default():
    found = list(quantities(study_schema()))
    assert len(found) > 20
    assert all(entry["type"] == "string" and entry["examples"] for entry in found)
    assert all(isinstance(entry.get("default", ""), str) for entry in found)


def test_a_field_is_described_by_the_docstring_that_declares_it():
    texts = parameter_texts(StudyRadar)
    assert texts["noise_figure"] == parameter_texts(Radar)["noise_figure"] == "ratio, 1 or more"
    assert texts["vehicle"].startswith("name of the vehicle")
