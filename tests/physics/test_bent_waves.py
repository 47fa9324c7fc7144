"""Echoes of bodies that move into the shadow of a vehicle, beside quadratures without edges."""

import numpy as np
import pytest
from scipy.special import fresnel

from polychirp.channel.base import all_pairs, gather, strength
from polychirp.channel.bent_echoes.edge_waves import Edges, edge_waves
from polychirp.channel.bent_echoes.paths import bent_echoes
from polychirp.channel.materials.fresnel import sheet
from polychirp.channel.materials.library import known_materials
from polychirp.channel.physical_optics.paths import facet_echoes, mirrored_echoes
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, plate, sphere, transfer_at
from polychirp.units import to_db
from tests.support.references.diffraction import beside_rectangle
from tests.support.references.two_screens import below_a_floor, over_two_screens

FREQUENCY = 79e9
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
WAVENUMBER = 2 * np.pi / WAVELENGTH
BALL = mesh_of(sphere(0.03, 0.0015))
TRACER = Composite(dynamic_range=1e14, reflecting_planes=False)
LAW = "(U/U₀)², Fresnel's integral of a half-plane, Born & Wolf §8.7"


def knife_edge(nu):
    """U/U₀ behind a straight edge."""
    s, c = fresnel(nu)
    return 0.5 * (1 + 1j) * ((0.5 - c) - 1j * (0.5 - s))


def ball_at(place, velocity=(0.0, 0.0, 0.0)):
    # turned, so that no lines of its mesh run along the edge of a shadow and add up
    x, y, z = place
    pose = Pose(x=x, y=y, z=z, yaw=0.3, pitch=0.2)
    return Actor(name="ball", kind="object", mesh=BALL, pose=pose, velocity=velocity)


def screen(size, middle, velocity=(0.0, 0.0, 0.0), name="screen"):
    """A box of ``size`` about ``middle``, m."""
    x, y, z = middle
    mesh = mesh_of(box(size, 0.25))
    pose = Pose(x=x, y=y, z=z)
    return Actor(name=name, kind="vehicle", mesh=mesh, pose=pose, velocity=velocity)


def echoes(scene, *, straight_only=False, bent_only=False):
    """Paths over the ball, straight and bent."""
    world, pairs = TRACER.prepare(scene), all_pairs(scene)
    (body,) = [i for i, actor in enumerate(world.body) if scene.actors[actor].name == "ball"]
    num_radars = len(scene.radars)
    tables = [] if bent_only else [facet_echoes(world, pairs, body=body)]
    if not straight_only:
        nothing = np.zeros((num_radars, num_radars))
        tables.append(bent_echoes(world, pairs, nothing, body=body))
    return gather(tables)


def relative(scene, free, t=0, x=0):
    """V–V transfer over that of the scene without the screen."""
    ends = [transfer_at(echoes(one), FREQUENCY, t, x)[0, 0] for one in (scene, free)]
    return ends[0] / ends[1]


WALL = Actor(
    name="screen",
    kind="vehicle",
    mesh=mesh_of(plate(12.0, 0.25) * [1.0, 10.0, 1.0]),
    pose=Pose(x=10.0, z=-6.0),
)
"""A wide screen without thickness, with its top edge at z = 0, 10 m from a radar at the origin."""


@pytest.mark.parametrize("nu", [-4.0, -2.0, -1.22, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0, 8.0])
def test_the_echo_of_a_ball_follows_the_knife_edge_both_ways(compare, nu):
    """The ball moves down at 20 m behind an edge at 10 m, from the light into the shadow."""
    height = -nu * 2 * np.sqrt(WAVELENGTH * 10.0 * 10.0 / (2 * 20.0))
    ball = ball_at((20.0, 0.0, height))
    found = relative(around([WALL, ball], [(0, 0, 0)]), around([ball], [(0, 0, 0)]))
    compare(
        page="diffraction",
        case=f"ball of 3 cm at 20 m, edge at 10 m, ν = {nu:g}",
        quantity="echo in the shadow of an edge over that without it, dB",
        expected=to_db(abs(knife_edge(nu)) ** 4),
        measured=to_db(abs(found) ** 2),
        tolerance=0.2,
        source=LAW,
    )


