"""Double bounces over two plates: corners whole and finite, their edges, and moving radars."""

import numpy as np
import pytest

from polychirp.channel.base import all_pairs
from polychirp.channel.materials.fresnel import reflection
from polychirp.channel.materials.library import known_materials
from polychirp.channel.specular.double_plates import corner_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, transfer_at
from polychirp.units import to_db
from tests.support.references.physical_optics import scattered

WAVELENGTH = SPEED_OF_LIGHT / 79e9
ENDLESS = 400.0


def decibels(ratio):
    return float(to_db(ratio))


def corner(
    side=ENDLESS, half=ENDLESS, *, floor="metal", wall="metal", lean=0.0, velocity=(0.0, 0.0, 0.0)
):
    """Floor and wall that meet in the y axis, in front of x = 0; the wall leans back."""
    up = np.array([-np.sin(lean), 0.0, np.cos(lean)])
    plates = (
        Plate(
            centre=(side / 2, 0, 0),
            half_u=(0, half, 0),
            half_v=(-side / 2, 0, 0),
            material=floor,
            part="floor",
        ),
        Plate(
            centre=tuple(side / 2 * up),
            half_u=(0, half, 0),
            half_v=tuple(side / 2 * up),
            material=wall,
            part="wall",
        ),
    )
    return Actor(name="corner", kind="building", plates=plates, velocity=velocity)


def traced(actors, places, *, dynamic_range=1e14, velocities=None):
    scene = around(actors, places, velocities=velocities)
    return corner_paths(Composite(dynamic_range=dynamic_range).prepare(scene), all_pairs(scene))


def pair(paths, transmitter, receiver):
    return paths.select((paths.transmitter == transmitter) & (paths.receiver == receiver))


@pytest.mark.parametrize("angle", [20.0, 45.0, 65.0])
@pytest.mark.parametrize(("number", "sign"), [(0, -1.0), (1, 1.0)], ids=["V", "H"])
def test_an_endless_corner_shows_the_radar_at_twice_the_distance(compare, angle, number, sign):
    """The edge is in the middle of the opening in both orders; each gives ½.

    A field along the edge (H) turns over at both mirrors and comes back as sent; one across it (V)
    is turned by 180° on the way, so it comes back reversed: the signs of a dihedral.
    """
    distance, a = 10.0, np.radians(angle)
    paths = traced([corner()], [(distance * np.cos(a), 0, distance * np.sin(a))])
    assert paths.num_paths == 2
    assert paths.delay * SPEED_OF_LIGHT == pytest.approx(2 * distance, abs=1e-9)
    whole = transfer_at(paths, 79e9) * np.exp(4j * np.pi * distance / WAVELENGTH)
    image = whole[number, number] / (WAVELENGTH / (8 * np.pi * distance))
    compare(
        page="multi-bounce",
        case=f"endless corner at 10 m, {angle:g}°, {'VH'[number]}",
        quantity="echo over that of a mirror at 10 m, dB",
        expected=0.0,
        measured=decibels(abs(image) ** 2),
        tolerance=0.05,
        source="image of the image at twice the distance",
    )
    np.testing.assert_allclose(image, sign, atol=0.01)


@pytest.mark.parametrize("aside", [0.0, 0.02, 0.1, 0.5, 2.0])
def test_both_orders_of_a_corner_sum_to_one_image(compare, aside):
    """For every distance of the ray from the edge, which ends both openings from opposite sides."""
    places = [(7.0, 1.0, 5.0), (7.0 + aside, -3.0, 5.0 - aside)]
    paths = pair(traced([corner()], places), 0, 1)
    image = np.array([-7.0, 1.0, -5.0])
    length = np.linalg.norm(np.array(places[1]) - image)
    assert paths.delay * SPEED_OF_LIGHT == pytest.approx(length, abs=1e-9)
    # the wave is turned into neither polarisation; the sum is the dyad of a half turn
    power = np.linalg.norm(transfer_at(paths, 79e9, 0, 1)) ** 2 / 2
    compare(
        page="multi-bounce",
        case=f"both orders of an endless corner, ray {aside:g} m aside",
        quantity="power over that of one image, dB",
        expected=0.0,
        measured=decibels(power / (WAVELENGTH / (4 * np.pi * length)) ** 2),
        tolerance=0.05,
        source="image theory",
    )


