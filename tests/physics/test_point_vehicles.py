"""Vehicles as a few points, compared with 3GPP's figures and with our physical optics."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.point_vehicles.occlusion_boxes import crosses, vehicle_boxes
from polychirp.channel.point_vehicles.paths import scatterers
from polychirp.channel.point_vehicles.scattering_points import LOBE_SIDES, lobe_points
from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.rng import Streams
from polychirp.testing.shapes import around, box, mesh_of
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import to_db
from tools.point_tables import cross_section, echo_paths, mean_power

TR = "3GPP TR 38.901, clause 7.9.2.1"
SEDAN = mesh_of(box((4.6, 1.84, 1.45), 2.0))
MODELS = ["tables", "3gpp-one", "3gpp-five"]


def tracer(**fields):
    """Dynamic range that leaves out no path."""
    return PointVehicles(**{"dynamic_range": 1e15, **fields})


def sedan(name="body", *, velocity=(0.0, 0.0, 0.0), mesh=SEDAN, **pose):
    return Actor(name=name, kind="vehicle", mesh=mesh, velocity=velocity, pose=Pose(**pose))


def own_echo(paths, distance):
    """Cross section by the radar equation from all paths' powers, dBsm, V to V."""
    power = np.sum(np.abs(paths.transfer[:, 0, 0]) ** 2)
    return float(to_db(cross_section(power, distance, paths.frequency)))


# ── what 3GPP publishes ───────────────────────────────────────────────────────


@pytest.mark.slow
def test_the_one_point_has_the_published_maximum_on_every_side(compare):
    """The mean of 400 vehicles from 100 m; its own error is 0.2 dB (1 σ), so 0.6 dB."""
    peaks = {"front": 15.52, "left": 20.75, "rear": 14.56, "right": 20.75, "roof": 21.26}
    lobe = lobe_points("one")
    away = np.stack(
        [
            np.cos(lobe.azimuth) * np.sin(lobe.zenith),
            np.sin(lobe.azimuth) * np.sin(lobe.zenith),
            np.cos(lobe.zenith),
        ],
        axis=-1,
    )
    scene = around([sedan()], 100.0 * away)
    power = np.zeros(len(LOBE_SIDES))
    for seed in range(400):
        paths = tracer(model="3gpp-one", seed=seed).trace(scene)
        own = paths.select((paths.transmitter == paths.receiver) & (paths.num_bounces == 1))
        power[own.transmitter] += np.abs(own.transfer[:, 0, 0]) ** 2 / 400
    found = to_db(cross_section(power, 100.0, 79e9))
    for side, measured in zip(LOBE_SIDES, found.tolist(), strict=True):
        compare(
            page="vehicles",
            case=f"one point, {side}",
            quantity="RCS, dBsm",
            expected=peaks[side],
            measured=measured,
            tolerance=0.6,
            source=f"{TR}, table 7.9.2.1-4",
        )


def test_over_all_directions_the_one_point_has_the_published_mean(compare):
    """3GPP gives 11.25 dBsm as σ_M; its lobes must have this mean to the digits of their tables."""
    zenith, weight = np.polynomial.legendre.leggauss(400)
    zenith = np.arccos(zenith)
    azimuth = np.arange(360) * 2 * np.pi / 360
    z, a = np.meshgrid(zenith, azimuth, indexing="ij")
    away = np.stack([np.sin(z) * np.cos(a), np.sin(z) * np.sin(a), np.cos(z)], axis=-1)
    away = away.reshape(-1, 3)
    found = lobe_points("one").cross_section(np.zeros(len(away), dtype=np.int64), away, away)
    mean = np.sum(weight[:, None] * found.reshape(z.shape)) / (2 * 360)
    compare(
        page="vehicles",
        case="one point, mean over the sphere",
        quantity="RCS, dBsm",
        expected=11.25,
        measured=float(to_db(mean)),
        tolerance=0.02,
        source=f"{TR}, σ_M",
    )


