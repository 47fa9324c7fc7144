"""Transmission through sheets of glass and plastic, and through crowns of leaves."""

import numpy as np
import pytest

from polychirp.channel.materials.fresnel import media_of, sheet, sheet_transmission
from polychirp.channel.materials.library import known_materials
from polychirp.channel.scene.transmission import transmission_matrices
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, plate, sphere, transfer_at
from polychirp.units import to_db

WAVENUMBER = 2 * np.pi * 79e9 / SPEED_OF_LIGHT
TRACER = Composite(dynamic_range=1e12)
ENDS = [(0.0, 0.0, 0.5), (10.0, 0.0, 0.5)]
GLASS = known_materials()["glass"]


def screen(material, *, x=5.0, side=2.0, name="screen", z=0.5, **turn):
    pose = Pose(x=x, z=z, **turn)
    return Actor(name=name, kind="tree", pose=pose, mesh=mesh_of(plate(side, 0.5), material))


def window(**turn):
    """A pane as a `Plate`, which also reflects."""
    pane = Plate(centre=(0, 0, 0), half_u=(0, 1, 0), half_v=(0, 0, 1), material="glass", part="w")
    return Actor(name="pane", kind="building", pose=Pose(x=5.0, z=0.5, **turn), plates=(pane,))


def direct(actors):
    """Transfer times carrier phase of the direct path with the actors, relative to without."""
    found = []
    for scene in (around(actors, ENDS), around([], ENDS)):
        paths = TRACER.trace(scene)
        paths = paths.select((paths.num_bounces == 0) & (paths.transmitter == 0))
        found.append(transfer_at(paths, 79e9, transmitter=0, receiver=1))
    return found[0] / np.where(found[1] == 0, 1.0, found[1])


def slab(cosine):
    """(Ts, Tp) of 4 mm of glass, relative to the same length of air."""
    _, _, s, p = sheet(GLASS.permittivity(79e9), GLASS.thickness, cosine, 79e9)
    return np.array([s, p]) * np.exp(1j * WAVENUMBER * GLASS.thickness * cosine)


@pytest.mark.parametrize("pane", [screen("glass"), window()], ids=["mesh", "plate"])
def test_a_pane_lets_through_what_a_slab_does(pane, compare):
    left = np.diag(direct([pane]))
    np.testing.assert_allclose(left, slab(1.0)[0], rtol=1e-9)
    compare(
        page="materials",
        case=f"4 mm glass as a {'plate' if pane.plates else 'mesh'}, 0°",
        quantity="transmission, amplitude",
        expected=0.5419,
        measured=float(abs(left[0])),
        tolerance=5e-4,
        source="slab of two interfaces (Born & Wolf 1.6.4)",
    )


@pytest.mark.parametrize("angle", [0.3, 0.8, 1.2])
def test_a_turned_pane_parts_the_polarisations(angle):
    """The pane is turned about the vertical: V is across the plane of incidence, H in it."""
    s, p = slab(np.cos(angle))
    left = np.diag(direct([screen("glass", side=6.0, yaw=angle)]))
    np.testing.assert_allclose(left, [s, p], rtol=1e-9)


def test_a_pane_turned_about_the_way_mixes_polarisations():
    """The pane is rolled by 30°, so s is neither V nor H; expected are the projections on both."""
    tilt, roll = 0.7, np.pi / 6
    s, p = slab(np.cos(tilt))
    left = through_of(screen("glass", side=6.0, yaw=tilt), roll)
    c, t = np.cos(roll), np.sin(roll)
    np.testing.assert_allclose(np.abs(left[0, 0]), np.abs(s * c * c + p * t * t), rtol=1e-6)
    np.testing.assert_allclose(np.abs(left[1, 0]), np.abs((s - p) * c * t), rtol=1e-6)


def through_of(actor, roll):
    """Matrix of a leg along x through a body that is turned about x by ``roll``."""
    world = TRACER.prepare(around([actor], ENDS))
    turn = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    object.__setattr__(world, "rotation", turn @ world.rotation)
    return transmission_matrices(world, np.array([ENDS[0]]), np.array([ENDS[1]]))[0]


def test_losses_of_two_panes_multiply():
    panes = [screen("glass"), screen("glass", x=6.0, name="other", yaw=0.4)]
    np.testing.assert_allclose(np.diag(direct(panes)), slab(1.0) * slab(np.cos(0.4)), rtol=1e-9)


@pytest.mark.parametrize("name", ["glass", "plastic", "plexiglass", "plasterboard"])
def test_the_kernel_of_transmission_is_that_of_the_sheet(name):
    row, table = known_materials()[name], media_of((name,), known_materials(), 79e9)
    for cosine in np.linspace(0.02, 1.0, 15):
        _, _, s, p = sheet(row.permittivity(79e9), row.thickness, cosine, 79e9)
        undo = np.exp(1j * WAVENUMBER * row.thickness * cosine)
        found = sheet_transmission(table, 0, cosine, WAVENUMBER)
        np.testing.assert_allclose(found, [s * undo, p * undo], rtol=1e-10)


