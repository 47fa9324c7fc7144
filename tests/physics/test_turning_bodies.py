"""Bodies and radars that turn: paths say how their delays, directions and fields change.

The slow twin is a new trace a moment later. Its field must be that of the first trace, extrapolated
by the paths' own derivatives; without the turn's share in them, errors are a hundred times larger.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.base import gather
from polychirp.channel.scene.ground_truth import truth
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray, ElementPattern
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.synthesis.links.links import links_between
from polychirp.testing.shapes import mesh_of, plate
from polychirp.traffic.road_users import Bicycle
from polychirp.traffic.street import Building, Road, Street, Vehicle

FREQUENCY = 79e9
TRACER = Composite(frequency=FREQUENCY)


def field(paths, elapsed=0.0):
    """Sum of the vertically polarised fields of all paths, ``elapsed`` s after their trace."""
    delay, _ = paths.delays_after(np.full(paths.num_paths, elapsed))
    amplitude = paths.transfer[:, 0, 0] * (1 + elapsed * paths.transfer_drift)
    return np.sum(amplitude * np.exp(-2j * np.pi * FREQUENCY * delay))


def traced(scene, part, pair):
    """Paths of one pair of radars that the parts of the tracer with this name find."""
    world, pairs = TRACER.prepare(scene), np.array([pair])
    none = np.zeros((len(scene.radars),) * 2)
    tables = [p.trace(world, pairs, none) for p in TRACER.parts(world) if p.name.startswith(part)]
    paths = gather(tables)
    return paths.select((paths.transmitter == pair[0]) & (paths.receiver == pair[1]))


def errors(scene, part, pair, step):
    """Relative error of the extrapolated field, and relative change of the field."""
    now, later = traced(scene, part, pair), traced(scene.at(scene.time + step), part, pair)
    assert now.num_paths
    right = field(later)
    return abs(field(now, step) - right) / abs(right), abs(field(now) - right) / abs(right)


def street(*, ego=0.5, car=-0.6, blocker=0.0, x=12.0, blocker_x=None):
    """A turning car with a radar before another one with a radar, perhaps with a car between."""
    cars = [
        Vehicle(name="ego", x=0.0, y=0.0, speed=8.0, yaw_rate=ego, coarseness=2.0),
        Vehicle(name="car", x=x, y=3.0, heading=2.6, speed=6.0, yaw_rate=car, coarseness=2.0),
    ]
    if blocker_x is not None:
        between = {"x": blocker_x, "y": 1.6, "heading": 0.2, "speed": 7.0, "yaw_rate": blocker}
        cars.append(Vehicle(name="blocker", coarseness=2.0, **between))
    radars = [(Radar(name=n, mount=Pose(x=2.32, z=0.5)), n) for n in ("ego", "car")]
    return Street(vehicles=tuple(cars), road=Road(length=80.0, width=20.0)).scene(radars)


def behind(yaw_rate):
    """A car that is seen over the edges of another one, which turns."""
    return street(x=22.0, blocker_x=11.0, blocker=yaw_rate, ego=0.0, car=yaw_rate)


CASES = {
    "direct path": ("line of sight", (0, 1), street()),
    "edges of a turning car": ("diffraction", (0, 1), behind(0.6)),
    "mirror in the road": ("mirrors", (0, 1), street()),
    "facets of a turning car": ("facets of car", (0, 0), street(ego=0.0)),
    "facets for a turning radar": ("facets of car", (0, 0), street(car=0.0)),
    "facets between two radars": ("facets of blocker", (0, 1), behind(0.6)),
    "facets in the road's mirror": ("mirrored facets of car", (0, 0), street()),
    "waves over edges": ("bent waves at car", (0, 0), behind(0.6)),
    "bounces": ("bounces from car", (0, 0), street()),
}


@pytest.mark.parametrize("case", CASES)
def test_the_field_a_moment_later_is_that_of_a_new_trace(case):
    """Within 4 µs the phase changes by some hundredths of a radian, and the error is 2e-4 at most.

    Bounces are traced with other tubes a moment later, and the waves that the edges of the road
    take away from its mirror have phases of their own: both change fields by some thousandths. In
    some moments a tube comes or goes at an edge, and brings or takes some hundredths of the bounced
    field, and so does a facet at the edge of a shadow in the road's mirror: for both, the error is
    the median of seven moments.
    """
    part, pair, scene = CASES[case]
    is_jumping = case in ("bounces", "facets in the road's mirror")
    moments = [scene.at(k * 1e-4) for k in range(7 if is_jumping else 1)]
    error, change = np.median([errors(one, part, pair, 4e-6) for one in moments], axis=0)
    assert change > 0.04
    assert error < (3e-3 if case in ("bounces", "mirror in the road") else 2e-4)


@pytest.mark.parametrize("case", CASES)
def test_a_turn_that_is_left_out_is_seen(case):
    """The same test fails if the first trace knows nothing of the turn."""
    part, pair, scene = CASES[case]
    straight = replace(scene, actors=tuple(replace(a, yaw_rate=0.0) for a in scene.actors))
    later = field(traced(scene.at(4e-6), part, pair))
    error = abs(field(traced(straight, part, pair), 4e-6) - later) / abs(later)
    assert error > 4e-3


def two_walls():
    """A turning radar before the corner of two walls."""
    walls = (
        Building(name="one", x=20.0, y=0.0, length=6.0, width=20.0, height=6.0),
        Building(name="two", x=5.0, y=12.0, length=20.0, width=6.0, height=6.0),
    )
    ego = Vehicle(name="ego", x=0.0, y=2.0, heading=0.6, speed=8.0, yaw_rate=0.7, coarseness=3.0)
    radar = Radar(name="front", mount=Pose(x=2.32, z=0.5))
    return Street(vehicles=(ego,), buildings=walls).scene([(radar, "ego")])


def small_plate():
    """A turning radar, and a small plate that a turning body carries 3 m from its middle."""
    body = Actor(
        name="car",
        kind="object",
        pose=Pose(x=12.0, y=1.0, yaw=3.0),
        velocity=(3.0, -2.0, 0.0),
        yaw_rate=0.8,
        mesh=mesh_of(plate(0.004, 0.004) + np.array([3.0, -0.5, 0.6])),
    )
    ego = Vehicle(name="ego", x=0.0, y=0.0, speed=8.0, yaw_rate=0.5, coarseness=3.0)
    scene = Street(vehicles=(ego,)).scene([(Radar(name="f", mount=Pose(x=2.32, z=0.5)), "ego")])
    return replace(scene, actors=(*scene.actors, body))


def point_scene():
    """A turning radar, and a point that a turning body carries."""
    scene = small_plate()
    point = replace(
        scene.actors[1],
        mesh=Actor(name="none", kind="object").mesh,
        points=(PointScatterer(position=(1.0, 2.0, 0.5), rcs=1.0),),
    )
    return replace(scene, actors=(scene.actors[0], point))


BENDS = {
    "direct path": ("line of sight", (0, 1), street()),
    "edges of a turning car": ("diffraction", (0, 1), behind(0.6)),
    "mirror in the road": ("mirrors", (0, 1), street()),
    "point": ("points", (0, 0), point_scene()),
    "corner of walls": ("corners", (0, 0), two_walls()),
}


def strongest(paths):
    """Rate and acceleration of the length of the strongest path, m/s and m/s²."""
    number = np.argmax(np.abs(paths.transfer[:, 0, 0]))
    some = paths.delay_rate[number], paths.delay_acceleration[number]
    return np.array(some) * SPEED_OF_LIGHT


@pytest.mark.parametrize("case", BENDS)
def test_the_length_bends_as_the_turn_bends_it(case, compare):
    """The acceleration is the slope of the rate of the strongest path; without the turn it is off.

    The strongest of many edge waves is a mean over edges, which change within a millisecond.
    """
    part, pair, scene = BENDS[case]
    straight = replace(scene, actors=tuple(replace(a, yaw_rate=0.0) for a in scene.actors))
    step = 1e-3
    early, now, late = (strongest(traced(scene.at(t), part, pair)) for t in (-step, 0.0, step))
    slope, without = (late[0] - early[0]) / (2 * step), strongest(traced(straight, part, pair))
    tolerance = 0.8 if case == "edges of a turning car" else 1e-3
    compare(
        page="paths",
        case=f"{case}, radar or body turns",
        quantity="acceleration of the path's length, m/s²",
        expected=slope,
        measured=now[1],
        tolerance=tolerance,
        source="difference of the rates of two traces, 2 ms apart",
    )
    assert abs(without[1] - slope) > 1.5 * tolerance


def test_the_echo_of_a_small_plate_bends_as_the_turn_bends_it():
    """Fields a millisecond before and after tell the second derivative.

    The mean of the phase's errors is that of an even term, k·a·t²/2 for an error of a.
    """
    scene, step = small_plate(), 1e-3
    now = traced(scene, "facets of car", (0, 0))
    turned = [
        np.angle(field(now, time) / field(traced(scene.at(time), "facets of car", (0, 0))))
        for time in (-step, step)
    ]
    wavenumber = 2 * np.pi * FREQUENCY / SPEED_OF_LIGHT
    assert abs(np.mean(turned)) / (0.5 * wavenumber * step**2) < 0.02


def test_a_body_goes_round_a_circle():
    """Ten steps of a tenth are one step, the radius is v over the yaw rate, and the speed stays."""
    body = Actor(name="a", kind="object", velocity=(6.0, 1.0, 0.0), yaw_rate=-0.8)
    once, often = body.at(1.0), body
    for _ in range(10):
        often = often.at(0.1)
    assert often.pose.position == pytest.approx(once.pose.position, abs=1e-12)
    assert often.velocity == pytest.approx(once.velocity, abs=1e-12)
    assert once.pose.yaw == pytest.approx(-0.8)
    centre = np.array([1.0, -6.0, 0.0]) / 0.8
    radius = math.hypot(6.0, 1.0) / 0.8
    assert np.linalg.norm(once.pose.position - centre) == pytest.approx(radius, rel=1e-12)


@pytest.mark.parametrize("body", ["sedan", "van", "articulated-truck"])
def test_the_rear_axle_moves_along_the_heading(body):
    """Of all points on the middle line, only the rear axle has no velocity across the vehicle."""
    from polychirp.traffic.vehicle import rear_axle_x

    vehicle = Vehicle(
        name="a", body=body, x=3.0, y=2.0, heading=0.7, speed=5.0, yaw_rate=0.4, coarseness=4.0
    )
    actor = vehicle.actor()
    ahead = np.array([math.cos(0.7), math.sin(0.7), 0.0])
    axle = actor.pose.to_outer(np.array([rear_axle_x(body), 0.0, 0.0]))
    assert actor.velocity_at(axle) == pytest.approx(5.0 * ahead, abs=1e-12)
    nose = actor.velocity_at(axle + 3.0 * ahead)
    assert nose @ np.array([-ahead[1], ahead[0], 0.0]) == pytest.approx(1.2)


def test_the_true_range_rate_is_the_slope_of_the_distance_to_the_same_point():
    """The point is part of a turning body, and the radar's vehicle turns."""
    scene, step = point_scene(), 1e-5
    early, late = (truth(scene.at(t), 0, ["car"]).range[0] for t in (-step, step))
    rate = truth(scene, 0, ["car"]).range_rate[0]
    assert rate == pytest.approx((late - early) / (2 * step), abs=1e-5)