@pytest.mark.parametrize("side", LOBE_SIDES)
def test_five_points_add_up_to_the_one(compare, side):
    """The powers of 3GPP's five lobes, floors included, add up to the one point's maxima."""
    one, five, number = lobe_points("one"), lobe_points("five"), LOBE_SIDES.index(side)
    azimuth, zenith = five.azimuth[number], five.zenith[number]
    away = np.array([[np.cos(azimuth), np.sin(azimuth), 0]]) * np.sin(zenith)
    away[0, 2] = np.cos(zenith)
    total = sum(five.cross_section(np.array([k]), away, away)[0] for k in range(5))
    compare(
        page="vehicles",
        case=f"five points together, {side}",
        quantity="RCS, dBsm",
        expected=float(to_db(one.peak[number])),
        measured=float(to_db(total)),
        tolerance=0.02,
        source=f"{TR}, table 7.9.2.1-4 beside 7.9.2.1-5",
    )


# ── what our own physical optics says ─────────────────────────────────────────


def aspects(body, distance, step):
    """m² of a body traced by facets and of its points, from all azimuths off the tables' own."""
    mesh = vehicle_mesh(body)
    facets, points = [], []
    for azimuth in np.radians(0.25) + np.arange(0.0, np.pi, step):
        paths, place = echo_paths(mesh, float(azimuth), distance=distance)
        facets.append(cross_section(mean_power(paths), distance, paths.frequency))
        few = tracer().trace(around([sedan(mesh=mesh)], [place]))
        points.append(10 ** (own_echo(few, distance) / 10))
    return np.array(facets), np.array(points)


@pytest.mark.slow
@pytest.mark.parametrize("body", ["sedan", "hatchback", "van", "truck"])
def test_points_echo_on_the_mean_like_the_facets_they_were_made_from(compare, body):
    """At azimuths between those that the table was made from, at its distance."""
    facets, points = aspects(body, 20.0, np.radians(1.0))
    compare(
        page="vehicles",
        case=f"{body}, twelve points at 20 m, mean over azimuth",
        quantity="RCS, dBsm",
        expected=float(to_db(np.mean(facets))),
        measured=float(to_db(np.mean(points))),
        tolerance=1.0,
        source="physical optics of its facets",
    )


@pytest.mark.slow
@pytest.mark.parametrize("distance", [10.0, 40.0])
def test_at_other_distances_a_saloon_is_right_to_a_few_decibels(compare, distance):
    """Its flanks are in the near field, where a cross section changes with the distance."""
    facets, points = aspects("sedan", distance, np.radians(2.0))
    compare(
        page="vehicles",
        case=f"sedan, twelve points at {distance:g} m, median over azimuth",
        quantity="RCS, dBsm",
        expected=float(np.median(to_db(facets))),
        measured=float(np.median(to_db(points))),
        tolerance=1.5,
        source="physical optics of its facets",
    )


@pytest.mark.slow
@pytest.mark.parametrize("angle", [30.0, 60.0, 90.0])
def test_from_one_radar_to_another_points_echo_like_facets(compare, angle):
    """Along the bisector of both directions; 36 pairs of directions, so 2.5 dB."""
    mesh, facets, points = vehicle_mesh("sedan"), [], []
    for first in np.radians(10 * np.arange(36) + 1.0):
        places = [(20 * np.cos(a), 20 * np.sin(a), 0.5) for a in (first, first + np.radians(angle))]
        scene = around([sedan(mesh=mesh)], places)
        for kept, engine in ((facets, Composite(reflecting_planes=False)), (points, tracer())):
            paths = engine.trace(scene)
            mine = (paths.transmitter == 0) & (paths.receiver == 1) & (paths.num_bounces == 1)
            some = paths.select(mine)
            power = (
                mean_power(some)
                if kept is facets
                else np.sum(np.abs(some.transfer[:, 0, 0]) ** 2)
            )  # fmt: skip
            kept.append(cross_section(power, 20.0, 79e9))
    compare(
        page="vehicles",
        case=f"sedan, twelve points at 20 m, bistatic {angle:g}°, mean over azimuth",
        quantity="RCS, dBsm",
        expected=float(to_db(np.mean(facets))),
        measured=float(to_db(np.mean(points))),
        tolerance=2.5,
        source="physical optics of its facets",
    )


