"""Interpolated paths: when parts are traced again, and how wrong paths between traces may be."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.base import all_pairs
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.channel.tracers.part_traces import (
    FAINT_ECHO_ERROR,
    FAINT_INTERFERENCE,
    MAX_TRACE_INTERVAL,
    interpolation_error,
)
from polychirp.channel.tracers.path_interpolation import interpolate_paths
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around, box, mesh_of, plate, transfer_at

TIMES = np.arange(9) * 1e-3


def hammered(corners):
    """A body with dents of 20 µm, of which no side is flat.

    A flat side echoes like a mirror, and the echo of one that moves along itself hardly changes.
    """
    dent = np.sin(
        corners @ np.array([[900.0, 500.0, 300.0], [400.0, 800.0, 700.0], [600.0, 200.0, 900.0]])
    )
    return corners + 2e-5 * dent


CAR = mesh_of(hammered(box((4.0, 1.8, 1.4), 0.03)))
FAR_CAR = mesh_of(box((4.0, 1.8, 1.4), 0.1))


def car(name, *, x, y, speed):
    return Actor(
        name=name,
        kind="vehicle",
        mesh=CAR if x < 10 else FAR_CAR,
        pose=Pose(x=x, y=y, z=0.9, yaw=np.pi),
        velocity=(-speed, 0.0, 0.0),
    )


def street():
    """One car that passes at 2 m, one that runs 30 m ahead at nearly the radar's speed."""
    cars = [car("beside", x=1.0, y=2.5, speed=25.0), car("ahead", x=32.0, y=0.0, speed=1.0)]
    return around(cars, [(0, 0, 0.6), (0, 0.5, 0.6)])


def counted(tracer, monkeypatch):
    """Number of times each part is traced, by name, and by name and pair."""
    counts = {}
    parts = type(tracer).parts

    def noted(self, world):
        def one(part):
            def trace(world, pairs, strongest):
                for key in (part.name, *((part.name, *pair) for pair in pairs.tolist())):
                    counts[key] = counts.get(key, 0) + 1
                return part.trace(world, pairs, strongest)

            return part._replace(trace=trace)

        return tuple(one(part) for part in parts(self, world))

    monkeypatch.setattr(type(tracer), "parts", noted)
    return counts


def test_what_passes_by_is_traced_often_and_what_stands_ahead_seldom(monkeypatch):
    tracer = Composite()
    counts = counted(tracer, monkeypatch)
    interpolate_paths(tracer, street(), TIMES)
    assert counts["facets of beside"] == len(TIMES)
    assert counts["facets of ahead"] == 2


def test_a_body_is_traced_often_for_the_radar_that_it_passes_alone(monkeypatch):
    tracer = Composite(max_bounces=1)
    counts = counted(tracer, monkeypatch)
    beside = car("beside", x=1.0, y=2.5, speed=25.0)
    paths = interpolate_paths(tracer, around([beside], [(0, 0, 0.6), (-60.0, 0, 0.6)]), TIMES)
    assert counts["facets of beside", 0, 0] == len(TIMES)
    assert counts["facets of beside", 1, 1] == 2
    assert counts["facets of beside", 0, 1] == counts["facets of beside", 1, 0]
    assert all(np.any((table.transmitter == 1) & (table.receiver == 1)) for table in paths)


def test_what_is_faint_beside_the_rest_of_its_whole_is_seldom_renewed(monkeypatch):
    """A car and its image in the road: the image alone would ask for every trace."""
    road = Plate(
        centre=(0, 0, 0), half_u=(40, 0, 0), half_v=(0, 20, 0), material="asphalt", part="r"
    )
    scene = around(
        [
            car("beside", x=1.0, y=2.5, speed=25.0),
            Actor(name="road", kind="road", plates=(road,)),
        ],
        [(0, 0, 0.6)],
    )
    tracer = Composite(max_bounces=1)
    counts = counted(tracer, monkeypatch)
    interpolate_paths(tracer, scene, TIMES)
    assert counts["facets of beside"] == len(TIMES)
    assert counts["mirrored facets of beside"] == 2
    parts = Composite.parts
    monkeypatch.setattr(
        Composite, "parts", lambda *a: tuple(part._replace(whole="") for part in parts(*a))
    )
    counts.clear()
    interpolate_paths(tracer, scene, TIMES)
    assert counts["mirrored facets of beside"] == len(TIMES)


def response(paths, pair, frequencies):
    return np.array([transfer_at(paths, f, *pair)[0, 0] for f in frequencies])


