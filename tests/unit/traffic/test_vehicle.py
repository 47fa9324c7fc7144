"""The four bodies: closed where they should be, accurate on curves, of table 1's materials."""

import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial import cKDTree

from polychirp.errors import InputError
from polychirp.model.mesh import Mesh
from polychirp.traffic.mounting import RADAR_STANDOFF, bumper_mount
from polychirp.traffic.shapes import SHAPES
from polychirp.traffic.surface import WAVELENGTH
from polychirp.traffic.vehicle import (
    BUMPER_COARSENESS,
    WHEEL_COARSENESS,
    vehicle_mesh,
    vehicle_size,
)

BODIES = tuple(SHAPES)
COARSE = {"max_edge": 0.15, "coarseness": 3.0}
TUB = {"body", "bonnet", "boot-lid", "underbody"}


def faces_of(mesh: Mesh, *parts: str) -> np.ndarray:
    return np.isin(mesh.part, [k for k, name in enumerate(mesh.parts) if name in parts])


def of_material(mesh: Mesh, *materials: str) -> np.ndarray:
    return np.isin(mesh.material, [k for k, m in enumerate(mesh.materials) if m in materials])


def normals(corners: np.ndarray) -> np.ndarray:
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return cross / np.linalg.norm(cross, axis=1, keepdims=True)