def test_an_echo_crosses_a_bumper_twice():
    """The echo of a plate behind 3 mm of polypropylene is T² times the echo without it."""
    body = Actor(name="b", kind="object", pose=Pose(x=8, yaw=np.pi), mesh=mesh_of(plate(0.1, 0.05)))
    cover = screen("plastic", x=7.0)
    row = known_materials()["plastic"]
    _, _, once, _ = sheet(row.permittivity(79e9), row.thickness, 1.0, 79e9)
    echo = [
        transfer_at(TRACER.trace(around(actors, [(0, 0, 0)])), 79e9)[0, 0]
        for actors in ([body], [body, cover])
    ]
    assert to_db(abs(echo[1] / echo[0]) ** 2) == pytest.approx(to_db(abs(once) ** 4), abs=1e-2)


def test_a_mirrored_leg_loses_where_it_crosses_a_pane():
    """Only the leg between mirror and ball crosses the pane: paths by the wall cross it once."""
    wall = Actor(
        name="wall",
        kind="building",
        pose=Pose(yaw=-np.pi / 2, y=5.0),
        plates=(
            Plate(centre=(0, 0, 0), half_u=(0, 9, 0), half_v=(0, 0, 9), material="metal", part="w"),
        ),
    )
    ball = Actor(name="ball", kind="object", pose=Pose(x=10), mesh=mesh_of(sphere(0.1, 0.01)))
    # normal to the leg from (5, 5) to (10, 0)
    cover = Actor(
        name="cover",
        kind="tree",
        pose=Pose(x=7.5, y=2.5, yaw=-np.pi / 4),
        mesh=mesh_of(plate(2.0, 0.5), "glass"),
    )
    power = []
    for actors in ([wall, ball], [wall, ball, cover]):
        paths = TRACER.trace(around(actors, [(0, 0, 0)]))
        by_wall = paths.bounce_kind[paths.bounce_start[:-1]] == Bounce.REFLECTION
        paths = paths.select((paths.num_bounces == 2) & by_wall)
        power.append(abs(transfer_at(paths, 79e9)[0, 0]))
    assert power[1] / power[0] == pytest.approx(abs(slab(1.0)[0]), rel=1e-2)


@pytest.mark.parametrize(("start", "inside"), [(0.0, 2.0), (5.0, 1.0)])
def test_leaves_take_their_share_of_the_way_inside(start, inside):
    """A crown of 2 m attenuates by 0.8 dB across, and by half of that from its middle."""
    crown = Actor(name="t", kind="tree", pose=Pose(x=5), mesh=mesh_of(box((2, 3, 3), 1.0), "leaf"))
    world = TRACER.prepare(around([crown], ENDS))
    places = np.array([[start, 0.1, 0.2], [10.0, 0.1, 0.2]])
    for way in (places, places[::-1]):
        left = transmission_matrices(world, way[:1], way[1:], clearance=0.0)[0]
        assert to_db(abs(left[0, 0]) ** 2) == pytest.approx(-0.4 * inside, abs=1e-3)
        np.testing.assert_allclose(left, left[0, 0] * np.eye(2), atol=1e-12)


def test_a_way_within_a_crown_loses_all_along():
    crown = Actor(name="t", kind="tree", mesh=mesh_of(sphere(2.0, 0.2), "leaf"))
    world = TRACER.prepare(around([crown], ENDS))
    left = transmission_matrices(
        world, np.array([[0.0, -0.5, 0]]), np.array([[0.0, 1.0, 0]]), clearance=0.0
    )
    assert to_db(abs(left[0, 0, 0]) ** 2) == pytest.approx(-0.4 * 1.5, abs=1e-3)


def test_a_cover_right_before_one_radar_is_the_same_both_ways():
    """A bumper 1 cm in front of a receiver is its own cover; it counts equally if it transmits."""
    cover = screen("plastic", x=9.99)
    edge = screen("metal", x=5.0, side=1.0, name="edge", z=-0.02)
    paths = TRACER.trace(around([cover, edge], ENDS))
    there, back = (transfer_at(paths, 79e9, *pair) for pair in ((0, 1), (1, 0)))
    np.testing.assert_allclose(there, back.T, rtol=1e-6)


@pytest.mark.parametrize("kind", ["object", "vehicle", "tree"])
def test_what_is_all_leaves_has_no_echo_of_a_surface(kind):
    hedge = Actor(name="hedge", kind=kind, pose=Pose(x=5), mesh=mesh_of(sphere(0.5, 0.2), "leaf"))
    assert TRACER.trace(around([hedge], [(0, 0, 0)])).num_paths == 0