# ── laws ──────────────────────────────────────────────────────────────────────


def test_points_and_sight_are_those_of_free_space_where_nothing_is_in_the_way():
    target = Actor(
        name="target", kind="object", velocity=(-8.0, 1.0, 0.0), pose=Pose(x=30.0, y=2.0),
        points=(PointScatterer(position=(0, 0, 0.5), rcs=3.0),),
    )  # fmt: skip
    scene = around([target], [(0, 0, 0.5), (20, -3, 0.5)])
    ours, exact = tracer().trace(scene), FreeSpace().trace(scene)
    order = [np.lexsort([p.receiver, p.transmitter, p.num_bounces]) for p in (ours, exact)]
    for name in ("delay", "delay_rate", "transfer", "departure", "arrival"):
        mine, theirs = (
            getattr(p, name)[rows] for p, rows in zip((ours, exact), order, strict=True)
        )
        np.testing.assert_allclose(mine, theirs, rtol=1e-12, atol=1e-16)


@pytest.mark.parametrize("model", MODELS)
def test_what_goes_there_comes_back_transposed(model):
    """Reciprocity between radars at rest: equal delays, transposed matrices."""
    cars = [sedan("a", x=15.0, yaw=0.3), sedan("b", x=5.0, y=9.0, yaw=2.0)]
    paths = tracer(model=model).trace(around(cars, [(0, 0, 0.5), (20, 8, 1.0)]))
    there, again = (
        paths.select((paths.transmitter == a) & (paths.receiver == 1 - a)) for a in (0, 1)
    )
    assert there.num_paths >= 3
    order = [np.argsort(p.delay) for p in (there, again)]
    np.testing.assert_allclose(there.delay[order[0]], again.delay[order[1]], rtol=1e-14)
    np.testing.assert_allclose(
        there.transfer[order[0]],
        np.swapaxes(again.transfer[order[1]], 1, 2),
        rtol=1e-9,
        atol=1e-20,
    )


@pytest.mark.parametrize("model", MODELS)
def test_a_street_may_be_moved_and_turned_as_a_whole(model):
    """Rotations are about the vertical, which defines the polarisations."""

    def placed(turn, shift):
        def at(x, y, yaw=0.0):
            c, s = np.cos(turn), np.sin(turn)
            return {"x": c * x - s * y + shift[0], "y": s * x + c * y + shift[1], "yaw": yaw + turn}

        radar = Radar(name="front", mount=Pose(x=2.31))
        cars = (
            sedan("own", **at(0, 0)),
            sedan("a", **at(20, 3, 0.4)),
            sedan("b", **at(12, -4, 3.0)),
        )
        scene = Scene(
            time=0.0, actors=cars, radars=(radar, replace(radar, name="b")), carriers=(0, 2)
        )
        return tracer(model=model).trace(scene)

    first, second = placed(0.0, (0, 0)), placed(1.1, (40.0, -7.0))
    assert first.num_paths == second.num_paths >= 5
    np.testing.assert_allclose(first.delay, second.delay, rtol=1e-9)
    np.testing.assert_allclose(first.transfer, second.transfer, rtol=1e-6, atol=1e-20)


def test_a_vehicle_that_approaches_has_the_textbook_doppler(compare):
    """2vf/(c − v) straight ahead, for the point in its middle."""
    scene = around([sedan(x=40.0, velocity=(-8.0, 0, 0))], [(0, 0, 0)])
    paths = tracer(model="3gpp-one").trace(scene)
    compare(
        page="vehicles",
        case="one point that approaches at 8 m/s",
        quantity="Doppler, Hz",
        expected=2 * 8.0 * 79e9 / (SPEED_OF_LIGHT - 8.0),
        measured=float(-79e9 * paths.delay_rate[0]),
        tolerance=1e-6,
        source="two-way Doppler shift, 2vf/(c − v)",
    )


