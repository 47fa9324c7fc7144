"""The table of materials."""

import re

import pytest

from polychirp.channel.materials.fresnel import power_through
from polychirp.channel.materials.library import (
    NamedMaterial,
    check_materials,
    known_materials,
    material_table,
)
from polychirp.channel.tracers.composite import Composite
from polychirp.errors import InputError, ModelWarning
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate


def test_the_papers_materials_are_known():
    needed = {"metal", "glass", "rubber", "plastic", "asphalt", "brick", "wood", "leaf"}
    assert needed <= set(known_materials())


def test_every_material_names_its_source():
    for name, row in known_materials().items():
        assert len(row.source) > 20, name


def test_what_nobody_has_measured_is_called_an_assumption():
    for name in ("rubber", "brick"):
        assert known_materials()[name].source.startswith("ASSUMPTION")


def test_an_unknown_material_is_refused_with_those_that_are_known():
    actor = Actor(name="a", kind="object", mesh=mesh_of(plate(0.1, 0.1), "cheese"), pose=Pose(x=5))
    with pytest.raises(InputError, match=r"no material 'cheese'; use one of asphalt, brick"):
        Composite().trace(around([actor], [(0, 0, 0)]))


def test_a_study_adds_its_own_material():
    own = NamedMaterial(name="cheese", relative_permittivity=3.0)
    assert hash(Composite(materials=(own,))) == hash(Composite(materials=(own,)))
    actor = Actor(
        name="a", kind="object", mesh=mesh_of(plate(0.1, 0.05), "cheese"), pose=Pose(x=-5)
    )
    assert Composite(materials=(own,)).trace(around([actor], [(0, 0, 0)])).num_paths > 0


def test_a_material_outside_its_band_warns_with_the_band():
    expected = (
        "values of material 'glass' are valid from 76 to 81 GHz, but the frequency is 24 GHz; "
        "choose one in this band, or give the study's own values"
    )
    with pytest.warns(ModelWarning, match=re.escape(expected)):
        check_materials(["glass"], material_table(), 24e9)


@pytest.mark.parametrize(
    ("name", "amplitude", "tolerance", "source"),
    [
        ("plastic", 0.932, 1e-3, "3 mm of n = 1.48 − j0.0025 (Zhekov 2020), by hand"),
        ("glass", 0.5419, 1e-3, "4 mm by ITU-R P.2040, by hand"),
        ("brick", 0.0, 0.0, "a half-space lets nothing through"),
    ],
)
def test_a_bumper_lets_through_what_a_pane_does_not(compare, name, amplitude, tolerance, source):
    compare(
        page="materials",
        case=name,
        quantity="|T| straight on",
        expected=amplitude,
        measured=power_through(known_materials()[name], 79e9) ** 0.5,
        tolerance=tolerance,
        source=source,
    )
