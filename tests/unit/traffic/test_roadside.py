"""Roads, buildings and trees."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.traffic.street import Building, Road, Tree


def test_every_face_of_a_building_looks_outward_and_together_they_enclose_it():
    """The fluxes of the normals cancel, and Gauss' theorem gives the volume (the floor adds 0)."""
    house = Building(
        name="b", x=5.0, y=-9.0, length=12.0, width=7.0, height=8.0, heading=0.3
    ).actor()
    areas = [4 * np.cross(p.half_u, p.half_v) for p in house.plates]
    volume = sum(np.dot(p.centre, a) for p, a in zip(house.plates, areas, strict=True)) / 3
    assert volume == pytest.approx(12.0 * 7.0 * 8.0)
    assert np.sum(areas, axis=0) == pytest.approx([0.0, 0.0, 12.0 * 7.0])
    for plate in house.plates:
        assert np.dot(plate.normal, np.subtract(plate.centre, (0, 0, 4.0))) > 0
        assert np.dot(plate.half_u, plate.half_v) == pytest.approx(0.0)
        assert plate.material == "brick"
    assert house.kind == "building"


def test_windows_stand_just_before_the_long_walls():
    house = Building(name="b", x=0, y=0, length=10.0, width=6.0, height=6.0, num_windows=3).actor()
    panes = [p for p in house.plates if p.material == "glass"]
    assert len(panes) == 6
    for pane in panes:
        assert abs(pane.centre[1]) == pytest.approx(3.01)
        assert np.dot(pane.normal, pane.centre) > 0
        assert 0 < pane.centre[2] - pane.half_v[2] < pane.centre[2] + pane.half_v[2] < 6


def test_windows_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="9 windows do not fit into building 'b'"):
        Building(name="b", x=0, y=0, length=10.0, width=6.0, height=6.0, num_windows=9).actor()


def test_a_building_without_size_is_refused():
    with pytest.raises(InputError, match="building 'b' needs a positive"):
        Building(name="b", x=0, y=0, length=0.0, width=6.0, height=6.0).actor()


def test_a_road_looks_up_and_lies_where_it_is_put():
    street = Road(length=60.0, width=8.0, x=10.0).actor()
    (plate,) = street.plates
    assert plate.normal == pytest.approx([0, 0, 1])
    assert (street.pose.x, plate.material, street.kind) == (10.0, "asphalt", "road")
    with pytest.raises(InputError, match="a road needs"):
        Road(length=-1.0, width=8.0).actor()


def test_a_tree_has_a_closed_trunk_of_wood_below_a_closed_crown_of_leaves():
    mesh = Tree(name="t", x=0, y=0, height=6.0, crown_radius=1.3).actor().mesh
    assert mesh.parts == ("trunk", "crown")
    assert mesh.materials == ("wood", "leaf")
    for part, volume in ((0, 0.2), (1, 4 / 3 * np.pi * 1.3 * 1.3 * 1.69)):
        a, b, c = np.moveaxis(mesh.corners[mesh.part == part], 1, 0)
        found = np.einsum("fi,fi->", a, np.cross(b, c)) / 6
        assert found == pytest.approx(volume, rel=0.5 if part == 0 else 0.05)
    assert mesh.vertex[:, 2].min() == pytest.approx(0.0)
    assert mesh.vertex[:, 2].max() == pytest.approx(6.0)
    assert np.hypot(*mesh.vertex[:, :2].T).max() == pytest.approx(1.3, rel=0.02)


def test_a_crown_wider_than_the_tree_is_high_is_refused():
    with pytest.raises(InputError, match="tree 't' needs a positive crown radius, and a crown"):
        Tree(name="t", x=0, y=0, height=2.0, crown_radius=1.0).actor()
