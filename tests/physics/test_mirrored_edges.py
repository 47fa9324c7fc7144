"""Waves by way of a mirror over the edges of what stands in front of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import fresnel

from polychirp.channel.base import gather
from polychirp.channel.diffraction.mirrored_paths import diffracted_mirror_paths
from polychirp.channel.diffraction.paths import diffracted_paths
from polychirp.channel.direct.occluded import visible_line_of_sight
from polychirp.channel.specular.plates import mirror_paths, reflections
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.path_interpolation import interpolate_paths
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, plate, transfer_at
from polychirp.units import to_db
from tests.support.new_traces import check_rates
from tests.support.references.diffraction import beside_obstacle
from tests.support.references.two_screens import below_a_floor

FREQUENCY = 79e9
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
ENDS = [(0.0, 0.0, 0.5), (40.0, 0.0, 0.6)]
ROAD = 2
"""Number of the mirror's actor in scenes with two radars."""

FLIP = np.array([1.0, 1.0, -1.0])
"""Takes a point above the plane z = 0 to its image."""


def road(half=60.0, **motion):
    """A metal mirror in the plane z = 0."""
    surface = Plate(
        centre=(20, 0, 0), half_u=(half, 0, 0), half_v=(0, half, 0), material="metal", part="road"
    )
    return Actor(name="road", kind="road", plates=(surface,), **motion)


def curtain(bottom, *, x):
    """A wall across the road that ends at the height ``bottom`` above it."""
    surface = Plate(
        centre=(0, 0, bottom + 6), half_u=(0, 30, 0), half_v=(0, 0, 6), material="brick", part="w"
    )
    return Actor(name="curtain", kind="building", pose=Pose(x=x), plates=(surface,))


def body(corners, **pose):
    return Actor(name="body", kind="object", mesh=mesh_of(corners), pose=Pose(**pose))


def by_the_road(scene, *, t=0, x=1, frequency=FREQUENCY):
    """Paths by way of the road, geometric ones and those over edges."""
    world = Composite(frequency=frequency, dynamic_range=1e12).prepare(scene)
    pairs, none = np.array([[t, x]]), np.zeros((len(scene.radars),) * 2)
    edges = diffracted_mirror_paths(world, pairs, none, actor=ROAD)
    return gather([_of_road(mirror_paths(world, pairs)), edges])


def _of_road(paths):
    return paths.select(paths.bounce_actor == ROAD)


def unobstructed(scene, *, t=0, x=1, frequency=FREQUENCY):
    """Transfer from t to x by way of the road if nothing is in the way."""
    world = Composite(frequency=frequency).prepare(scene)
    found = reflections(world, np.array([[t, x]]), actor=ROAD)
    return transfer_at(found.paths, frequency, t, x)


def relative_field(scene, *, t=0, x=1):
    """V–V transfer from t to x by way of the road, over that without obstacles."""
    field = transfer_at(by_the_road(scene, t=t, x=x), FREQUENCY, t, x)[0, 0]
    return field / unobstructed(scene, t=t, x=x)[0, 0]


def slit(low, high, d1, d2):
    """Field through a slit, from low to high m beside the line of sight (Born & Wolf §8.7)."""
    scale = np.sqrt(2 / WAVELENGTH * (1 / d1 + 1 / d2))
    (s1, c1), (s2, c2) = fresnel(low * scale), fresnel(high * scale)
    return (1 + 1j) / 2 * ((c2 - 1j * s2) - (c1 - 1j * s1))


@pytest.mark.parametrize("bottom", [0.05, 0.1, 0.13, 0.2, 0.4])
def test_below_a_wall_the_road_shows_a_slit_of_twice_its_clearance(compare, bottom):
    """The wall is the upper screen and its image the lower one; the line meets them at −0.09 m.

    0.02: the wall is 60 m wide, and the angles are some degrees.
    """
    scene = around([road(), curtain(bottom, x=15.0)], ENDS)
    there, back = (by_the_road(scene, t=t, x=1 - t) for t in (0, 1))
    ways = [transfer_at(paths, FREQUENCY, t, 1 - t) for t, paths in enumerate((there, back))]
    np.testing.assert_allclose(ways[0], ways[1].T, rtol=1e-9, atol=1e-12)
    height = -0.5 + 15 / 40 * 1.1
    expected = slit(-bottom - height, bottom - height, 15.0, 25.0)
    found = relative_field(scene)
    compare(
        page="diffraction",
        case=f"by way of the road, below a wall that ends {bottom:g} m above it",
        quantity="field over unobstructed, dB",
        expected=float(to_db(abs(expected) ** 2)),
        measured=float(to_db(abs(found) ** 2)),
        tolerance=0.2,
        source="Fresnel's integral of a slit between wall and image, Born & Wolf §8.7",
    )
    assert abs(found - expected) < 0.02


