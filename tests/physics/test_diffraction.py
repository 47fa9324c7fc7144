"""Diffraction past knife edges, apertures and obstacles, and extrapolation of its paths."""

import numpy as np
import pytest
from scipy.special import fresnel

from polychirp.channel.base import all_pairs, gather
from polychirp.channel.diffraction.paths import diffracted_paths
from polychirp.channel.diffraction.sight_lines import MAX_ZONES_CLEAR
from polychirp.channel.direct.occluded import visible_line_of_sight
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, plate, transfer_at
from polychirp.units import to_db
from tests.support.new_traces import check_rates
from tests.support.references.diffraction import beside_conductor, beside_obstacle

WAVELENGTH = SPEED_OF_LIGHT / 79e9
ENDS = [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0)]


def edges_of(scene, *, frequency=79e9, dynamic_range=1e12):
    world = Composite(frequency=frequency, dynamic_range=dynamic_range).prepare(scene)
    return diffracted_paths(world, all_pairs(scene))


def direct_field(scene, *, t=0, x=1, frequency=79e9):
    """Transfer from t to x by line of sight and edges together, over the unobstructed V–V one."""
    world = Composite(frequency=frequency, dynamic_range=1e12).prepare(scene)
    pairs = np.array([[t, x]])
    paths = gather([visible_line_of_sight(world, pairs), diffracted_paths(world, pairs)])
    length = np.linalg.norm(scene.radar_position[t] - scene.radar_position[x])
    delay = length / SPEED_OF_LIGHT
    free = np.exp(-2j * np.pi * frequency * delay) / (4 * np.pi * frequency * delay)
    return transfer_at(paths, frequency, t, x) / free


def body(corners, **pose):
    return Actor(name="body", kind="object", mesh=mesh_of(corners), pose=Pose(**pose))


def wall(*rectangles, x):
    """Rectangles (y, z, half y, half z) in the plane at x, of brick."""
    return Actor(
        name="wall",
        kind="building",
        pose=Pose(x=x),
        plates=tuple(
            Plate(centre=(0, y, z), half_u=(0, a, 0), half_v=(0, 0, b), material="brick", part="w")
            for y, z, a, b in rectangles
        ),
    )


