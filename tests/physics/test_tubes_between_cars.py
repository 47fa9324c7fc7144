"""Bounces between cars: tubes cut where it matters against narrow ones everywhere."""

import numpy as np
import pytest

from polychirp.channel.base import strength
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import scene_of
from polychirp.units import to_db

NARROW = 2.5e-3
"""m: the width to which tubes are cut."""


@pytest.fixture(scope="module")
def powers():
    """Power of the bounced echoes of radar 3 in the paper's street: cut, 2 cm, and narrow, dB."""
    study = paper_study("conventional")
    scene = scene_of(study)
    world = study.tracer.prepare(scene)
    widths = {
        "cut": {"tube": NARROW, "coarsest": 0.02},
        "2 cm": {"tube": 0.02, "coarsest": 0.02},
        "narrow": {"tube": NARROW, "coarsest": NARROW},
    }
    found = {name: tube_paths(world, np.array([[2, 2]]), **width) for name, width in widths.items()}
    return {name: to_db(np.sum(strength(paths, scene))) for name, paths in found.items()}


@pytest.mark.slow
def test_tubes_cut_where_it_matters_bring_what_narrow_ones_do(compare, powers):
    """Within 1 dB, where tubes that are all wide are off by more than 2."""
    compare(
        page="multi-bounce",
        case="radar of the third car in the paper's street, own echoes by way of bodies",
        quantity="power of all bounced paths, dB",
        expected=powers["narrow"],
        measured=powers["cut"],
        tolerance=1.0,
        source="tubes of 2.5 mm everywhere",
    )
    assert abs(powers["2 cm"] - powers["narrow"]) > 2.0