@pytest.mark.parametrize("place", [(0.0, 0.2), (0.3, 0.25), (-0.25, 0.35), (0.1, 0.6)])
def test_a_plate_above_the_road_obstructs_as_it_and_its_image_do(compare, place):
    """Kirchhoff's integral over a square and its image, with the image of the first radar."""
    y, z = place
    square = plate(0.3, 5e-3)
    screen = Actor(
        name="square",
        kind="object",
        pose=Pose(x=12.0, y=y, z=z),
        mesh=mesh_of(plate(0.3, 0.3)),
    )
    found = relative_field(around([road(), screen], ENDS))
    placed = square + np.array([12.0, y, z])
    both = np.concatenate([placed, (placed * FLIP)[:, ::-1]])
    expected = beside_obstacle(both, ENDS[0] * FLIP, np.array(ENDS[1]), FREQUENCY)
    compare(
        page="diffraction",
        case=f"by way of the road, square of 0.3 m at {y:g} m, {z:g} m above it",
        quantity="field over unobstructed, dB",
        expected=float(to_db(abs(expected) ** 2)),
        measured=float(to_db(abs(found) ** 2)),
        tolerance=0.2,
        source="Kirchhoff's integral over the square and its image, by quadrature",
    )
    # eight corners, each known to half a step of azimuth at worst
    assert abs(found - expected) < 0.012


@pytest.mark.parametrize(
    ("clearance", "error"), [(0.15, -10.0), (0.2, -20.0), (0.25, -25.0), (0.3, -25.0)]
)
def test_below_a_car_the_road_lets_through_what_both_ends_of_the_gap_do(compare, clearance, error):
    """A box as long as a car: heights from the lit ones into the dark, by Kirchhoff's two slits.

    The silhouette has one edge for both ends of the floor, whose error grows as the gap narrows.
    """
    found, expected = [], []
    for height in np.arange(0.2, 1.25, 0.05):
        ends = [(0.0, 0.0, 0.5), (20.6, 0.0, height)]
        car = body(box((4.6, 12.0, 1.2), 0.3), x=10.3, z=0.6 + clearance)
        found.append(relative_field(around([road(), car], ends)))
        image, end = (0.0, -0.5), (20.6, float(height))
        expected.append(below_a_floor(image, (8.0, 12.6), clearance, end, FREQUENCY))
    power = np.mean(np.abs(expected) ** 2)
    compare(
        page="diffraction",
        case=f"by way of the road, below a box of 4.6 m with a clearance of {clearance:g} m",
        quantity="mean power over unobstructed, dB",
        expected=float(to_db(power)),
        measured=float(to_db(np.mean(np.abs(found) ** 2))),
        tolerance=0.3,
        source="Kirchhoff's integral over the apertures at both ends of the gap and its image",
    )
    assert to_db(np.mean(np.abs(np.array(found) - expected) ** 2) / power) < error


def unfolded(scene, mesh, flip):
    """The scene without its mirror: the first radar's image, and an image beside the obstacle.

    The image of the obstacle has this ``mesh`` in its frame; ``flip`` takes a point to its image.
    """
    first, second, _, thing = scene.actors
    copies = [
        replace(
            actor,
            name=f"image of {actor.name}",
            pose=_image(actor.pose, flip),
            velocity=tuple(float(v) for v in np.asarray(actor.velocity) * flip),
            yaw_rate=float(flip[1] * actor.yaw_rate),
        )
        for actor in (first, thing)
    ]
    copies[1] = replace(copies[1], mesh=mesh)
    return replace(scene, actors=(copies[0], second, thing, copies[1]), carriers=(0, 1))