def test_limbs_turn_with_their_body():
    """The rate of a bicycle's strongest part is the slope of its delay."""
    bicycle = Bicycle(name="bike", x=8.0, y=2.0, heading=2.0, speed=4.0, yaw_rate=0.9)
    ego = Vehicle(name="ego", x=0.0, y=0.0, speed=8.0, yaw_rate=0.5, coarseness=3.0)
    scene = Street(vehicles=(ego,), bicycles=(bicycle,)).scene(
        [(Radar(name="f", mount=Pose(x=2.32, z=0.5)), "ego")]
    )
    error, change = errors(scene, "parts of bike", (0, 0), 4e-6)
    assert change > 0.04
    assert error < 2e-4


def test_an_array_turns_with_its_vehicle():
    """Leads of elements and amplitudes change as those of a trace 0.1 ms later."""
    array = AntennaArray(num_channels=2, spacing=0.02, pattern=ElementPattern())
    ego = Actor(name="ego", kind="vehicle", velocity=(0.0, 0.0, 0.0), yaw_rate=0.9)
    post = Actor(
        name="post",
        kind="object",
        pose=Pose(x=10.0, y=6.0),
        points=(PointScatterer(position=(0.0, 0.0, 0.0), rcs=1.0),),
    )
    radar = Radar(name="f", array=array, mount=Pose(yaw=0.3))
    scene = Scene(time=0.0, actors=(ego, post), radars=(radar,), carriers=(0,))
    step, links = 1e-4, []
    for time in (0.0, step):
        moment = scene.at(time)
        links.append(links_between(moment, FreeSpace().trace(moment), victim=0, transmitter=0))
    now, later = links
    assert now.element_delay_rate[0, 1] == pytest.approx(
        (later.element_delay - now.element_delay)[0, 1] / step, rel=1e-3
    )
    assert abs(now.element_delay_rate[0, 1]) > 0.5 * 0.9 * 0.01 / SPEED_OF_LIGHT
    slope = (later.amplitude - now.amplitude)[0] / step
    assert now.amplitude_rate[0] == pytest.approx(slope, rel=1e-3)
    # all snapshots of a frame may be given with one scene
    again = links_between(scene, FreeSpace().trace(scene.at(step)), victim=0, transmitter=0)
    assert again.element_delay == pytest.approx(later.element_delay, rel=1e-9)
    assert again.amplitude == pytest.approx(later.amplitude, rel=1e-9)


