"""``none`` removes an optional value or table of a study."""

from dataclasses import replace

import pytest

from polychirp.config.load import load_study
from polychirp.config.monte_carlo import load_plan
from polychirp.errors import InputError
from tests.support.small_study import SMALL_STUDY

OPTIONAL = """
[receiver.mitigation]
kind = "blanking"
guard = "8 us"
"""


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(SMALL_STUDY + OPTIONAL, encoding="utf-8")
    return path


def test_an_optional_table_is_removed(path):
    whole = load_study(path)
    assert whole.receiver.mitigation is not None
    without = load_study(path, overrides=["receiver.mitigation=none"])
    assert without == replace(whole, receiver=replace(whole.receiver, mitigation=None))


def test_an_optional_key_of_a_table_is_removed(path):
    assert load_study(path).receiver.mitigation.guard is not None
    without = load_study(path, overrides=["receiver.mitigation.guard=none"])
    assert without.receiver.mitigation.guard is None


def test_an_optional_table_of_the_defaults_is_removed_of_one_radar(path):
    table = "defaults.radar"
    changes = [f"{table}.coding.kind=time-division", f"{table}.array.num_transmitters=2"]
    keeps = load_study(path, overrides=changes).radars
    loses = load_study(
        path, overrides=[*changes, "radars.0.coding=none", "radars.0.array.num_transmitters=1"]
    ).radars
    assert [radar.coding is None for radar in keeps] == [False] * len(keeps)
    assert [radar.coding is None for radar in loses] == [True] + [False] * (len(keeps) - 1)


def test_a_grid_may_go_without_an_optional_table(path):
    grid = """
[monte_carlo]
trials = 1
[monte_carlo.grid]
"receiver.mitigation" = ["none", {kind = "blanking"}]
"""
    path.write_text(SMALL_STUDY + grid, encoding="utf-8")
    first, second = load_plan(path).points
    assert first.study.receiver.mitigation is None
    assert second.study.receiver.mitigation is not None
    assert load_study(path, overrides=[first.command.split("'")[1]]) == first.study


def test_text_may_be_none(path):
    study = load_study(path, overrides=["name=none", "street.vehicles.0.mesh=none"])
    assert study.name == "none"
    assert study.street.vehicles[0].mesh.endswith("none")


def test_what_every_study_has_is_not_removed(path):
    with pytest.raises(InputError, match=r"receiver.least_range: 'none' is not a value in m"):
        load_study(path, overrides=["receiver.least_range=none"])