def test_between_two_traces_paths_are_hardly_more_wrong_than_allowed():
    """Against tracing anew: a few times the power that one part may get wrong, since some parts
    add up, and a traced part of itself flickers a little."""
    tracer, scene = Composite(), street()
    band = np.linspace(78.5e9, 79.5e9, 33)
    for paths, time in zip(interpolate_paths(tracer, scene, TIMES), TIMES, strict=True):
        anew = tracer.trace(scene.at(float(time)))
        for pair in ((0, 0), (0, 1), (1, 0), (1, 1)):
            old, new = (response(table, pair, band) for table in (paths, anew))
            of_interference = FAINT_INTERFERENCE * tracer.motion_error
            allowed = FAINT_ECHO_ERROR if pair[0] == pair[1] else of_interference
            assert np.sum(np.abs(old - new) ** 2) <= 4 * allowed * np.sum(np.abs(new) ** 2)


def test_paths_are_as_right_between_two_traces_as_the_motion_error_asks():
    """Own echoes and those of the other radar's waves of a car that passes at 5 m."""
    scene = around([car("beside", x=8.0, y=5.0, speed=12.0)], [(0, 0, 0.6), (0, 0.5, 0.6)])
    times, band = np.arange(17) * 1e-3, np.linspace(78.5e9, 79.5e9, 33)
    pairs = ((0, 0), (0, 1), (1, 1))
    true = [
        [response(Composite().trace(scene.at(float(time))), pair, band) for time in times]
        for pair in pairs
    ]
    wrong = []
    for error in (1e-1, 1e-2, 1e-3):
        tracer = Composite(motion_error=error)
        found, total = interpolate_paths(tracer, scene, times), 0.0
        for pair, right in zip(pairs, true, strict=True):
            power = [
                np.sum(np.abs(response(paths, pair, band) - one) ** 2)
                for paths, one in zip(found, right, strict=True)
            ]
            assert max(power) <= 4.0 * error * np.mean(np.sum(np.abs(right) ** 2, axis=-1))
            total += sum(power)
        wrong.append(total)
    assert wrong[0] > 3.0 * wrong[1] > 9.0 * wrong[2]


@pytest.mark.parametrize("error", [0.0, 1e-7, 1.5, np.nan])
def test_a_motion_error_is_a_ratio_that_tracing_can_keep(error):
    with pytest.raises(InputError, match="motion_error"):
        Composite(motion_error=error)


def test_a_coherence_time_is_when_extrapolation_is_half_wrong():
    """The error that the table states for a time, compared with a new trace then."""
    tracer = Composite(reflecting_planes=False)
    scene = around([car("beside", x=3.0, y=3.0, speed=15.0)], [(0, 0, 0.6)])
    paths, band = tracer.trace(scene), np.linspace(78.5e9, 79.5e9, 65)
    power = np.abs(paths.transfer[:, 0, 0]) ** 2
    for elapsed in (0.5e-3, 1e-3, 2e-3):
        wrong = np.minimum(1.0, 0.5 * (elapsed / paths.coherence_time) ** 2) ** 2
        moved = response(paths.carried(elapsed), (0, 0), band)
        new = response(tracer.trace(scene.at(elapsed)), (0, 0), band)
        found = np.sum(np.abs(moved - new) ** 2)
        said, found = np.sum(power * wrong) / np.sum(power), found / np.sum(np.abs(new) ** 2)
        assert found == pytest.approx(said, rel=3.0)
        assert said == pytest.approx(found, rel=3.0)


@pytest.mark.parametrize(("x", "gap"), [(3, 0.5e-3), (3, 1e-3), (3, 2e-3), (8, 1e-3), (8, 4e-3)])
def test_half_way_between_two_traces_the_error_is_as_stated(x, gap):
    """Against tracing then, within 4 dB; from −34 to −10 dB in all."""
    tracer, band = (
        Composite(reflecting_planes=False, max_bounces=1),
        np.linspace(78.5e9, 79.5e9, 33),
    )
    scene = around([car("beside", x=x, y=3.0, speed=15.0)], [(0, 0, 0.6)])
    first, middle, last = (tracer.trace(scene.at(time)) for time in (0.0, 0.5 * gap, gap))
    power = np.abs(first.transfer[:, 0, 0]) ** 2
    said = np.sum(power * interpolation_error(gap / first.coherence_time)) / np.sum(power)
    both = [table.carried(way) for table, way in ((first, 0.5 * gap), (last, -0.5 * gap))]
    new = response(middle, (0, 0), band)
    wrong = 0.5 * sum(response(table, (0, 0), band) for table in both) - new
    found = np.sum(np.abs(wrong) ** 2) / np.sum(np.abs(new) ** 2)
    assert 0.4 * said < found < 2.5 * said


POINT = PointScatterer(position=(0.0, 0.0, 0.0), rcs=1.0)
PASSING = Actor(
    name="van",
    kind="vehicle",
    velocity=(-28.0, 3.0, 0.0),
    pose=Pose(x=4.0, y=5.0, z=0.6),
    points=(POINT,),
)
MOVES = [(0.0, 0.0, 0.0), (-20.0, 4.0, 0.0)]
PLACES = [(0.0, 0.0, 0.6), (2.0, 4.0, 0.9)]


