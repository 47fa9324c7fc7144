"""Bounces between curved bodies against stationary phase on true spheres."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, sphere, transfer_at
from polychirp.units import to_db
from tests.support.references.two_spheres import Spheres, length_and_gain

FREQUENCY = 79e9
WAVENUMBER = 2 * np.pi * FREQUENCY / SPEED_OF_LIGHT
FACET = 0.03
"""Edges of the spheres' facets, m, as of the cars in a street."""
TRACER = Composite(max_bounces=2, dynamic_range=1e10)


class Draw:
    """Two spheres, a transmitter and a receiver, all in motion; lengths in m, speeds in m/s."""

    def __init__(self, seed):
        rng = np.random.default_rng([7151, seed])
        middle = np.array([[3.0, 0.0, 0.0], [3.8, 1.3, 0.2]])
        self.spheres = Spheres(middle + rng.uniform(-0.2, 0.2, (2, 3)), rng.uniform(0.2, 0.4, 2))
        self.ends = np.array([[0.0, 0.0, 0.0], [0.4, 1.2, 0.2]])
        speed = rng.uniform(-12.0, 12.0, (4, 2))
        self.speed = np.column_stack([speed, np.zeros(4)])

    @property
    def scene(self):
        bodies = [
            Actor(
                name=name,
                kind="object",
                mesh=mesh_of(sphere(radius, FACET)),
                pose=Pose(x=centre[0], y=centre[1], z=centre[2]),
                velocity=tuple(speed),
            )
            for name, centre, radius, speed in zip(
                ("first", "last"), *self.spheres, self.speed[:2], strict=True
            )
        ]
        return around(bodies, list(self.ends), velocities=list(self.speed[2:]))

    def expected(self, time=0.0):
        """Length, m, and gain of the way over the first sphere and then the last."""
        moved = self.spheres.centre + time * self.speed[:2]
        ends = self.ends + time * self.speed[2:]
        return length_and_gain(Spheres(moved, self.spheres.radius), *ends)


def paths_over(draw, time=0.0, *, tube=1.25e-3):
    """Paths from the first radar over the first sphere and then the last to the second radar."""
    world = TRACER.prepare(draw.scene.at(time))
    found = tube_paths(world, np.array([[0, 1]]), tube=tube, coarsest=tube, max_bounces=2)
    first = found.bounce_actor[found.bounce_start[:-1]]
    names = [world.scene.actors[actor].name for actor in first]
    return found.select((np.array(names) == "first") & (found.transmitter == 0))


@pytest.mark.parametrize("seed", range(6))
def test_a_wave_over_two_spheres_is_that_of_geometrical_optics(compare, seed):
    """Power and phase, where a mirror of flat facets would be wrong by 5 to 20 dB."""
    draw = Draw(seed)
    length, gain = draw.expected()
    expected = gain / (2 * WAVENUMBER) * np.exp(-1j * WAVENUMBER * length)
    # two metal mirrors turn the field over twice
    found = transfer_at(paths_over(draw), FREQUENCY, 0, 1)
    measured = np.sqrt(abs(np.linalg.det(found)))
    compare(
        page="multi-bounce",
        case=f"two spheres, draw {seed}",
        quantity="gain, dB",
        expected=float(to_db(abs(expected) ** 2)),
        measured=float(to_db(measured**2)),
        tolerance=1.0,
        source="stationary phase of both reflections",
    )
    # V and H make a right angle with the direction away from a radar, at both ends
    phase = np.angle(-np.linalg.det(found) / expected**2) / 2
    assert abs((phase + np.pi / 2) % np.pi - np.pi / 2) < np.radians(10)


