"""Every kind of ghost that the scoring names has a row and a mark in the paper's results."""

from typing import get_args

from polychirp.report.figures.range_profile import GHOST_MARKS
from polychirp.scoring.causes import Nature
from polychirp.study.paper.results import GhostKind
from polychirp.study.paper.scenarios import _kind

GHOSTS = {nature.value for nature in Nature if nature.is_ghost}


def test_every_ghost_has_a_kind_and_a_mark() -> None:
    assert {_kind(nature) for nature in GHOSTS} == GHOSTS == set(get_args(GhostKind))
    assert set(GHOST_MARKS) == GHOSTS
