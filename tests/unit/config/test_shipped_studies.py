"""Every study file that is shipped can run."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from polychirp.config.load import load_study
from polychirp.config.monte_carlo import load_plan
from polychirp.model.baseband import no_progress
from polychirp.study.check import check
from polychirp.study.monte_carlo.plan import check_plan
from tools.experiments.ghosts import case

ROOT = Path(__file__).parents[3] / "studies"
FILES = {path: tomllib.loads(path.read_text(encoding="utf-8")) for path in ROOT.rglob("*.toml")}
STUDIES = sorted(
    path for path, tables in FILES.items() if "street" in tables and path.parent.name != "league"
)
"""Other files there describe captures; those of the league are complete with common.toml alone."""
LEAGUE = ROOT / "league"
GRIDS = [path for path in STUDIES if "monte_carlo" in FILES[path]]
GHOSTS = ROOT / "ghosts-start-spread.toml"


@pytest.mark.parametrize("path", [p for p in STUDIES if p not in GRIDS], ids=lambda path: path.stem)
def test_a_shipped_study_passes_its_check(path):
    assert check(load_study(path)).radars


@pytest.mark.slow
@pytest.mark.parametrize("path", GRIDS, ids=lambda path: path.stem)
def test_a_shipped_grid_passes_its_check_at_every_point(path):
    plan = load_plan(path)
    check_plan(plan, progress=no_progress)
    assert len(plan.points) > 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["oncoming", "car-park", "dense", "junction", "paper-b", "paper-c"]
)
def test_a_scenario_of_the_league_passes_its_check(name):
    """Every fifth point: other schemes for both starts. A check of the car park takes long."""
    plan = load_plan(LEAGUE / f"{name}.toml", common=LEAGUE / "common.toml")
    assert len(plan.points) == 32
    check_plan(replace(plan, points=plan.points[::5]), progress=no_progress)


def test_the_study_of_ghosts_is_the_one_that_the_page_shows():
    plan = load_plan(GHOSTS)
    studies = [point.study for point in plan.points]
    assert case("start", 0.02e-6).study in studies
    assert case("start", 0.02e-6, "diverse").study in studies