@pytest.mark.parametrize("model", MODELS)
def test_what_was_drawn_stays_from_snapshot_to_snapshot(model):
    """Only geometry moves the matrices: by less than 1 % in 1 ms at 8 m/s."""
    scene = around([sedan(x=20.0, yaw=0.5, velocity=(-8.0, 0, 0))], [(0, 0, 0.2)])
    engine = tracer(model=model)
    now, later = engine.trace(scene), engine.trace(scene.at(1e-3))
    np.testing.assert_allclose(later.transfer, now.transfer, rtol=0.01)
    other = tracer(model=model, seed=2).trace(scene)
    assert not np.allclose(other.transfer, now.transfer, rtol=0.01)


def test_every_point_of_every_vehicle_draws_from_its_own_named_stream():
    """One more vehicle changes no random values of the others."""
    cars = (sedan("a", x=20.0), sedan("b", x=20.0, y=8.0))
    found = scatterers(Scene(time=0.0, actors=cars), model="3gpp-five", seed=7)
    for actor, number, matrix in zip(found.actor, found.number, found.matrix, strict=True):
        stream = Streams(seed=7)["point-vehicles", cars[actor].name, int(number)]
        np.testing.assert_array_equal(matrix, lobe_points("five").matrix(stream))


def test_an_echo_comes_from_where_the_body_was_when_the_wave_met_it():
    """The wave has travelled c times the time since then."""
    velocity = np.array([-30.0, 5.0, 0.0])
    scene = around([sedan(x=80.0, velocity=velocity)], [(0, 0, 0)])
    paths = tracer(model="3gpp-one").trace(scene)
    then = paths.bounce_point[0]
    ago = np.linalg.norm(then) / SPEED_OF_LIGHT
    np.testing.assert_allclose(then + velocity * ago, (80.0, 0, 0), atol=1e-9)


# ── sight, walls and the longest path ─────────────────────────────────────────


def test_a_car_behind_another_is_not_seen():
    near, far = sedan("near", x=15.0), sedan("far", x=30.0)
    paths = tracer().trace(around([near, far], [(0, 0, 0.0)]))
    assert set(paths.bounce_actor.tolist()) == {1}
    aside = tracer().trace(around([near, sedan("far", x=30.0, y=6.0)], [(0, 0, 0.0)]))
    assert set(aside.bounce_actor.tolist()) == {1, 2}


def test_paths_longer_than_the_longest_are_not_followed():
    """50 m there and back is 100 m; 62 m between radars is less."""
    scene = around([sedan(x=50.0, y=10.0)], [(0, 0, 0.5), (62.0, 0, 0.5)])
    whole, short = tracer().trace(scene), tracer(max_length=80.0).trace(scene)
    length = whole.delay * SPEED_OF_LIGHT
    assert np.sum(length > 80.0) > 0
    np.testing.assert_allclose(np.sort(short.delay), np.sort(whole.delay[length <= 80.0]))


def test_a_road_mirrors_and_a_car_on_it_is_in_the_way():
    """The direct path passes above the low box, the mirrored one does not."""
    road = Actor(
        name="road", kind="road",
        plates=(Plate(centre=(0, 0, 0), half_u=(99, 0, 0), half_v=(0, 5, 0), material="asphalt",
                      part="road"),),
    )  # fmt: skip
    low = Actor(name="low", kind="vehicle", mesh=SEDAN, pose=Pose(x=20.0, z=0.73))
    radars = [(0, 0, 2.0), (40.0, 0, 2.0)]
    kinds = [
        sorted(set(tracer().trace(around(actors, radars)).num_bounces.tolist()))
        for actors in ([road], [road, low])
    ]
    assert kinds[0] == [0, 1]
    paths = tracer().trace(around([road, low], radars))
    between = paths.select(paths.transmitter != paths.receiver)
    assert 2 not in between.bounce_actor  # the carriers are 0 and 1
    assert np.sum(between.num_bounces == 0) == 2
    flat = tracer(reflecting_planes=False).trace(around([road], radars))
    assert np.all(flat.num_bounces == 0)