def _image(pose, flip):
    place = np.asarray(pose.position) * flip
    return Pose(x=float(place[0]), y=float(place[1]), z=float(place[2]), yaw=flip[1] * pose.yaw)


def wedge():
    """A body without any plane of symmetry, 4 m long."""
    corners = box((4.0, 1.6, 0.9), 0.15)
    return corners * (1.0 + 0.1 * np.sin(corners @ [1.0, 1.3, 2.1]))[..., None]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["road", "wall"])
def test_a_mirror_shows_what_the_unfolded_scene_has(kind, seed):
    """Fields, rates and accelerations are those of images that are built as bodies."""
    draw = np.random.default_rng([31, seed])
    # beside a wall all is turned, so that its height is what the height over the road is
    axes = [0, 1, 2] if kind == "road" else [0, 2, 1]
    flip, corners = FLIP[axes], wedge()[..., axes]
    place = np.array([draw.uniform(8, 30), draw.uniform(-0.9, 0.9), 0.75])[axes].tolist()
    yaw = draw.uniform(-0.3, 0.3) if kind == "road" else 0.0
    thing = Actor(
        name="car",
        kind="object",
        pose=Pose(x=place[0], y=place[1], z=place[2], yaw=yaw),
        velocity=tuple(draw.uniform(-9, 9, 3)),
        yaw_rate=draw.uniform(-1, 1),
        mesh=mesh_of(corners),
    )
    sides = {"road": ((60, 0, 0), (0, 60, 0)), "wall": ((0, 0, 60), (60, 0, 0))}[kind]
    surface = Plate(
        centre=(20, 0, 0), half_u=sides[0], half_v=sides[1], material="metal", part="mirror"
    )
    mirror = Actor(name="mirror", kind="building", plates=(surface,))
    ends = [tuple(np.array(end)[axes]) for end in ENDS]
    moves = [tuple(draw.uniform(-9, 9, 3)) for _ in ends]
    scene = around([mirror, thing], ends, velocities=moves)
    found = by_the_road(scene)
    # a mirrored triangle turns its front to its back, unless its corners are in another order
    apart = unfolded(scene, mesh_of((corners * flip)[:, ::-1]), flip)
    world = Composite(dynamic_range=1e12).prepare(apart)
    pairs = np.array([[0, 1]])
    direct = gather([visible_line_of_sight(world, pairs), diffracted_paths(world, pairs)])
    length = float(np.linalg.norm(ends[1] - ends[0] * flip))
    ratio = unobstructed(scene)[0, 0] * (4 * np.pi * length / WAVELENGTH)
    ratio *= np.exp(2j * np.pi * length / WAVELENGTH)
    expected = np.sum(direct.transfer[:, 0, 0] * np.exp(-2j * np.pi * FREQUENCY * direct.delay))
    measured = np.sum(found.transfer[:, 0, 0] * np.exp(-2j * np.pi * FREQUENCY * found.delay))
    assert measured == pytest.approx(ratio * expected, rel=0.01)
    for of in ("delay", "delay_rate", "delay_acceleration"):
        means = [_mean_over_edges(paths, of) for paths in (direct, found)]
        assert means[1] == pytest.approx(means[0], rel=2e-3), of


def _mean_over_edges(paths, of):
    """Mean of a column of the paths over edges, weighted by their powers."""
    some = paths.select(_bent(paths))
    power = np.abs(some.transfer[:, 0, 0]) ** 2
    return np.sum(power * getattr(some, of)) / np.sum(power)


def _bent(paths):
    """Numbers of the paths that are diffracted."""
    begins = np.flatnonzero(paths.bounce_kind == Bounce.DIFFRACTION)
    return np.searchsorted(paths.bounce_start, begins, side="right") - 1