def test_at_the_edge_of_the_shadow_the_echo_is_a_sixteenth_and_one_way_a_quarter(compare):
    """Radar 0 sees the ball along the edge, radar 1 from behind the screen."""
    ball = ball_at((20.0, 0.0, 0.0))
    places = [(0.0, 0.0, 0.0), (15.0, 0.0, 0.0)]
    scene, free = around([WALL, ball], places), around([ball], places)
    for receiver, expected in ((0, -12.04), (1, -6.02)):
        compare(
            page="diffraction",
            case=f"ball on the edge of the shadow, {'both ways' if receiver == 0 else 'one way'}",
            quantity="echo in the shadow of an edge over that without it, dB",
            expected=expected,
            measured=to_db(abs(relative(scene, free, 0, receiver)) ** 2),
            tolerance=0.1,
            source="½ at grazing incidence",
        )


@pytest.mark.parametrize("aside", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("height", [-0.1, -0.3])
def test_the_edge_of_large_facets_is_where_the_rays_cross_it(aside, height):
    """From radars beside the axis, the law is that of the same edge, 10 m away across it.

    The screen's facets are 2.5 m wide. From their corners alone it would be several metres deep,
    since it is not quite across the line of sight, and the echo wrong by 7 to 23 dB.
    """
    ball, place = ball_at((20.0, 0.0, height)), (0.0, aside, 0.0)
    found = relative(around([WALL, ball], [place]), around([ball], [place]))
    over, straight = 10.0 + np.hypot(10.0, height), np.hypot(20.0, height)
    detour = np.hypot(over, aside) - np.hypot(straight, aside)
    expected = knife_edge(2 * np.sqrt(detour / WAVELENGTH))
    assert to_db(abs(found) ** 2) == pytest.approx(to_db(abs(expected) ** 4), abs=0.3)


def test_the_echo_fades_without_jumps():
    """In steps of 5 mm, through the edge of the shadow: at most twice what the law changes by."""
    heights = np.arange(0.1, -0.1, -0.005)
    found, law = [], []
    for height in heights:
        ball = ball_at((20.0, 0.0, float(height)))
        scene = around([WALL, ball], [(0, 0, 0)])
        found.append(abs(transfer_at(echoes(scene), FREQUENCY)[0, 0]))
        law.append(abs(knife_edge(-0.5 * height * np.sqrt(2 * 0.2 / WAVELENGTH))) ** 2)
    steps, expected = np.diff(to_db(np.array(found) ** 2)), np.diff(to_db(np.array(law) ** 2))
    assert np.max(np.abs(steps - expected)) < 0.5
    straight = [
        np.sum(strength(echoes(around([WALL, ball_at((20.0, 0.0, z))], [(0, 0, 0)]),
                               straight_only=True), around([], [(0, 0, 0)])))
        for z in (0.1, -0.1)
    ]  # fmt: skip
    assert straight[0] > 0
    assert straight[1] == 0


CORNERS = [(1.1, 0.3), (1.3, 0.2), (0.9, 0.75), (1.25, 0.85), (1.0, 0.0), (0.0, 0.75), (1.6, 1.0)]


@pytest.mark.parametrize("place", CORNERS)
def test_beside_the_corners_of_a_box_the_field_is_that_of_a_quadrature(compare, place):
    """A thin box of 1.2 m by 0.8 m at 10 m, its middle on the axis; places at 20 m.

    The geometric shadow ends at y = 1.2 m and at z = 0.8 m there.
    """
    y, z = place
    size = (0.002, 1.2, 0.8)
    ball = ball_at((20.0, y, z))
    scene = around([screen(size, (10.0, 0.0, 0.0)), ball], [(0, 0, 0)])
    found = relative(scene, around([ball], [(0, 0, 0)]))
    # the model has no bottom edge: the reference's screen goes on far below
    total = beside_rectangle((-0.6, -4.4), (0.6, 0.4), 10.0, np.array([20.0, y, z]), FREQUENCY)
    compare(
        page="diffraction",
        case=f"box 1.2 m wide, 0.4 m high, at 10 m; ball at 20 m, y = {y:g} m, z = {z:g} m",
        quantity="echo in the shadow of an edge over that without it, dB",
        expected=to_db(abs(total) ** 4),
        measured=to_db(abs(found) ** 2),
        tolerance=0.8,
        source="Kirchhoff integral over the box, by quadrature",
    )


TWO = [
    ((8, 0.5), (11, 0.5), (20, 1.25)),
    ((8, 0.5), (11, 0.5), (20, 0.9)),
    ((8, 0.5), (11, 0.5), (20, 0.6)),
    ((8, 0.5), (11, 0.5), (20, 0.2)),
    ((8, 0.5), (12, 0.45), (20, 0.0)),
    ((5, 0.1), (9, 0.12), (15, 0.1)),
    ((8, 0.5), (8.02, 0.5), (20, 0.2)),
    ((8, 0.9), (11, 0.9), (20, 0.2)),
]


@pytest.mark.parametrize("case", TWO)
def test_a_roof_bends_a_wave_at_both_its_ends(compare, case):
    first, second, end = case
    onwards = np.tile([1.0, 0.0, 0.0], (3, 1))
    outwards = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    far = [[first[0], 50.0], [second[0], 50.0]]
    corner = np.array([[first, second], far, far], dtype=np.float64)
    edges = Edges(onwards, outwards, np.cross(onwards, outwards), corner)
    waves = edge_waves(edges, np.array([[end[0], 0.0, end[1]]]), WAVENUMBER)
    turn = np.exp(-1j * WAVENUMBER * (waves.length[:, 0] - np.hypot(*end)))
    found = waves.is_clear[0] + np.sum(waves.field[:, 0] * turn)
    expected = over_two_screens((0.0, 0.0), (first, second), end, FREQUENCY)
    assert abs(found / expected - 1) < 0.03
    compare(
        page="diffraction",
        case=f"roof from {first} to {second}, point at {end}: depths and heights in m",
        quantity="field behind two edges over that without them, dB",
        expected=to_db(abs(expected) ** 2),
        measured=to_db(abs(found) ** 2),
        tolerance=0.1,
        source="Kirchhoff's integral over both apertures, by sums",
    )


@pytest.mark.parametrize("y", [0.95, 1.15, 1.4, 1.8, 2.25, 2.55])
def test_a_ball_comes_out_from_behind_a_long_box(compare, y):
    """The far end of the side changes the wave over the near end, which it only grazes."""
    car = screen((4.6, 1.8, 4.0), (10.3, 0.0, 0.0))
    ball = ball_at((20.0, y, 0.0))
    found = relative(around([car, ball], [(0, 0, 0)]), around([ball], [(0, 0, 0)]))
    expected = over_two_screens((0.0, 0.0), ((8.0, 0.9), (12.6, 0.9)), (20.0, y), FREQUENCY)
    compare(
        page="diffraction",
        case=f"ball at 20 m, {y:g} m across, behind a box 1.8 m wide from 8 m to 12.6 m",
        quantity="echo in the shadow of an edge over that without it, dB",
        expected=to_db(abs(expected) ** 4),
        measured=to_db(abs(found) ** 2),
        tolerance=0.1,
        source="Kirchhoff's integral over both apertures, by sums",
    )


@pytest.mark.parametrize("depth", [5.0, 15.0])
@pytest.mark.parametrize("height", [0.05, 0.0, -0.3])
def test_a_pane_before_the_edge_weakens_the_echo_as_one_behind_it(depth, height):
    """The echo, straight and bent, crosses 4 mm of glass twice, nearly straight on."""
    ball = ball_at((20.0, 0.0, height))
    mesh = mesh_of(plate(6.0, 0.5), "glass")
    pane = Actor(name="pane", kind="tree", mesh=mesh, pose=Pose(x=depth))
    behind = around([WALL, ball, pane], [(0, 0, 0)])
    found = relative(behind, around([WALL, ball], [(0, 0, 0)]))
    glass = known_materials()["glass"]
    _, _, once, _ = sheet(glass.permittivity(FREQUENCY), glass.thickness, 1.0, FREQUENCY)
    assert to_db(abs(found) ** 2) == pytest.approx(to_db(abs(once) ** 4), abs=0.05)


def test_there_and_back_are_transposed():
    ball = ball_at((20.0, 0.0, -0.2))
    paths = echoes(around([WALL, ball], [(0, 0, 0), (0, 1.5, 0.4)]))
    there, back = (transfer_at(paths, FREQUENCY, *pair) for pair in ((0, 1), (1, 0)))
    np.testing.assert_allclose(there, back.T, rtol=1e-9)


def test_paths_move_as_traced_again(compare):
    """Radar, edge and ball move apart; phases after 1 ms, and directions at the radar."""
    moves = {"ball": (3.0, 1.0, -0.5), "screen": (-2.0, 0.5, 0.4), "radar": (1.0, -1.0, 0.3)}
    later = 1e-3

    def traced(time):
        def at(place, name):
            return tuple(np.array(place) + time * np.array(moves[name]))

        wall = screen((0.002, 40.0, 10.0), at((10.0, 0.0, -5.0), "screen"), moves["screen"])
        ball = ball_at(at((20.0, 1.0, -0.3), "ball"), moves["ball"])
        scene = around([wall, ball], [at((0, 0, 0), "radar")], velocities=[moves["radar"]])
        return echoes(scene, bent_only=True)

    now, then = traced(0.0), traced(later)
    moved = now.delay + later * now.delay_rate + 0.5 * later**2 * now.delay_acceleration
    drifted = now.transfer[:, 0, 0] * (1 + later * now.transfer_drift)
    found = np.sum(drifted * np.exp(-2j * np.pi * FREQUENCY * moved))
    expected = transfer_at(then, FREQUENCY)[0, 0]
    compare(
        page="diffraction",
        case="ball behind a moving edge after 1 ms",
        quantity="power of the error over that of the echo, dB",
        expected=-40.0,
        measured=to_db(abs(found / expected - 1) ** 2),
        tolerance=15.0,
        source="traced again",
    )


MOTIONS = {
    "the roof crosses": ((0.0, 14.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "the roof rises": ((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "the plate rises": ((0.0, 0.0, 0.0), (0.0, 0.0, 3.0), (0.0, 0.0, 0.0)),
    "the radar crosses": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 10.0, 0.0)),
    "all move": ((3.0, 14.0, 1.0), (-5.0, 2.0, 2.0), (8.0, -3.0, 0.5)),
}
"""Velocities of a vehicle, of a body behind it, and of the radar."""


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("depth", [0.01, 3.0])
def test_lengths_over_a_roof_bend_as_new_traces_say(motion, depth):
    """The second derivative is the slope of the rates of two traces, 1 ms apart.

    It is v²/R of each leg across the edge, and of the whole way along it. A small plate is behind a
    screen or a box.
    """
    passing, moving, own = MOTIONS[motion]
    roof = Actor(
        name="roof",
        kind="vehicle",
        mesh=mesh_of(box((depth, 20.0, 20.0), 0.5)),
        pose=Pose(x=10.0 + depth / 2, z=-9.8),
        velocity=passing,
    )
    target = Actor(
        name="plate",
        kind="object",
        mesh=mesh_of(plate(0.02, 0.002)),
        pose=Pose(x=20.0, yaw=np.pi),
        velocity=moving,
    )
    scene, step = around([roof, target], [(0.0, 0.0, 0.0)], velocities=[own]), 5e-4
    early, now, late = (_strongest_bent(scene.at(t)) for t in (-step, 0.0, step))
    slope = SPEED_OF_LIGHT * (late.delay_rate - early.delay_rate) / (2 * step)
    assert SPEED_OF_LIGHT * now.delay_acceleration == pytest.approx(slope, abs=0.05)


def _strongest_bent(scene):
    """The strongest path over an edge to the last body and back."""
    world = Composite(dynamic_range=1e6).prepare(scene)
    paths = bent_echoes(world, all_pairs(scene), np.zeros((1, 1)), body=1)
    return paths.select([np.argmax(np.abs(paths.transfer[:, 0, 0]))])


def test_a_wave_over_the_far_corner_alone_leaves_towards_that_corner():
    """A box that is turned by 0.3 rad, whose far left corner hides the ball, and the near one not.

    Rates are those of the delays 20 µs later. A departure towards the near corner, 55 mrad beside,
    makes them wrong by 0.67 m/s.
    """
    ball, later = ball_at((20.5, 1.3, 0.2)), 20e-6

    def traced(time):
        pose = Pose(x=8.5, y=-6.0 * time, z=-0.1, yaw=0.3)
        mesh = mesh_of(box((2.0, 1.2, 1.2), 0.25))
        car = Actor(name="car", kind="vehicle", mesh=mesh, pose=pose, velocity=(0.0, -6.0, 0.0))
        return echoes(around([car, ball], [(0, 0, 0)]), bent_only=True)

    now, then = traced(0.0), traced(later)
    best = np.argmax(strength(now, around([], [(0, 0, 0)])))
    edge = now.bounce_point[now.bounce_start[best]]
    np.testing.assert_allclose(now.departure[best], edge / np.linalg.norm(edge), atol=1e-3)
    rate = (then.delay[best] - now.delay[best]) / later
    assert SPEED_OF_LIGHT * abs(now.delay_rate[best] - rate) < 0.02


def test_a_bent_echo_meets_edge_ball_and_edge():
    """It is an echo of the ball and no multipath, since an edge only bends the wave."""
    paths = echoes(around([WALL, ball_at((20.0, 0.0, -0.3))], [(0, 0, 0)]))
    assert paths.num_paths > 0
    kinds = paths.bounce_kind.reshape(-1, 3)
    assert np.all(kinds == [Bounce.DIFFRACTION, Bounce.SCATTERING, Bounce.DIFFRACTION])
    assert not np.any(paths.is_mirrored)
    edge = paths.bounce_point.reshape(-1, 3, 3)[:, 0]
    np.testing.assert_allclose(edge, np.broadcast_to([10.0, 0.0, 0.0], edge.shape), atol=0.03)


def test_another_body_before_the_edge_leaves_no_wave():
    ball, cover = ball_at((20.0, 0.0, -0.3)), screen((0.1, 3.0, 3.0), (5.0, 0.0, 0.0), name="cover")
    bent = echoes(around([WALL, ball, cover], [(0, 0, 0)]), bent_only=True)
    powers = np.max(np.abs(bent.transfer) ** 2, axis=(1, 2), initial=0.0)
    open_ = echoes(around([WALL, ball], [(0, 0, 0)]), bent_only=True)
    assert np.sum(powers) < 1e-3 * np.sum(np.abs(open_.transfer[:, 0, 0]) ** 2)


def test_a_body_before_one_edge_leaves_the_wave_of_the_other():
    """A screen of 1 m with a bollard before its left edge, m: the right edge's wave is the same."""
    ball, middle = ball_at((20.0, 0.0, 0.0)), screen((0.5, 1.0, 8.0), (10.0, 0.0, 0.0))
    cover = screen((0.2, 0.2, 3.0), (5.0, 0.25, 0.0), name="cover")
    fields = []
    for actors in ([middle, ball], [middle, ball, cover]):
        bent = echoes(around(actors, [(0, 0, 0)]), bent_only=True)
        sides = np.sign(bent.bounce_point.reshape(-1, 3, 3)[:, (0, 2), 1])
        right = np.all(sides < 0, axis=1)
        fields.append((np.sum(bent.transfer[right, 0, 0]), np.any(sides > 0)))
    (open_, seen), (covered, still_seen) = fields
    assert seen
    assert not still_seen
    assert abs(open_) > 0
    assert covered == pytest.approx(open_, rel=1e-9)


def test_a_wave_passes_below_a_car_by_way_of_the_road(compare):
    """A radar at 0.5 m, a box with a floor at 0.2 m from 8 to 12.6 m, and a ball at 20.6 m.

    The mirrored paths of the tracer are those without the box where their rays pass: the shadow is
    sharp. The true field is that of two slits, in the mean of its power over the lit heights.
    """
    road = Actor(
        name="road",
        kind="building",
        plates=(
            Plate(centre=(15, 0, 0), half_u=(30, 0, 0), half_v=(0, 9, 0), material="metal",
                  part="road"),
        ),
    )  # fmt: skip
    car = screen((4.6, 1.8, 1.2), (10.3, 0.0, 0.8))
    heights = np.arange(0.3, 0.61, 0.05)
    found, expected = [], []
    for height in heights:
        ball = ball_at((20.6, 0.0, float(height)))
        powers = []
        for actors in ([road, car, ball], [road, ball]):
            scene = around(actors, [(0, 0, 0.5)])
            world, pairs = TRACER.prepare(scene), all_pairs(scene)
            paths = mirrored_echoes(world, pairs, np.zeros((1, 1)), body=len(world.body) - 1)
            twice = paths.select(paths.num_bounces == 3)
            powers.append(abs(transfer_at(twice, FREQUENCY)[0, 0]) ** 2)
        found.append(powers[0] / powers[1])
        image, end = (0.0, -0.5), (20.6, float(height))
        expected.append(abs(below_a_floor(image, (8.0, 12.6), 0.2, end, FREQUENCY)) ** 4)
    compare(
        page="diffraction",
        case="ball at 0.3 to 0.6 m behind a car with 0.2 m of clearance, mean power",
        quantity="echo by way of the road over that without the car, both ways, dB",
        expected=to_db(np.mean(expected)),
        measured=to_db(np.mean(found)),
        tolerance=2.0,
        source="Kirchhoff integral over both ends of the gap, by sums",
    )