def slow_echoes(scene, engine):
    """(transmitter, receiver, |A| V to V) of every echo, one after the other, by the equations."""
    found = scatterers(scene, model=engine.model, seed=engine.seed)
    boxes, place = vehicle_boxes(scene), scene.radar_position
    wavelength = SPEED_OF_LIGHT / engine.carrier
    rows = []

    def sees(radar, point, actor):
        rows = np.flatnonzero(boxes.actor != actor)
        start, end = np.tile(place[radar], (len(rows), 1)), np.tile(point, (len(rows), 1))
        return not np.any(crosses(boxes.select(rows), start, end))

    for actor, point, model, number, matrix in zip(*found[:5], strict=True):
        turn = scene.actors[actor].pose.rotation
        for out in range(len(place)):
            for back in range(len(place)):
                legs = [place[radar] - point for radar in (out, back)]
                length = [np.linalg.norm(leg) for leg in legs]
                if sum(length) > engine.max_length:
                    continue
                if not all(sees(radar, point, actor) for radar in (out, back)):
                    continue
                ways = [(leg / size @ turn)[None] for leg, size in zip(legs, length, strict=True)]
                area = found.models[model].cross_section(np.array([number]), *ways)[0]
                size = np.sqrt(area) * wavelength / ((4 * np.pi) ** 1.5 * np.prod(length))
                rows.append((out, back, abs(matrix[0, 0]) * size))
    return np.array(sorted(rows))


@pytest.mark.parametrize("model", MODELS)
def test_the_search_finds_what_going_through_all_finds(model):
    rng = np.random.default_rng(1)
    cars = [
        sedan(str(k), x=x, y=y, yaw=x) for k, (x, y) in enumerate(rng.uniform(-40, 40, (12, 2)))
    ]
    scene = around(cars, [(x, y, 0.3) for x, y in rng.uniform(-40, 40, (4, 2))])
    engine = tracer(model=model, max_length=90.0)
    paths = engine.trace(scene)
    paths = paths.select(paths.num_bounces == 1)
    size = np.abs(paths.transfer[:, 0, 0])
    found = np.array(sorted(zip(paths.transmitter, paths.receiver, size, strict=True)))
    expected = slow_echoes(scene, engine)
    assert len(expected) > 30
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_weak_echoes_are_left_out_as_the_dynamic_range_says():
    scene = around([sedan(x=15.0), sedan("b", x=40.0, y=9.0)], [(0, 0, 0.3)])
    whole, few = tracer().trace(scene), tracer(dynamic_range=100.0).trace(scene)
    power = np.max(np.abs(whole.transfer) ** 2, axis=(1, 2))
    assert few.num_paths == np.sum(power >= power.max() / 100) < whole.num_paths


@pytest.mark.parametrize("model", MODELS)
def test_a_scene_may_be_empty(model):
    engine = PointVehicles(model=model)
    assert engine.trace(Scene(time=0.0, actors=())).num_paths == 0
    assert engine.trace(Scene(time=0.0, actors=(sedan(),))).num_paths == 0
    assert engine.trace(around([], [(0, 0, 0)])).num_paths == 0


@pytest.mark.parametrize(
    "wrong", [{"frequency": 0.0}, {"dynamic_range": 0.5}, {"max_length": 0.0}, {"seed": -1}]
)
def test_what_makes_no_sense_is_refused(wrong):
    with pytest.raises(InputError):
        PointVehicles(**wrong)