def signed_volume(corners: np.ndarray) -> float:
    """Divergence theorem: a sixth of the sum of a·(b×c), positive if normals point outward."""
    return float(np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def open_edges(face: np.ndarray) -> int:
    """Edges that are not used exactly once in each direction."""
    edges = np.concatenate([face[:, [0, 1]], face[:, [1, 2]], face[:, [2, 0]]])
    forward = {tuple(edge) for edge in edges.tolist()}
    repeated = len(edges) - len(forward)
    return repeated + sum((b, a) not in forward for a, b in forward)


@pytest.mark.parametrize("body", BODIES)
def test_a_vehicle_is_made_of_the_materials_of_table_1(body):
    mesh = vehicle_mesh(body, **COARSE)
    found = {
        name: {mesh.materials[k] for k in np.unique(mesh.material[mesh.part == number])}
        for number, name in enumerate(mesh.parts)
    }
    assert set(mesh.materials) == {"metal", "glass", "rubber", "plastic"}
    for name in ("body", "roof", "cabin", "cab", "box", "bonnet", "boot-lid", "underbody"):
        assert found.get(name, {"metal"}) == {"metal"}
    assert found["front-bumper"] == found["rear-bumper"] == {"plastic"}
    assert found["windscreen"] == {"glass"}
    assert all(m == {"glass"} for name, m in found.items() if "window" in name)
    for end in ("front", "rear"):
        for side in ("left", "right"):
            assert found[f"wheel-{end}-{side}"] == {"rubber"}
            assert found[f"rim-{end}-{side}"] == {"metal"}
    assert found["mirror-left"] == found["mirror-right"] == {"glass", "plastic"}


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("fineness", [COARSE, {}], ids=["coarse", "default"])
def test_the_tub_and_the_wheels_are_closed_and_face_outward(body, fineness):
    mesh = vehicle_mesh(body, **fineness)
    bodies = [TUB] + [
        {f"wheel-{end}-{side}", f"rim-{end}-{side}"}
        for end in ("front", "rear")
        for side in ("left", "right")
    ]
    for parts in bodies:
        chosen = faces_of(mesh, *parts)
        assert open_edges(mesh.face[chosen]) == 0
        assert signed_volume(mesh.corners[chosen]) > 0.01


@pytest.mark.parametrize("body", BODIES)
def test_sheets_face_outward(body):
    """Seen from a point inside, every sheet of cabin and bumpers shows its back."""
    mesh = vehicle_mesh(body, **COARSE)
    shape, normal = SHAPES[body], normals(mesh.corners)
    centre = mesh.corners.mean(axis=1)
    for tier in shape.tiers:
        names = {tier.part, tier.roof_part} | {w.part for w in tier.windows}
        names |= {name.replace("-left", "-right") for name in names}
        middle = np.array([(tier.roof_front.x + tier.roof_rear.x) / 2, 0, tier.height - 0.4])
        chosen = faces_of(mesh, *names)
        assert (((centre - middle) * normal).sum(axis=1)[chosen] > 0).all()
    for part, x in (("front-bumper", shape.metal_front.x - 0.4), ("rear-bumper", -1.0)):
        chosen = faces_of(mesh, part)
        outward = ((centre - np.array([x, 0, 0.45])) * normal).sum(axis=1)[chosen]
        assert (outward > -1e-3).all()
    glass = faces_of(mesh, "mirror-left", "mirror-right") & of_material(mesh, "glass")
    assert (normal[glass, 0] < -0.99).all()


@pytest.mark.parametrize("body", BODIES)
def test_no_facet_is_degenerate_or_turned_over(body):
    """Across an edge of a smooth shell two facets never fold back by more than a right angle.

    The smallest are of 2 mm by 0.5 mm: on the shoulder, above a wheel arch's steep ends.
    """
    mesh = vehicle_mesh(body)
    corners = mesh.corners
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(cross, axis=1).min() > 4e-7
    chosen = faces_of(mesh, *TUB - {"underbody"})
    face, normal = mesh.face[chosen], normals(corners[chosen])
    owner = {}
    for number, (a, b, c) in enumerate(face.tolist()):
        owner[a, b] = owner[b, c] = owner[c, a] = number
    pairs = np.array([(k, owner[b, a]) for (a, b), k in owner.items() if (b, a) in owner])
    assert ((normal[pairs[:, 0]] * normal[pairs[:, 1]]).sum(axis=1) > 0).all()


@pytest.mark.parametrize("body", ["sedan", "van"])
def test_facets_stand_at_most_a_sixty_fourth_of_a_wavelength_off_the_surface(body, closest):
    """The rule of edges, e ≤ ½√(λr/2), means a sagitta of λ/64 = 59 µm.

    Over a cell that curves by one sagitta s in each direction the centroid of a triangle is 16/9 s
    off. The limit of plastic and of wheels grows by the square of their coarseness. The reference
    is a mesh with 0.4 of the edges.
    """
    mesh = vehicle_mesh(body)
    fine = vehicle_mesh(body, max_edge=0.02, coarseness=0.4)
    wheels = faces_of(mesh, *(n for n in mesh.parts if n.startswith(("rim", "wheel"))))
    random = np.random.default_rng(1)
    for materials, some, factor in (
        (("metal", "glass"), ~wheels & ~faces_of(mesh, "underbody"), 1.0),
        (("plastic",), ~wheels, BUMPER_COARSENESS**2),
        (("metal", "rubber"), wheels, WHEEL_COARSENESS**2),
    ):
        chosen = np.flatnonzero(of_material(mesh, *materials) & some)
        centres = mesh.corners[random.choice(chosen, 1500)].mean(axis=1)
        target = fine.corners[of_material(fine, *materials)]
        _, near = cKDTree(target.mean(axis=1)).query(centres, k=40)
        distance = closest(centres[:, None], target[near])[0].min(axis=1)
        limit = factor * WAVELENGTH / 64
        assert np.quantile(distance, 0.95) < 16 / 9 * limit
        assert np.quantile(distance, 0.99) < 2.2 * limit


@pytest.mark.parametrize("body", BODIES)
def test_the_underbody_is_the_same_whatever_the_mesh(body, closest):
    """It is a flat floor at the sill, and straight lines up to the rim.

    The other mesh has a seventh of the edges. Chords of 6 cm are 1.4 mm off an arch of r = 0.37 m;
    the lines, which turn from rib to rib, add as much again.
    """
    coarse, fine = vehicle_mesh(body, **COARSE), vehicle_mesh(body, max_edge=0.02, coarseness=0.4)
    corners, target = (mesh.corners[faces_of(mesh, "underbody")] for mesh in (coarse, fine))
    sill = SHAPES[body].flank.sill
    assert corners[..., 2].min() == pytest.approx(sill)
    is_floor = np.all(np.abs(corners[..., 2] - sill) < 1e-9, axis=1)
    assert np.all(normals(corners[is_floor])[:, 2] < -0.999)
    centres = corners.mean(axis=1)
    _, near = cKDTree(target.mean(axis=1)).query(centres, k=40)
    assert closest(centres[:, None], target[near])[0].min(axis=1).max() < 0.005


def test_edges_on_flats_obey_max_edge():
    """The longest edge of a quadrilateral is its diagonal; the underbody may be thrice as long."""
    for body, max_edge in (("sedan", 0.05), ("truck", 0.1)):
        mesh = vehicle_mesh(body, max_edge=max_edge)
        corners = mesh.corners[~faces_of(mesh, "underbody")]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        # arches shear the flank's quadrilaterals
        assert np.quantile(edges, 0.99) < 1.42 * max_edge
        assert edges.max() < 2 * max_edge


@pytest.mark.parametrize(
    ("body", "length", "width", "height"),
    [
        ("sedan", (4.5, 4.7), (1.75, 1.85), (1.4, 1.5)),
        ("hatchback", (3.9, 4.3), (1.7, 1.8), (1.4, 1.55)),
        ("van", (4.9, 5.6), (1.9, 2.05), (1.9, 2.5)),
        ("truck", (6.5, 8.0), (2.1, 2.5), (2.8, 3.5)),
    ],
)
def test_bodies_have_the_size_of_their_class(body, length, width, height):
    mesh = vehicle_mesh(body, **COARSE)
    bare = mesh.corners[~faces_of(mesh, "mirror-left", "mirror-right")].reshape(-1, 3)
    low, high = bare.min(axis=0), bare.max(axis=0)
    for size, (least, most) in zip(high - low, (length, width, height), strict=True):
        assert least < size < most
    assert low[2] == pytest.approx(0.0, abs=1e-3)
    assert low[0] == pytest.approx(-high[0], abs=1e-3)
    assert vehicle_size(body) == pytest.approx((high[0] - low[0], high[1] - low[1]), abs=0.02)


@pytest.mark.parametrize("body", BODIES)
def test_a_vehicle_is_its_own_mirror_image(body):
    vertex = vehicle_mesh(body, **COARSE).vertex
    order = [np.lexsort(np.round(v, 9).T) for v in (vertex, vertex * [1, -1, 1])]
    assert vertex[order[0]] == pytest.approx((vertex * [1, -1, 1])[order[1]], abs=1e-9)


@pytest.mark.parametrize("body", ["sedan", "hatchback"])
def test_a_car_stays_below_a_hundred_and_five_thousand_facets(body):
    assert 30_000 < vehicle_mesh(body).num_faces < 105_000


@pytest.mark.parametrize("body", BODIES)
def test_the_metal_begins_behind_the_plastic_as_on_real_cars(body):
    mesh = vehicle_mesh(body, **COARSE)
    metal = mesh.corners[of_material(mesh, "metal")][..., 0]
    plastic = mesh.corners[faces_of(mesh, "front-bumper", "rear-bumper")][..., 0]
    assert 0.35 <= plastic.max() - metal.max() <= 0.5
    assert 0.1 <= metal.min() - plastic.min() <= 0.2


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("end", ["front", "rear"])
@pytest.mark.parametrize("azimuth", [-20.0, 0.0, 8.0, 20.0])
def test_the_nearest_metal_is_a_visible_specular_point(body, end, azimuth, closest, blocked):
    """On a smooth convex surface the nearest point faces the radar; nothing opaque hides it.

    A facet's normal differs from the surface's by at most half an edge over the radius:
    e/2r = ¼√(λ/2r), 5° at r = 0.1 m.
    """
    mesh = vehicle_mesh(body)
    turn = math.radians(azimuth) + (0.0 if end == "front" else math.pi)
    tip = SHAPES[body].length / 2 * (1 if end == "front" else -1)
    radar = np.array([tip + 10 * math.cos(turn), 10 * math.sin(turn), 0.5])
    metal = mesh.corners[of_material(mesh, "metal")]
    distance, place = closest(radar, metal)
    number = int(np.argmin(distance))
    sight = (radar - place[number]) / distance[number]
    assert 0.35 <= place[number][2] <= 0.75
    assert normals(metal[number : number + 1])[0] @ sight > math.cos(math.radians(5))
    opaque = mesh.corners[of_material(mesh, "metal", "rubber")]
    assert not blocked(radar, place[number], opaque)


def test_equal_vehicles_share_one_mesh():
    assert vehicle_mesh("van", **COARSE) is vehicle_mesh("van", **COARSE)


def test_a_vehicle_is_the_same_in_every_run():
    program = (
        "from polychirp.traffic.vehicle import vehicle_mesh; from hashlib import sha256;"
        "m = vehicle_mesh('sedan', max_edge=0.15, coarseness=3.0);"
        "print(sha256(m.vertex.tobytes() + m.face.tobytes()).hexdigest())"
    )
    runs = {
        subprocess.run(
            [sys.executable, "-c", program], check=True, capture_output=True, text=True
        ).stdout
        for _ in range(2)
    }
    assert len(runs) == 1


def test_an_unknown_body_is_refused_with_those_there_are():
    with pytest.raises(InputError, match="no body 'bus'; choose among sedan, hatchback"):
        vehicle_mesh("bus")  # type: ignore[arg-type]


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("end", ["front", "rear"])
@pytest.mark.parametrize("offset", [0.0, 0.42])
def test_a_mount_is_just_outside_the_bumper_and_looks_away(body, end, offset, closest, blocked):
    mesh, mount = vehicle_mesh(body), bumper_mount(body, end, offset=offset)
    distance = closest(mount.position, mesh.corners)[0].min()
    assert 0.9 * RADAR_STANDOFF < distance <= RADAR_STANDOFF + 1e-9
    ahead = mount.rotation[:, 0]
    assert ahead[0] == pytest.approx(1.0 if end == "front" else -1.0)
    assert not blocked(mount.position, mount.position + 30 * ahead, mesh.corners)
    assert (mount.y, mount.z) == (offset, 0.5)


def test_a_mount_beside_the_bumper_is_refused_with_its_extent():
    with pytest.raises(InputError, match="does not reach 2 m to the left"):
        bumper_mount("sedan", "front", offset=2.0)