def test_a_body_with_plates_cannot_turn():
    flat = Plate(
        centre=(0.0, 0.0, 0.0),
        half_u=(1.0, 0.0, 0.0),
        half_v=(0.0, 1.0, 0.0),
        material="metal",
        part="gate",
    )
    with pytest.raises(InputError, match="'gate' turns and has plates"):
        Actor(name="gate", kind="object", plates=(flat,), yaw_rate=0.1)


NUM_DRAWN = 45
"""Drawn streets of the next test."""


def drawn_street(rng):
    """A turning car with a radar, another turning car, and a parked one."""
    ego = Vehicle(
        name="ego",
        x=0.0,
        y=0.0,
        speed=rng.uniform(3.0, 9.0),
        yaw_rate=math.radians(rng.uniform(15.0, 40.0)) * rng.choice([-1.0, 1.0]),
    )
    car = Vehicle(
        name="car",
        x=rng.uniform(8.0, 14.0),
        y=rng.uniform(-6.0, 6.0),
        heading=rng.uniform(0.0, 2.0 * math.pi),
        speed=rng.uniform(2.0, 9.0),
        yaw_rate=math.radians(rng.uniform(-40.0, 40.0)),
    )
    parked = Vehicle(
        name="parked",
        x=rng.uniform(20.0, 24.0),
        y=rng.uniform(-6.0, 6.0),
        heading=rng.uniform(0.0, 2.0 * math.pi),
    )
    return Street(vehicles=(ego, car, parked), road=Road(length=110.0, width=40.0, x=30.0))


@pytest.mark.slow
@pytest.mark.parametrize("waveform", ["conventional", "diverse"])
def test_turning_cars_are_found_by_a_turning_radar(waveform):
    """All cars in sight, on streets drawn for this test alone, with accelerations by the turns."""
    from polychirp.study.paper.scenarios import WAVEFORMS
    from polychirp.study.spec import Study, StudyRadar
    from polychirp.study.trial import run_trial

    rng, found, in_sight = np.random.default_rng(77), 0, 0
    for seed in range(NUM_DRAWN):
        radar = StudyRadar(
            name="front",
            vehicle="ego",
            mount=Pose(x=2.32, z=0.5),
            waveform=WAVEFORMS[waveform],
        )
        study = Study(
            name="turn", seed=seed, street=drawn_street(rng), radars=(radar,), tracer=TRACER
        )
        (victim,) = run_trial(study).victims
        found += int(np.sum(victim.score.is_detected & victim.truth.is_visible))
        in_sight += int(np.sum(victim.truth.is_visible))
    assert in_sight > 1.5 * NUM_DRAWN
    assert found >= 0.95 * in_sight, f"{found} of {in_sight}"