def walls():
    """A road and, 9 m to the left of it, a house's front, both of metal."""
    road = Plate(
        centre=(0, 0, 0),
        half_u=(200, 0, 0),
        half_v=(0, 200, 0),
        material="metal",
        part="road",
    )
    house = replace(road, half_v=(0, 0, 200), part="front")
    return [
        Actor(name="road", kind="road", plates=(road,)),
        Actor(name="house", kind="building", pose=Pose(y=9.0), plates=(house,)),
    ]


@pytest.mark.parametrize("kind", ["line of sight", "points", "mirrors", "corners"])
def test_delays_of_single_journeys_bend_as_tracing_anew_finds_them(kind):
    """Second differences over ±0.5 ms; what is left is of fourth order, and of order v/c."""
    actors = [PASSING] if kind == "points" else [] if kind == "line of sight" else walls()
    scene, step = around(actors, PLACES, velocities=MOVES), 5e-4
    tracer = Composite(dynamic_range=1e12, diffraction=False)
    tables = []
    for elapsed in (-step, 0.0, step):
        world = tracer.prepare(scene.at(elapsed))
        part = next(part for part in tracer.parts(world) if part.name == kind)
        tables.append(part.trace(world, all_pairs(scene), np.zeros((2, 2))))
    before, now, after = tables
    assert before.num_paths == now.num_paths == after.num_paths > 0
    bend = (after.delay - 2 * now.delay + before.delay) / step**2
    assert np.max(np.abs(bend)) * SPEED_OF_LIGHT > 20.0
    np.testing.assert_allclose(now.delay_acceleration, bend, rtol=1e-3, atol=1e-4 * np.max(bend))


def test_a_point_that_passes_is_followed_to_third_order():
    """Twice d³R/dt³ = −3 Ṙ R̈/R each way: the phase wrong after 4 ms, from the exact delay."""
    scene, elapsed = around([PASSING], PLACES[:1]), 4e-3
    paths, later = FreeSpace().trace(scene), FreeSpace().trace(scene.at(elapsed))
    range_, rate = 0.5 * SPEED_OF_LIGHT * paths.delay, 0.5 * SPEED_OF_LIGHT * paths.delay_rate
    third = -3 * rate * 0.5 * SPEED_OF_LIGHT * paths.delay_acceleration / range_
    wrong = SPEED_OF_LIGHT * (later.delay - paths.carried(elapsed).delay)
    assert wrong == pytest.approx(2 * third * elapsed**3 / 6, rel=0.05)
    # without the bend, some rad at 79 GHz
    straight = later.delay - paths.delay - paths.delay_rate * elapsed
    assert 2 * np.pi * 79e9 * straight[0] > 2.0


def test_a_small_body_that_passes_is_followed_sideways():
    """A square of 1 cm, 5 m away at 25 m/s, which turns little of its echo in 5 cm."""
    square = Actor(
        name="square",
        kind="object",
        mesh=mesh_of(plate(0.01, 0.01)),
        pose=Pose(x=0.1, y=5.0, z=0.6, yaw=-np.pi / 2),
        velocity=(25.0, 0.0, 0.0),
    )
    scene, elapsed = around([square], PLACES[:1]), 2e-3
    tracer = Composite(max_bounces=1)
    paths, band = tracer.trace(scene), np.linspace(78.5e9, 79.5e9, 9)
    anew = response(tracer.trace(scene.at(elapsed)), (0, 0), band)
    straight = replace(paths, delay_acceleration=np.zeros(paths.num_paths))
    wrong = [
        np.sum(np.abs(response(table.carried(elapsed), (0, 0), band) - anew) ** 2)
        for table in (paths, straight)
    ] / np.sum(np.abs(anew) ** 2)
    assert wrong[0] < 1e-3
    assert wrong[1] > 0.3


@pytest.mark.parametrize("dynamic_range", [1e4, 1e6, 1e8])
def test_what_keeps_its_phase_is_the_same_between_two_traces(dynamic_range):
    """Two tables share a still scene: their sum is what either has, down to the weakest path."""
    scene = around([car("ahead", x=32.0, y=0.0, speed=0.0)], PLACES)
    tracer = Composite(max_bounces=1, dynamic_range=dynamic_range)
    band = np.linspace(78.5e9, 79.5e9, 9)
    first, *between = interpolate_paths(tracer, scene, TIMES)
    for paths in between:
        for pair in ((0, 0), (0, 1), (1, 1)):
            same = response(first, pair, band)
            error = np.max(np.abs(response(paths, pair, band) - same))
            assert error < 1e-6 * np.max(np.abs(same))