def test_the_field_is_continuous_where_a_body_comes_into_the_way():
    """A box moves across the reflection in steps of 1 cm; |dU/dν| is 1/√2 for each edge."""
    fields, scale = [], np.sqrt(2 / WAVELENGTH * (1 / 15 + 1 / 25))
    for y in np.arange(-0.8, 0.8, 0.01):
        thing = body(box((0.4, 0.5, 0.6), 0.2), x=15.0, y=y, z=0.35)
        fields.append(relative_field(around([road(), thing], ENDS)))
    assert np.max(np.abs(np.diff(fields))) < 2 * 1.37 * 0.01 * scale / np.sqrt(2)
    assert np.min(np.abs(fields)) < 0.5
    assert abs(abs(fields[0]) - 1) < 0.15


@pytest.mark.parametrize("place", [0.1, 0.35, 0.6])
def test_mirrored_edges_foretell_the_next_tenth_of_a_millisecond(place):
    """Radars, body and mirror move: errors of extrapolated fields are below −30 dB, both ways."""
    later = 1e-4
    thing = Actor(
        name="box",
        kind="object",
        velocity=(-3.0, 6.0, 1.0),
        pose=Pose(x=14.0, y=place, z=0.3),
        mesh=mesh_of(box((0.02, 0.5, 0.4), 0.2)),
    )
    scene = around(
        [road(velocity=(0.0, 0.0, 2.0)), thing],
        ENDS,
        velocities=[(12.0, 2.0, 0.0), (-9.0, 1.0, 0.5)],
    )
    for t in (0, 1):
        now, then = (by_the_road(moment, t=t, x=1 - t) for moment in (scene, scene.at(later)))
        turn = np.exp(-2j * np.pi * FREQUENCY * (now.delay + now.delay_rate * later))
        foretold = np.sum(now.transfer[:, 0, 0] * turn)
        exact = transfer_at(then, FREQUENCY, t, 1 - t)[0, 0]
        assert to_db(abs(foretold / exact - 1) ** 2) < -30


@pytest.mark.parametrize("pair", [(0, 1), (1, 0)])
def test_directions_over_an_edge_and_a_mirror_follow_new_traces(pair):
    """A wall whose lower edge, 0.4 m above the road, is in the way; the road sinks."""
    wall = replace(curtain(0.4, x=15.0), velocity=(4.0, 7.0, 1.5))
    scene = around(
        [road(velocity=(0.0, 0.0, -1.0)), wall],
        ENDS,
        velocities=[(12.0, 2.0, 0.0), (-9.0, 1.0, 0.5)],
    )
    check_rates(lambda time: _strongest_over_edges(scene.at(time), pair))


def _strongest_over_edges(scene, pair):
    """The strongest path of a pair by way of the road that bends over an edge."""
    world = Composite(frequency=FREQUENCY, dynamic_range=1e12).prepare(scene)
    paths = diffracted_mirror_paths(world, np.array([pair]), np.zeros((2, 2)), actor=ROAD)
    return paths.select([np.argmax(np.abs(paths.transfer[:, 0, 0]))])


def test_a_path_says_whether_it_bends_before_or_behind_the_mirror():
    """A post near the first radar obstructs the way to the road, another one the way from it."""
    for x, t, expected in (
        (4.0, 0, (Bounce.DIFFRACTION, Bounce.REFLECTION)),
        (4.0, 1, (Bounce.REFLECTION, Bounce.DIFFRACTION)),
        (36.0, 0, (Bounce.REFLECTION, Bounce.DIFFRACTION)),
        (36.0, 1, (Bounce.DIFFRACTION, Bounce.REFLECTION)),
    ):
        post = body(box((0.1, 0.1, 0.3), 0.05), x=x, y=0.1, z=0.45)
        paths = by_the_road(around([road(), post], ENDS), t=t, x=1 - t)
        power = np.abs(paths.transfer[:, 0, 0]) ** 2
        counts = np.diff(paths.bounce_start)
        strongest = int(np.argmax(np.where(counts == 2, power, 0.0)))
        begin = paths.bounce_start[strongest]
        assert tuple(paths.bounce_kind[begin : begin + 2]) == expected
        # departures and arrivals look down to the road, or to the image in it
        assert paths.departure[strongest, 2] < 0
        assert paths.arrival[strongest, 2] < 0