@pytest.mark.parametrize("seed", range(4))
def test_a_wave_over_a_hollow_mirror_passes_two_focal_lines(seed):
    """Behind a dish that focuses the wave before a sphere, the phase is advanced by π.

    Between focus and dish tubes are narrow, and wide on the way back: half as wide, they lose 1.3
    instead of 2.2 dB at worst.
    """
    rng = np.random.default_rng([7152, seed])
    bend, radius = rng.uniform(0.5, 0.7), rng.uniform(0.2, 0.4)
    source, sink = np.array([0.0, 0.0, 0.0]), np.array([0.4, 1.2, 0.2])
    last = np.array([1.6, 1.3, 0.1]) + rng.uniform(-0.1, 0.1, 3)
    middle = np.array([3.0, 0.0, 0.0])
    normal = (source - middle) / 3.0 + (last - middle) / np.linalg.norm(last - middle)
    normal /= np.linalg.norm(normal)
    centre = middle + bend * normal
    ball = sphere(bend, 0.02)
    dish = ball[ball.mean(axis=1) @ normal < -0.8 * bend][:, ::-1]
    bodies = [
        Actor(name=name, kind="object", mesh=mesh_of(mesh), pose=Pose(x=at[0], y=at[1], z=at[2]))
        for name, mesh, at in (("first", dish, centre), ("last", sphere(radius, FACET), last))
    ]
    world = TRACER.prepare(around(bodies, [source, sink]))
    tube = 1.25e-3
    paths = tube_paths(world, np.array([[0, 1]]), tube=tube, coarsest=tube, max_bounces=2)
    names = [world.scene.actors[a].name for a in paths.bounce_actor[paths.bounce_start[:-1]]]
    one = paths.select((np.array(names) == "first") & (paths.transmitter == 0))
    length, gain = length_and_gain(
        Spheres(np.array([centre, last]), np.array([-bend, radius])), source, sink
    )
    assert gain.real < 0
    found = transfer_at(one, FREQUENCY, 0, 1)
    ratio = found / (gain / (2 * WAVENUMBER) * np.exp(-1j * WAVENUMBER * length))
    assert to_db(abs(np.linalg.det(ratio))) == pytest.approx(0.0, abs=2.5)
    assert abs(np.angle(ratio[0, 0])) < np.radians(10)


@pytest.mark.parametrize("seed", range(6))
def test_wide_tubes_that_are_cut_find_the_wave_over_two_spheres(seed):
    """The first radar's own echo by way of both, to which two directions contribute alike."""
    draw = Draw(seed)
    _, gain = length_and_gain(draw.spheres, draw.ends[0], draw.ends[0])
    world = TRACER.prepare(draw.scene)
    found = tube_paths(world, np.array([[0, 0]]), tube=1.25e-3, coarsest=0.02, max_bounces=2)
    names = [world.scene.actors[a].name for a in found.bounce_actor[found.bounce_start[:-1]]]
    one = transfer_at(found.select(np.array(names) == "first"), FREQUENCY, 0, 0)
    measured = to_db(abs(np.linalg.det(one)))
    assert measured == pytest.approx(to_db(abs(gain / (2 * WAVENUMBER)) ** 2), abs=1.5)


@pytest.mark.parametrize("seed", range(6))
def test_a_path_over_two_moving_spheres_moves_as_their_geometry_does(seed):
    draw, step = Draw(seed), 1e-3
    before, now, after = (draw.expected(time)[0] for time in (-step, 0.0, step))
    paths = paths_over(draw)
    best = int(np.argmax(np.abs(paths.transfer[:, 0, 0])))
    rate = float(paths.delay_rate[best]) * SPEED_OF_LIGHT
    bend = float(paths.delay_acceleration[best]) * SPEED_OF_LIGHT
    assert rate == pytest.approx((after - before) / (2 * step), abs=0.05)
    assert bend == pytest.approx((after + before - 2 * now) / step**2, abs=8.0, rel=0.1)


def test_paths_hold_for_some_milliseconds():
    """Extrapolated by 4 ms they are within −20 dB, in the median, of those traced then.

    With rates alone they are not even within −10 dB.
    """
    time, band = 4e-3, np.linspace(78.5e9, 79.5e9, 11)
    bent, straight = [], []
    for seed in range(4):
        draw = Draw(seed)
        now, then = (paths_over(draw, t) for t in (0.0, time))
        right = response(then, band)
        for kept, share in ((bent, 0.5), (straight, 0.0)):
            delay = now.delay + now.delay_rate * time + share * now.delay_acceleration * time**2
            wrong = response(replace(now, delay=delay), band) - right
            kept.append(to_db(np.sum(np.abs(wrong) ** 2) / np.sum(np.abs(right) ** 2)))
    assert np.median(bent) < -20
    assert np.median(straight) > -10


def response(paths, band):
    """V–V over the band."""
    wave = np.exp(-2j * np.pi * paths.delay[:, None] * band)
    return np.sum(paths.transfer[:, :1, 0] * wave, axis=0)
