"""Number plates, beams, lamps and rims: their sizes, their sides, and that each can be left out."""

from dataclasses import fields

import numpy as np
import pytest

from polychirp.config.dump import as_tables
from polychirp.config.load import build
from polychirp.errors import InputError
from polychirp.model.radar import Radar
from polychirp.traffic.fittings import PLATE_SIZE, Fittings
from polychirp.traffic.mounting import bumper_mount
from polychirp.traffic.street import Street, Vehicle
from polychirp.traffic.vehicle import vehicle_mesh

BODIES = ("sedan", "hatchback", "van", "truck", "articulated-truck")
COARSE = {"max_edge": 0.15, "coarseness": 3.0}
PARTS = {
    "number_plates": ("number-plate-front", "number-plate-rear"),
    "bumper_beams": ("bumper-beam-front",),
    "radiator": ("radiator",),
    "lamps": ("headlamp-left", "headlamp-right", "tail-lamp-left", "tail-lamp-right-cover"),
    "door_handles": ("door-handle-left", "door-handle-right"),
    "tow_bar": ("tow-bar",),
    "exhaust": ("exhaust-left", "exhaust-right"),
}


def corners(mesh, part):
    return mesh.corners[mesh.part == mesh.parts.index(part)]


def mean_normal(faces):
    """Sum of the faces' vector areas, m² ``(xyz,)``."""
    return 0.5 * np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]).sum(axis=0)


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("end", ["front", "rear"])
def test_a_number_plate_has_its_size_and_looks_out_and_up(body, end):
    tilt = np.radians(8.0)
    plate = corners(
        vehicle_mesh(body, fittings=Fittings(plate_tilt=tilt), **COARSE), f"number-plate-{end}"
    )
    area = mean_normal(plate)
    assert np.linalg.norm(area) == pytest.approx(np.prod(PLATE_SIZE), rel=1e-6)
    assert area[1] == pytest.approx(0.0, abs=1e-9)
    assert np.arctan2(area[2], abs(area[0])) == pytest.approx(tilt)
    assert (area[0] > 0) == (end == "front")
    assert np.ptp(plate[..., 1]) == pytest.approx(PLATE_SIZE[0])
    assert plate[..., 2].max() < 1.2  # m, Regulation (EU) 1003/2010


@pytest.mark.parametrize("body", BODIES)
def test_beams_stand_upright_behind_the_plastic_and_before_the_metal(body):
    mesh = vehicle_mesh(body, fittings=Fittings(), **COARSE)
    beam = corners(mesh, "bumper-beam-front")
    normal = np.cross(beam[:, 1] - beam[:, 0], beam[:, 2] - beam[:, 0])
    assert np.all(normal[:, 0] > 0)
    np.testing.assert_allclose(normal[:, 2], 0.0, atol=1e-12)
    assert beam[..., 2].min() == pytest.approx(0.405)
    assert beam[..., 2].max() == pytest.approx(0.505)
    assert corners(mesh, "body")[..., 0].max() < beam[..., 0].min()
    assert beam[..., 0].max() < corners(mesh, "front-bumper")[..., 0].max()


@pytest.mark.parametrize("part", ["headlamp-left", "tail-lamp-left"])
def test_a_lamp_is_a_box_that_is_open_to_its_end(part):
    """The vector areas of a closed box cancel; what is left is the missing face's, reversed."""
    lamp = corners(vehicle_mesh("sedan", fittings=Fittings(), **COARSE), part)
    sign = 1 if part == "headlamp-left" else -1
    np.testing.assert_allclose(mean_normal(lamp), [sign * 2 * 0.11 * 0.075, 0, 0], atol=1e-9)


@pytest.mark.parametrize("name", PARTS)
def test_every_fitting_can_be_left_out(name):
    others = {f.name: False for f in fields(Fittings) if f.name != "plate_tilt"}
    bare = vehicle_mesh("sedan", fittings=Fittings(**others), **COARSE)
    assert bare.num_faces == vehicle_mesh("sedan", **COARSE).num_faces
    fitted = vehicle_mesh("sedan", fittings=Fittings(**{**others, name: True}), **COARSE)
    assert set(PARTS[name]) <= set(fitted.parts) - set(bare.parts)


@pytest.mark.parametrize("body", BODIES)
def test_an_open_rim_is_closed_at_the_brake_disc(body):
    """Tyre, barrel and disc enclose a volume; the spokes stand before it."""
    mesh = vehicle_mesh(body, fittings=Fittings(), **COARSE)
    wheel = np.isin(
        mesh.part, [mesh.parts.index(f"{part}-front-left") for part in ("wheel", "rim")]
    )
    face = mesh.face[wheel]
    edges = np.concatenate([face[:, [0, 1]], face[:, [1, 2]], face[:, [2, 0]]])
    forward = {tuple(edge) for edge in edges.tolist()}
    lonely = np.array([edge for edge in forward if edge[::-1] not in forward])
    tyre = corners(mesh, "wheel-front-left")[..., 1]
    # only the spokes and their cap have open edges, 2 to 5 cm behind the tyre's side
    depth = tyre.max() - mesh.vertex[lonely.ravel(), 1]
    assert 0.019 < depth.min() <= depth.max() < 0.046


@pytest.mark.parametrize("body", BODIES)
def test_fittings_add_few_facets(body):
    smooth = vehicle_mesh(body).num_faces
    assert vehicle_mesh(body, fittings=Fittings()).num_faces < 1.07 * smooth


def test_a_radar_behind_a_number_plate_is_refused():
    car = Vehicle(name="car", x=0.0, y=0.0, fittings=Fittings(), **COARSE)
    low, high, aside = (
        Radar(name="r", mount=bumper_mount("sedan", "front", height=z, offset=y))
        for z, y in ((0.35, 0.0), (0.5, 0.0), (0.35, 0.4))
    )
    street = Street(vehicles=(car,))
    with pytest.raises(InputError, match="'r' is behind the front number plate of 'car'"):
        street.scene([(low, "car")])
    street.scene([(high, "car")])
    street.scene([(aside, "car")])
    bare = Vehicle(name="car", x=0.0, y=0.0, fittings=Fittings(number_plates=False), **COARSE)
    Street(vehicles=(bare,)).scene([(low, "car")])


def test_fittings_need_a_built_in_body():
    with pytest.raises(InputError, match="'v' has fittings and a mesh from a file"):
        Vehicle(name="v", x=0.0, y=0.0, mesh="car.glb", fittings=Fittings())


def test_a_study_file_switches_fittings():
    table = {"name": "car", "x": "0 m", "y": "0 m", "fittings": {"plate_tilt": "2 deg"}}
    car = build(Vehicle, {**table, "fittings": {"plate_tilt": "2 deg", "tow_bar": True}})
    assert car.fittings == Fittings(plate_tilt=np.radians(2.0), tow_bar=True)
    assert build(Vehicle, as_tables(car)) == car
    with pytest.raises(InputError, match="plate_tilt"):
        build(Vehicle, {**table, "fittings": {"plate_tilt": "50 deg"}})