@pytest.mark.parametrize("y", [0.0, 0.12, 0.25, 0.4])
def test_a_radar_sees_itself_past_an_edge_alike_in_every_direction(y):
    """An edge has the same excess before and behind the mirror: Kirchhoff's integral over one.

    A square of 0.3 m stands before a wall. The wall, the square and the radar are turned and moved.
    """
    fields = []
    for turn, shift in ((0.0, 0.0), (1e-9, 0.0), (0.3, 3.0), (1.1, -70.0), (2.5, 800.0)):
        street = Pose(x=shift, y=shift, z=0.6, yaw=turn)
        places = street.to_outer(np.array([[0.0, 0.0, 0.0], [12.0, 0.0, 0.0], [5.0, y, 0.0]]))
        radar, wall, square = places.tolist()
        surface = Plate(
            centre=(0, 0, 0), half_u=(0, 60, 0), half_v=(0, 0, -60), material="metal", part="w"
        )
        poses = [Pose(x=at[0], y=at[1], z=at[2], yaw=turn) for at in (wall, square)]
        mirror = Actor(name="wall", kind="building", pose=poses[0], plates=(surface,))
        screen = Actor(name="square", kind="object", pose=poses[1], mesh=mesh_of(plate(0.3, 0.3)))
        # the second radar, high above, makes the wall the actor of number `ROAD`
        scene = around([mirror, screen], [radar, (radar[0], radar[1], 50.0)])
        fields.append(relative_field(scene, t=0, x=0))
    np.testing.assert_allclose(fields, fields[0], atol=1e-6)
    placed = plate(0.3, 5e-3) + np.array([5.0, y, 0.0])
    expected = beside_obstacle(placed, np.array([24.0, 0.0, 0.0]), np.zeros(3), FREQUENCY)
    assert abs(fields[0] - expected) < 0.012


def test_what_is_behind_a_mirror_or_beside_its_plate_obstructs_nothing():
    buried = body(box((0.5, 0.5, 0.4), 0.2), x=15.0, z=-0.4)
    assert np.all(np.diff(by_the_road(around([road(), buried], ENDS)).bounce_start) == 1)
    # the reflection is at 18 m, where this road does not reach
    short = Plate(centre=(0, 0, 0), half_u=(9, 0, 0), half_v=(0, 9, 0), material="metal", part="r")
    piece = Actor(name="road", kind="road", plates=(short,))
    thing = body(box((0.5, 0.5, 0.4), 0.2), x=15.0, z=0.3)
    assert np.all(np.diff(by_the_road(around([piece, thing], ENDS)).bounce_start) == 1)


@pytest.mark.parametrize("seed", range(6))
def test_a_car_that_drives_over_the_reflection_takes_it_away_in_time(seed):
    """What arrives by way of the road, beside tracing anew at every millisecond."""
    draw = np.random.default_rng([37, seed])
    speed, place = draw.uniform(5.0, 15.0), draw.uniform(8.0, 30.0)
    times = np.arange(33) * 1e-3
    begin = -2.0 - speed * float(times[16]) + draw.uniform(-0.05, 0.05)
    crossing = Actor(
        name="crossing",
        kind="vehicle",
        mesh=mesh_of(box((4.0, 1.8, 1.3), 0.3)),
        pose=Pose(x=place, y=begin, z=0.8, yaw=0.5 * np.pi),
        velocity=(0.0, speed, 0.0),
    )
    scene = around([road(), crossing], ENDS)
    tracer, band = Composite(max_bounces=1), np.linspace(78.5e9, 79.5e9, 9)

    def response(paths):
        count = np.concatenate([[0], np.cumsum(paths.bounce_kind == Bounce.REFLECTION)])
        meets = np.diff(count[paths.bounce_start]) > 0
        mine = (paths.transmitter == 0) & (paths.receiver == 1) & meets
        turn = np.exp(-2j * np.pi * paths.delay[mine, None] * band)
        return np.sum(paths.transfer[mine, 0, 0][:, None] * turn, axis=0)

    wrong, right = 0.0, 0.0
    for paths, time in zip(interpolate_paths(tracer, scene, times), times, strict=True):
        anew = response(tracer.trace(scene.at(float(time))))
        wrong += np.sum(np.abs(response(paths) - anew) ** 2)
        right += np.sum(np.abs(anew) ** 2)
    assert 10 * np.log10(wrong / right) < -20.0