@pytest.mark.parametrize("side", [0.05, 0.1])
def test_a_small_corner_far_away_is_the_textbook_dihedral(compare, side):
    """σ = 8πa⁴/λ², both polarisations."""
    distance = 100.0
    paths = traced([corner(side, side / 2)], [(distance / np.sqrt(2), 0, distance / np.sqrt(2))])
    echo = np.abs(np.diag(transfer_at(paths, 79e9))) ** 2
    for number, name in enumerate("VH"):
        compare(
            page="canonical-bodies",
            case=f"corner of two plates {side:g} m at 100 m, {name}",
            quantity="RCS, dBsm",
            expected=decibels(8 * np.pi * side**4 / WAVELENGTH**2),
            measured=decibels(echo[number] * (4 * np.pi) ** 3 * distance**4 / WAVELENGTH**2),
            tolerance=0.1,
            source="8πa⁴/λ²",
        )


def facets_of(low, high, half, *, pieces):
    """The part of the wall x = 0 between two heights as triangles, m."""
    z = np.linspace(low, high, pieces + 1)
    y = np.linspace(-half, half, pieces + 1)
    y, z = np.meshgrid(y, z, indexing="ij")
    p = np.stack([np.zeros_like(y), y, z], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    both = [np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]
    return np.concatenate([part.reshape(-1, 3, 3) for part in both])


@pytest.mark.parametrize("distance", [5.0, 10.0, 30.0])
@pytest.mark.parametrize("angle", [35.0, 45.0, 50.0])
def test_a_finite_corner_echoes_as_physical_optics_says(compare, distance, angle):
    """One plate lit by the image in the other, brute sum over facets; twice, for both orders.

    What textbooks do for dihedrals, reciprocity included: a radar's own two orders are equal. The
    plate whose far edge ends the opening is summed; the other is an endless mirror.
    """
    side, a = 0.3, np.radians(angle)
    x, z = distance * np.cos(a), distance * np.sin(a)
    # above 45° the wall is the narrower one; the floor is the same, upside down
    ahead, above = (x, z) if angle > 45 else (z, x)
    triangles = facets_of(0.0, side, side / 2, pieces=16)
    radar, image = np.array([ahead, 0.0, above]), np.array([ahead, 0.0, -above])
    total = 2 * scattered(triangles, known_materials()["metal"], image, radar, 79e9)[1, 1]
    expected = decibels(np.abs(total) ** 2 * (4 * np.pi) ** 3 * distance**4 / WAVELENGTH**2)
    paths = traced([corner(side, side / 2)], [(x, 0, z)])
    echo = np.abs(transfer_at(paths, 79e9)[1, 1]) ** 2
    compare(
        page="canonical-bodies",
        case=f"corner of two plates 0.3 m at {distance:g} m, {angle:g}°, H",
        quantity="RCS, dBsm",
        expected=expected,
        measured=decibels(echo * (4 * np.pi) ** 3 * distance**4 / WAVELENGTH**2),
        tolerance=0.05,
        source="physical optics of one plate in the other's mirror, by quadrature",
    )


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_it_does_not_matter_how_the_sides_of_a_plate_are_named(quarters):
    """The floor's axes are turned by multiples of 90°, in a corner without symmetry."""
    whole = corner(0.4, 0.1)
    floor, wall = whole.plates
    u, v = np.array(floor.half_u), np.array(floor.half_v)
    for _ in range(quarters):
        u, v = v, -u
    turned = Plate(
        centre=floor.centre, half_u=tuple(u), half_v=tuple(v), material="metal", part="floor"
    )
    places = [(7.0, 0.05, 3.0), (6.9, 0.2, 3.2)]
    before = traced([whole], places)
    after = traced([Actor(name="c", kind="building", plates=(turned, wall))], places)
    assert before.num_paths == 8
    np.testing.assert_allclose(after.transfer, before.transfer, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("number", [0, 1], ids="VH")
def test_road_and_wall_reflect_with_the_product_of_their_coefficients(compare, number):
    """The two angles of incidence add up to 90°: V is p on both, H is s on both."""
    places = [(6.0, 0.0, 0.6), (9.0, 0.0, 1.4)]
    paths = pair(traced([corner(floor="asphalt", wall="brick")], places), 0, 1)
    image = np.array([-6.0, 0.0, -0.6])
    way = np.array(places[1]) - image
    length = np.linalg.norm(way)
    table = known_materials()
    road = reflection(table["asphalt"], way[2] / length, 79e9)[1 - number]
    wall = reflection(table["brick"], way[0] / length, 79e9)[1 - number]
    # one order has all: the ray passes the edge at 0.26 m, the other order is its shadow
    total = abs(transfer_at(paths, 79e9, 0, 1)[number, number])
    compare(
        page="multi-bounce",
        case=f"corner of road and brick wall, {'VH'[number]}",
        quantity="|Γ|², dB",
        expected=decibels(abs(road * wall) ** 2),
        measured=decibels((total * 4 * np.pi * length / WAVELENGTH) ** 2),
        tolerance=0.05,
        source="Fresnel coefficients and roughness at both angles",
    )


def test_a_corner_that_is_not_square_has_two_images():
    """Plates at 90° + 2°: the images of a radar are turned by ±4° about the edge, by hand."""
    lean = np.radians(2.0)
    place = np.array([8.0, 0.0, 6.0])
    turn = lambda a: np.array(  # noqa: E731
        [
            place[0] * np.cos(a) - place[2] * np.sin(a),
            0.0,
            place[0] * np.sin(a) + place[2] * np.cos(a),
        ]
    )
    paths = traced([corner(lean=lean)], [place])
    images = [turn(2 * (np.pi / 2 + lean)), turn(-2 * (np.pi / 2 + lean))]
    expected = sorted(np.linalg.norm(place - image) for image in images)
    np.testing.assert_allclose(np.sort(paths.delay) * SPEED_OF_LIGHT, expected, rtol=1e-12)
    # the rays miss both plates by a metre and more: what is left is bent at the edge
    assert np.all(np.abs(paths.transfer[:, 1, 1]) < 0.1 * WAVELENGTH / (80 * np.pi))


def test_paths_leave_for_their_first_bounce_and_come_from_their_last():
    places = [(6.0, 2.0, 0.6), (9.0, -3.0, 2.4)]
    scene = around([corner(floor="asphalt", wall="brick")], places)
    paths = corner_paths(Composite().prepare(scene), all_pairs(scene))
    point = paths.bounce_point.reshape(-1, 2, 3)
    for ends, direction, bounce in (
        (paths.transmitter, paths.departure, point[:, 0]),
        (paths.receiver, paths.arrival, point[:, 1]),
    ):
        way = bounce - scene.radar_position[ends]
        way /= np.linalg.norm(way, axis=-1, keepdims=True)
        np.testing.assert_allclose(way, direction, atol=1e-9)
    assert np.all(np.min(np.abs(point[..., [0, 2]]), axis=-1) < 1e-12)
    assert not np.any(paths.is_mirrored)  # one body has both


def test_there_and_back_are_transposed():
    """Also through an oblique pane."""
    pane = Actor(
        name="pane",
        kind="building",
        pose=Pose(x=4.0, z=0.7, yaw=0.3, pitch=0.2),
        plates=(
            Plate(
                centre=(0, 0, 0), half_u=(0, 3, 0), half_v=(0, 0, 0.65), material="glass", part="p"
            ),
        ),
    )
    places = [(6.0, 2.0, 0.6), (9.0, -3.0, 1.4)]
    actors = [corner(floor="asphalt", wall="brick")]
    open_air, paths = traced(actors, places), traced([*actors, pane], places)
    there, back = pair(paths, 0, 1), pair(paths, 1, 0)
    assert there.num_paths == back.num_paths == 2
    ahead, home = (p.bounce_point.reshape(-1, 2, 3) for p in (there, back))
    for one in range(there.num_paths):
        off = np.linalg.norm(home[:, ::-1] - ahead[one], axis=(1, 2))
        other = np.argmin(off)
        assert off[other] < 1e-9
        np.testing.assert_allclose(
            back.transfer[other], there.transfer[one].T, rtol=1e-9, atol=1e-15
        )
    strongest = [np.max(np.abs(pair(p, 0, 1).transfer)) for p in (open_air, paths)]
    assert strongest[1] < 0.9 * strongest[0]


def test_a_box_in_the_way_hides_the_double_bounce():
    """The obstacle is between wall and floor, where only the middle leg passes."""
    place = (8.0, 0.0, 2.0)
    other = (8.0, 0.0, 6.0)
    block = Actor(
        name="block",
        kind="object",
        pose=Pose(x=1.0, z=1.5),
        mesh=mesh_of(box((0.2, 2.0, 0.9), 0.5)),
    )
    free, hidden = (
        pair(traced(actors, [place, other]), 1, 0) for actors in ([corner()], [corner(), block])
    )
    image = WAVELENGTH / (4 * np.pi * 16 * np.sqrt(1.25))
    strong = np.abs(free.transfer[:, 1, 1]) > 0.5 * image
    assert np.sum(strong) == 1
    assert not np.any(np.abs(hidden.transfer[:, 1, 1]) > 0.5 * image)


def test_phases_of_moving_radars_turn_as_the_rates_foretell():
    """Radars and corner move; finite differences of the delay over 0.1 ms."""
    later = 1e-4
    scene = around(
        [corner(floor="asphalt", wall="brick", velocity=(1.0, 0.0, 0.5))],
        [(6.0, 2.0, 0.6), (9.0, -3.0, 2.4)],
        velocities=[(-9.0, 2.0, 0.0), (12.0, 3.0, 1.0)],
    )
    tracer = Composite(dynamic_range=1e14)
    now, then = (corner_paths(tracer.prepare(s), all_pairs(s)) for s in (scene, scene.at(later)))
    assert now.num_paths == then.num_paths == 8
    rate = (then.delay - now.delay) / later
    # in units of cycles per second at 79 GHz, to 0.1 Hz and the second order of 0.1 ms
    np.testing.assert_allclose(79e9 * now.delay_rate, 79e9 * rate, atol=8.0)


def test_weak_paths_are_those_below_the_dynamic_range():
    """The paths that are left out without a shadow test are those below the dynamic range."""
    places = [(6.0, 2.0, 0.6), (9.0, -3.0, 2.4)]
    actors = [corner(floor="asphalt", wall="brick")]
    everything, strong = (traced(actors, places, dynamic_range=d) for d in (1e14, 1e3))
    power = np.max(np.abs(everything.transfer) ** 2, axis=(1, 2))
    for t, x in ((0, 0), (0, 1), (1, 0), (1, 1)):
        mine = (everything.transmitter == t) & (everything.receiver == x)
        expected = np.sum(mine & (power * 1e3 >= np.max(power[mine])))
        assert pair(strong, t, x).num_paths == expected


@pytest.mark.parametrize("turn", [0.0, 10.0, 37.0, 90.0, 137.0, 200.0])
def test_two_walls_that_face_each_other_mirror_the_radar_twice_in_every_direction(turn):
    """Both orders have the amplitude λ/4πd of the images, d twice the distance of the walls.

    Each wall hid its own mirror point or not by rounding, with the direction of the street.
    """
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    walls = [
        Actor(
            name=name,
            kind="building",
            plates=(
                Plate(
                    centre=(-7.3 * side * s + 3.0, 7.3 * side * c - 1.0, 0.0),
                    half_u=(9.0 * side * c, 9.0 * side * s, 0.0),
                    half_v=(0.0, 0.0, 9.0),
                    material="metal",
                    part="wall",
                ),
            ),
        )
        for name, side in (("left", 1.0), ("right", -1.0))
    ]
    places = [(3.0 + 0.4 * c - 1.1 * s, -1.0 + 0.4 * s + 1.1 * c, 0.3)]
    paths = traced(walls, places)
    assert paths.num_paths == 2
    np.testing.assert_allclose(paths.delay * SPEED_OF_LIGHT, 29.2, atol=1e-9)
    endless = SPEED_OF_LIGHT / 79e9 / (4 * np.pi * 29.2)
    np.testing.assert_allclose(np.abs(paths.transfer[:, 0, 0]), endless, rtol=0.02)