def disc_of(radius):
    """A disc in the plane x = 0 as 180 triangles."""
    angle = np.linspace(0, 2 * np.pi, 181)
    rim = np.stack([0 * angle, radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    return np.stack([np.zeros((180, 3)), rim[:-1], rim[1:]], axis=1)


def scale(d1, d2):
    """ν of an edge 1 m off the line of sight."""
    return np.sqrt(2 / WAVELENGTH * (1 / d1 + 1 / d2))


def level(field):
    """Level of a field, dB."""
    return float(to_db(abs(field) ** 2))


def cornu(nu):
    sine, cosine = fresnel(nu)
    return cosine - 1j * sine


def knife_edge(nu):
    """Field behind a half-plane that reaches ν into the way (Born & Wolf §8.7)."""
    return (1 + 1j) / 2 * (0.5 * (1 - 1j) - cornu(nu))


def window(low, high):
    """Field through a slit from ν = low to high."""
    return (1 + 1j) / 2 * (cornu(high) - cornu(low))


@pytest.mark.parametrize("legs", [(5.0, 5.0), (3.0, 17.0)])
@pytest.mark.parametrize("kind", ["metal mesh", "brick plate"])
@pytest.mark.parametrize("nu", [-3.0, -1.5, -0.01, 0.0, 0.01, 0.5, 1.0, 2.0, 4.0])
def test_a_straight_edge_is_fresnels_knife_edge(compare, nu, kind, legs):
    """To 0.1 dB: angles up to 5° cost 0.03 dB (½(1 + cos θ)), half-planes 1° apart 0.02 dB."""
    height = nu / scale(*legs)
    if kind == "metal mesh":
        screen = body(plate(20.0, 20.0), x=legs[0], z=height - 10)
    else:
        screen = wall((0.0, height - 10, 10.0, 10.0), x=legs[0])
    scene = around([screen], [(0, 0, 0), (sum(legs), 0, 0)])
    there, back = direct_field(scene), direct_field(scene, t=1, x=0)
    np.testing.assert_allclose(there, back.T, rtol=1e-9, atol=1e-12)
    compare(
        page="diffraction",
        case=f"{kind}, edge at ν = {nu:g}, {legs[0]:g} m and {legs[1]:g} m from the radars",
        quantity="field over unobstructed, dB",
        expected=level(knife_edge(nu)),
        measured=level(there[0, 0]),
        tolerance=0.1,
        source="Fresnel's integral of a half-plane, Born & Wolf §8.7",
    )


@pytest.mark.parametrize("radius", [0.05, 0.2])
def test_behind_a_disc_there_is_poissons_bright_spot(compare, radius):
    """Paths over all edge points are equally long: U = ½(1 + cos θ), nearly 1."""
    disc = disc_of(radius)
    compare(
        page="diffraction",
        case=f"centre of the shadow of a disc of radius {radius:g} m, 4 m and 6 m from the radars",
        quantity="field over unobstructed",
        expected=1.0,
        measured=float(abs(direct_field(around([body(disc, x=4.0)], ENDS))[0, 0])),
        tolerance=0.003,
        source="Poisson and Arago; Born & Wolf §8.9",
    )


@pytest.mark.parametrize(("low", "high"), [(-0.05, 0.05), (-0.02, 0.2), (0.1, 0.3)])
def test_a_slit_lets_through_a_piece_of_cornus_spiral(compare, low, high):
    slit = wall((0, high + 10, 10, 10), (0, low - 10, 10, 10), x=4.0)
    found = direct_field(around([slit], ENDS))[0, 0]
    expected = window(low * scale(4, 6), high * scale(4, 6))
    compare(
        page="diffraction",
        case=f"slit from {low:g} m to {high:g} m, 4 m and 6 m from the radars",
        quantity="field over unobstructed, dB",
        expected=level(expected),
        measured=level(found),
        tolerance=0.2,
        source="Fresnel's integral of a slit, Born & Wolf §8.7",
    )
    assert abs(found - expected) < 0.01


def test_a_plate_and_a_hole_of_its_size_add_to_the_whole_field(compare):
    """Babinet: the one is open where the other blocks, so their fields add up to the free one."""
    y, z, a, b = 0.1, -0.05, 0.2, 0.15
    hole = wall(
        (y + a + 10, 0, 10, 20), (y - a - 10, 0, 10, 20), (y, z + b + 10, a, 10),
        (y, z - b - 10, a, 10), x=4.0,
    )  # fmt: skip
    parts = [direct_field(around([w], ENDS))[0, 0] for w in (hole, wall((y, z, a, b), x=4.0))]
    compare(
        page="diffraction",
        case="plate 0.4 m by 0.3 m, and a hole of its size",
        quantity="sum of both fields over unobstructed",
        expected=1.0,
        measured=float(abs(sum(parts))),
        tolerance=0.01,
        source="Babinet's principle, Born & Wolf §8.3",
    )


@pytest.mark.parametrize("place", [(0, 0), (0.1, 0.05), (0.2, 0.13), (0.05, 0.3), (0.37, 0.21)])
def test_edges_say_what_the_whole_surface_does(compare, place):
    """A rotated square: edge waves compared with Kirchhoff's integral and with physical optics."""
    pose = Pose(x=4.0, y=place[0], z=place[1], yaw=0.2, pitch=0.1)
    square = Actor(name="square", kind="object", pose=pose, mesh=mesh_of(plate(0.4, 0.4)))
    found = direct_field(around([square], ENDS))
    fine, ends = pose.to_outer(plate(0.4, 4e-3)), np.array(ENDS)
    area = beside_obstacle(fine, *ends, 79e9)
    optics = beside_conductor(fine, *ends, 79e9) * (4 * np.pi * 10 / WAVELENGTH)
    # four corners, each known to half a step of azimuth: 4 · ½ · 1/360 at worst
    assert abs(found[0, 0] - area) < 0.006
    compare(
        page="diffraction",
        case=f"turned square of 0.4 m, {place[0]:g} m and {place[1]:g} m off the line of sight",
        quantity="field over unobstructed, V, dB",
        expected=level(optics[0, 0]),
        measured=level(found[0, 0]),
        tolerance=0.2,
        source="unobstructed field and forward physical optics of the lit side, by quadrature",
    )


@pytest.mark.slow
@pytest.mark.parametrize("middle", [-3.0, 0.0])
def test_a_car_shades_as_its_lit_side_does(compare, middle):
    """The end nearer to a radar reaches farthest into the way; the twin takes the lit end.

    4 dB: four edges in deep shadow add coherently, and half-way the far end counts as much.
    """
    car = body(box((4.5, 1.8, 1.4), 0.1), x=middle)
    ends = np.array([(-8.0, 0.3, 0.35), (8.0, -0.2, 0.35)])
    lit = plate(1.8, 4e-3) * [1, 1, 1.4 / 1.8] + [middle - 2.25, 0, 0]
    expected = beside_obstacle(lit, *ends, 79e9)
    found = direct_field(around([car], ends))[0, 0]
    compare(
        page="diffraction",
        case=f"car-sized box 4.5 m long between two radars, {8 + middle:g} m from the first",
        quantity="field over unobstructed, dB",
        expected=level(expected),
        measured=level(found),
        tolerance=4.0,
        source="Kirchhoff's integral over the lit end, which leaves out the other end",
    )


def test_the_field_is_continuous_where_a_plate_comes_into_the_way():
    """Through the line of sight in steps of 1 cm: 1 − what a window of its size lets through.

    0.012: the paraxial formula is 0.26 rad wrong at an edge 0.5 m off, which makes 3 % of all.
    """
    for y in np.arange(-0.3, 0.3, 0.01):
        moved = wall((y, 0.03, 0.2, 0.15), x=4.0)
        found = direct_field(around([moved], ENDS))[0, 0]
        s = scale(4, 6)
        across, along = window((y - 0.2) * s, (y + 0.2) * s), window(-0.12 * s, 0.18 * s)
        assert abs(found - (1 - across * along)) < 0.012


def test_the_field_is_continuous_where_a_box_comes_into_the_way():
    """|dU/dν| is 1/√2 for an edge (times 1.37 for its ends); a step of 1 cm is 0.15 in ν."""
    fields = []
    for y in np.arange(-0.6, 0.6, 0.01):
        scene = around([body(box((0.5, 0.4, 0.3), 0.25), x=5.0, y=y, z=0.02)], ENDS)
        fields.append(direct_field(scene)[0, 0])
    assert np.max(np.abs(np.diff(fields))) < 2 * 1.37 * 0.01 * scale(4.75, 5.25) / np.sqrt(2)
    assert np.min(np.abs(fields)) < 0.5


def moving(actors):
    return around(actors, ENDS, velocities=[(12.0, 2.0, 0.0), (-9.0, 1.0, 0.5)])


@pytest.mark.parametrize("offset", [0.0, 0.15, 0.3])
def test_edges_foretell_the_next_tenth_of_a_millisecond(offset):
    """Both radars and the obstacle move: errors of extrapolated fields are below −30 dB."""
    later = 1e-4
    obstacle = Actor(
        name="box",
        kind="object",
        velocity=(-3.0, 6.0, 1.0),
        pose=Pose(x=4.0, y=offset, z=0.05),
        mesh=mesh_of(box((0.02, 0.4, 0.3), 0.2)),
    )
    scene = moving([obstacle])
    now, then = edges_of(scene), edges_of(scene.at(later))
    now = now.select(now.transmitter == 0)
    turn = np.exp(-2j * np.pi * 79e9 * (now.delay + now.delay_rate * later))
    foretold = np.sum(now.transfer[:, 0, 0] * turn)
    exact = transfer_at(then, 79e9, 0, 1)[0, 0]
    assert level(foretold / exact - 1) < -30


@pytest.mark.parametrize("offset", [0.0, 0.15, 0.3])
def test_edges_at_one_frequency_foretell_a_gigahertz(offset):
    """Paths of 79 GHz, used at 78.5 … 79.5 GHz, have errors below −30 dB."""
    scene = around([body(box((0.02, 0.4, 0.3), 0.2), x=4.0, y=offset, z=0.05)], ENDS)
    paths = edges_of(scene)
    wrong, right = [], []
    for frequency in np.linspace(78.5e9, 79.5e9, 11):
        exact = transfer_at(edges_of(scene, frequency=frequency), frequency, 0, 1)[0, 0]
        # amplitudes are those of the one frequency
        right.append(exact * frequency / 79e9)
        wrong.append(transfer_at(paths, frequency, 0, 1)[0, 0] - right[-1])
    assert to_db(np.sum(np.abs(wrong) ** 2) / np.sum(np.abs(right) ** 2)) < -30


def test_near_grazing_one_path_says_all():
    """Its delay is that of the direct path, its rate that of the moving ends."""
    scene = moving([body(plate(0.6, 0.6), x=5.0, z=-0.3 - 1e-4)])
    paths = edges_of(scene, dynamic_range=100.0)
    there = paths.select(paths.transmitter == 0)
    assert there.num_paths == 1
    assert set(there.bounce_kind) == {Bounce.DIFFRACTION}
    assert set(there.bounce_actor) == {2}
    excess = there.delay[0] * SPEED_OF_LIGHT - 10.0
    assert abs(excess) < 1e-3
    np.testing.assert_allclose(there.departure[0], [1, 0, 0], atol=0.01)


def test_a_path_over_an_edge_bends_as_both_its_ends_pass_it():
    """Across the edge |v⊥|²/R of both legs, 0.5²/5; along it the ends' line alone, 1²/10.

    The edge is along y. Unfolded about it, the way is straight, with the length
    √(Δy² + (R₁ + R₂)²): a movement of both ends along the edge changes nothing.
    """
    scene = moving([body(plate(0.6, 0.6), x=5.0, z=-0.3 - 1e-4)])
    paths = edges_of(scene, dynamic_range=100.0)
    expected = (0.5**2 / 5.0 + 1.0**2 / 10.0) / SPEED_OF_LIGHT
    assert paths.delay_acceleration == pytest.approx(expected, rel=0.02)


SCREENS = {
    "roof that crosses": ({"x": 4.0, "z": -3.8}, (0.0, 14.0, 0.0), 0.0),
    "roof that rises": ({"x": 4.0, "z": -3.8}, (0.0, 6.0, 3.0), 0.0),
    "side that passes": ({"x": 4.0, "y": -3.8}, (1.0, 5.0, 3.0), 0.0),
    "side that turns": ({"x": 4.0, "y": -3.8}, (1.0, 5.0, 0.0), 0.4),
}
"""Pose, velocity and yaw rate of a square of 8 m whose edge is 0.2 m above or beside the line."""


@pytest.mark.parametrize("kind", SCREENS)
@pytest.mark.parametrize("pair", [(0, 1), (1, 0)])
def test_lengths_and_directions_over_an_edge_follow_new_traces(kind, pair):
    """Second derivative of the length, and rates of both directions, from traces 1 ms apart.

    The corners, 28 Fresnel zones away, add some mrad/s.
    """
    place, velocity, yaw_rate = SCREENS[kind]
    screen = Actor(
        name="screen",
        kind="vehicle",
        mesh=mesh_of(plate(8.0, 0.5)),
        pose=Pose(**place),
        velocity=velocity,
        yaw_rate=yaw_rate,
    )
    scene = moving([screen])
    check_rates(lambda time: _strongest_way(scene.at(time), pair))


def _strongest_way(scene, pair):
    """The strongest path of a pair over edges."""
    paths = edges_of(scene)
    mine = np.flatnonzero((paths.transmitter == pair[0]) & (paths.receiver == pair[1]))
    return paths.select(mine[[np.argmax(np.abs(paths.transfer[mine, 0, 0]))]])


def test_a_bright_spot_lasts_until_its_disc_has_moved():
    """Edge points have the rates vρ(1/d₁ + 1/d₂) cos φ, of which 1/√2 is the spread."""
    disc = Actor(
        name="disc",
        kind="object",
        velocity=(0.0, 10.0, 0.0),
        pose=Pose(x=4.0),
        mesh=mesh_of(disc_of(0.2)),
    )
    paths = edges_of(around([disc], ENDS), dynamic_range=1e4)
    expected = np.sqrt(2) * WAVELENGTH / (2 * np.pi) / (10.0 * 0.2 * (1 / 4 + 1 / 6))
    assert paths.coherence_time == pytest.approx(expected, rel=0.01)
    still = Actor(name="disc", kind="object", pose=Pose(x=4.0), mesh=mesh_of(disc_of(0.2)))
    assert np.all(np.isinf(edges_of(around([still], ENDS)).coherence_time))


def test_what_mirrors_is_no_edge_in_the_way():
    """A road below both radars and a wall beside them, close to the line of sight."""
    road = Actor(
        name="road",
        kind="road",
        plates=(
            Plate(
                centre=(5, 0, -0.1),
                half_u=(9, 0, 0),
                half_v=(0, 4, 0),
                material="asphalt",
                part="r",
            ),
        ),
    )
    assert edges_of(around([road], ENDS)).num_paths == 0
    side = body(plate(4.0, 1.0), x=5.0, y=-0.1, yaw=np.pi / 2)
    assert edges_of(around([side], ENDS)).num_paths == 0


def test_what_is_far_from_the_line_of_sight_makes_no_paths():
    """The edge is beyond the zones searched; and a radar has no direct path to itself."""
    height = np.sqrt(MAX_ZONES_CLEAR * WAVELENGTH * 5 * 5 / 10)
    for gap, expected in ((1.02, 0), (0.8, 2)):
        post = body(plate(0.4, 0.4), x=5.0, z=gap * height + 0.2)
        paths = edges_of(around([post], ENDS), dynamic_range=1e6)
        assert (paths.num_paths > 0) == (expected > 0)
        assert np.all(paths.transmitter != paths.receiver)


def test_a_bumper_is_no_obstacle():
    screen = Actor(
        name="s", kind="object", pose=Pose(x=5.0), mesh=mesh_of(plate(0.5, 0.5), "plastic")
    )
    assert edges_of(around([screen], ENDS)).num_paths == 0


def test_the_skins_of_two_radars_are_not_in_the_way():
    """Each sits 5 mm behind the end of its car, which the other's ends."""
    mesh = mesh_of(box((4, 1.8, 1.4), 0.2))
    cars = [
        Actor(name=name, kind="vehicle", mesh=mesh, pose=Pose(x=x))
        for name, x in (("a", -1.995), ("b", 21.995))
    ]
    scene = around(cars, [(0, 0, 0), (20, 0, 0)])
    assert abs(direct_field(scene)[0, 0] - 1) < 0.03


def test_where_a_slanting_skin_ends_to_be_one_there_is_no_edge():
    """A cover 5 mm before a radar, 45° to the way, goes on far beyond the skin's 2 cm."""
    cover = body(plate(1.0, 1.0), x=0.005, yaw=np.pi / 4)
    assert abs(direct_field(around([cover], ENDS))[0, 0] - 1) < 0.05


def test_of_two_equal_edges_one_counts():
    """The stated limit: ½ at grazing, where two edges a third of the way each have ⅓."""
    screens = [wall((0, -10, 10, 10), x=x) for x in (10 / 3, 20 / 3)]
    screens[1] = Actor(
        name="second", kind="building", pose=screens[1].pose, plates=screens[1].plates
    )
    assert abs(direct_field(around(screens, ENDS))[0, 0]) == pytest.approx(0.5, abs=0.01)