def test_what_vanishes_between_two_traces_fades_away():
    """A screen hides a point at the last time, but not at the first."""
    screen = Actor(
        name="screen",
        kind="tree",
        mesh=mesh_of(plate(1.0, 0.5)),
        pose=Pose(x=2.0, y=-0.55, z=0.6),
        velocity=(0.0, 20.0, 0.0),
    )
    point = Actor(name="point", kind="object", pose=Pose(x=10.0, z=0.6), points=(POINT,))
    tables = interpolate_paths(Composite(), around([screen, point], PLACES[:1]), TIMES)
    size = [np.max(np.abs(paths.transfer), initial=0.0) for paths in tables]
    np.testing.assert_allclose(size, size[0] * np.linspace(1.0, 0.0, 9), atol=1e-9 * size[0])


def test_a_radar_that_sees_nothing_changes_no_coherence_time():
    """It drives away fast behind a screen; the other radar's echoes hold as long as without it."""
    ahead = car("ahead", x=12.0, y=0.0, speed=6.0)
    screen = Actor(name="screen", kind="tree", pose=Pose(x=0.3, z=0.6), mesh=mesh_of(plate(1, 0.5)))
    places, times = [(0, 0, 0.6), (0, 3.0, 0.6)], []
    for some in (places, places[1:]):
        scene = around([ahead, screen], some)
        actors = [
            replace(actor, velocity=(-40.0, 0, 0)) if number == scene.carriers[0] else actor
            for number, actor in enumerate(scene.actors)
        ]
        if some is places:
            scene = replace(scene, actors=tuple(actors))
        paths = Composite(max_bounces=1, diffuse=False).trace(scene)
        number = len(some) - 1
        own = paths.select((paths.transmitter == number) & (paths.receiver == number))
        times.append(own.coherence_time)
    assert len(times[0])
    np.testing.assert_allclose(times[0], times[1], rtol=1e-6)


def test_only_the_listeners_pairs_are_traced():
    paths = interpolate_paths(Composite(), street(), TIMES[:2], receivers=[1])[0]
    assert set(paths.receiver) == {1}
    assert set(paths.transmitter) == {0, 1}


def test_at_the_time_of_a_trace_the_paths_are_those_of_the_tracer():
    scene, tracer = street(), Composite()
    first, alone = interpolate_paths(tracer, scene, TIMES)[0], tracer.trace(scene)
    np.testing.assert_array_equal(first.delay, alone.delay)
    np.testing.assert_array_equal(first.transfer, alone.transfer)


def test_a_tracer_without_parts_traces_everything_at_every_time():
    scene = street()
    found = interpolate_paths(FreeSpace(), scene, TIMES)
    assert [paths.reference_time for paths in found] == TIMES.tolist()
    np.testing.assert_array_equal(found[3].delay, FreeSpace().trace(scene.at(3e-3)).delay)


def test_shadows_are_renewed_even_if_nothing_moves(monkeypatch):
    tracer = Composite()
    counts = counted(tracer, monkeypatch)
    still = around([car("ahead", x=12.0, y=0.0, speed=0.0)], [(0, 0, 0.6)])
    times = np.arange(0, 3.01 * MAX_TRACE_INTERVAL, 1e-3)
    interpolate_paths(tracer, still, times)
    assert counts["facets of ahead"] == 4


@pytest.mark.parametrize("seed", range(6))
def test_a_car_that_drives_between_two_radars_hides_one_from_the_other_in_time(seed):
    """What arrives directly, beside tracing anew at every millisecond: half of it is diffracted."""
    draw = np.random.default_rng([29, seed])
    speed, place = draw.uniform(5.0, 15.0), draw.uniform(8.0, 22.0)
    times = np.arange(33) * 1e-3
    # the car's front comes into the line of sight in the middle of the frame
    begin = -2.0 - speed * float(times[16]) + draw.uniform(-0.05, 0.05)
    crossing = Actor(
        name="crossing",
        kind="vehicle",
        mesh=FAR_CAR,
        pose=Pose(x=place, y=begin, z=0.8, yaw=0.5 * np.pi),
        velocity=(0.0, speed, 0.0),
    )
    scene = around([crossing], [(0.0, 0.0, 0.6), (30.0, 0.0, 0.6)])
    tracer, band = Composite(max_bounces=1), np.linspace(78.5e9, 79.5e9, 9)
    wrong, right = 0.0, 0.0
    for paths, time in zip(interpolate_paths(tracer, scene, times), times, strict=True):
        anew = response(tracer.trace(scene.at(float(time))), (0, 1), band)
        wrong += np.sum(np.abs(response(paths, (0, 1), band) - anew) ** 2)
        right += np.sum(np.abs(anew) ** 2)
    assert 10 * np.log10(wrong / right) < -20.0
