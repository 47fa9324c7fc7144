"""Paths through a frame: what is traced again when, and how wrong what lies between may be."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel import follow as module
from polychirp.channel.base import Part
from polychirp.channel.composite import Composite
from polychirp.channel.follow import ERROR, follow
from polychirp.channel.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, plate, transfer_at

TIMES = np.arange(9) * 1e-3
CAR = mesh_of(box((4.0, 1.8, 1.4), 0.03))
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
    """How often each part is traced, by name, and by name and pair."""
    counts = {}
    parts = type(tracer).parts

    def noted(self, world):
        def one(part):
            def trace(world, pairs, strongest):
                for key in (part.name, *((part.name, *pair) for pair in pairs.tolist())):
                    counts[key] = counts.get(key, 0) + 1
                return part.trace(world, pairs, strongest)

            return Part(part.name, trace)

        return tuple(one(part) for part in parts(self, world))

    monkeypatch.setattr(type(tracer), "parts", noted)
    return counts


def test_what_passes_by_is_traced_often_and_what_stands_ahead_seldom(monkeypatch):
    tracer = Composite()
    counts = counted(tracer, monkeypatch)
    follow(tracer, street(), TIMES)
    assert counts["facets of beside"] == len(TIMES)
    assert counts["facets of ahead"] == 2


def test_a_body_is_traced_often_for_the_radar_that_it_passes_alone(monkeypatch):
    tracer = Composite(max_bounces=1)
    counts = counted(tracer, monkeypatch)
    beside = car("beside", x=1.0, y=2.5, speed=25.0)
    paths = follow(tracer, around([beside], [(0, 0, 0.6), (-60.0, 0, 0.6)]), TIMES)
    assert counts["facets of beside", 0, 0] == len(TIMES)
    assert counts["facets of beside", 1, 1] == 2
    assert all(np.any((table.transmitter == 1) & (table.receiver == 1)) for table in paths)


def response(paths, pair, frequencies):
    return np.array([transfer_at(paths, f, *pair)[0, 0] for f in frequencies])


def test_between_two_traces_paths_are_as_wrong_as_stated():
    """Against tracing anew, at the times that no trace of the far car fell on: a few times the
    stated power at most, since the stated error is that at the end of half a step."""
    tracer, scene = Composite(), street()
    band = np.linspace(78.5e9, 79.5e9, 33)
    for paths, time in zip(follow(tracer, scene, TIMES), TIMES, strict=True):
        anew = tracer.trace(scene.at(float(time)))
        for pair in ((0, 0), (0, 1), (1, 0), (1, 1)):
            old, new = (response(table, pair, band) for table in (paths, anew))
            assert np.sum(np.abs(old - new) ** 2) <= 4 * ERROR * np.sum(np.abs(new) ** 2)


def test_a_coherence_time_is_when_extrapolation_is_half_wrong():
    """The power wrong after a time, as the table says it, against tracing then."""
    tracer = Composite(reflecting_planes=False)
    scene = around([car("beside", x=3.0, y=3.0, speed=15.0)], [(0, 0, 0.6)])
    paths, band = tracer.trace(scene), np.linspace(78.5e9, 79.5e9, 65)
    power = np.abs(paths.transfer[:, 0, 0]) ** 2
    for elapsed in (0.5e-3, 1e-3, 2e-3):
        wrong = np.minimum(1.0, 0.5 * (elapsed / paths.coherence_time) ** 2) ** 2
        moved = np.exp(-2j * np.pi * band[:, None] * (paths.delay + paths.delay_rate * elapsed))
        new = response(tracer.trace(scene.at(elapsed)), (0, 0), band)
        found = np.sum(np.abs(moved @ paths.transfer[:, 0, 0] - new) ** 2)
        said, found = np.sum(power * wrong) / np.sum(power), found / np.sum(np.abs(new) ** 2)
        assert found == pytest.approx(said, rel=3.0)
        assert said == pytest.approx(found, rel=3.0)


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
    paths = follow(Composite(), street(), TIMES[:2], receivers=[1])[0]
    assert set(paths.receiver) == {1}
    assert set(paths.transmitter) == {0, 1}


def test_at_the_time_of_a_trace_the_paths_are_those_of_the_tracer():
    scene, tracer = street(), Composite()
    first, alone = follow(tracer, scene, TIMES)[0], tracer.trace(scene)
    np.testing.assert_array_equal(first.delay, alone.delay)
    np.testing.assert_array_equal(first.transfer, alone.transfer)


def test_a_tracer_without_parts_traces_everything_at_every_time():
    scene = street()
    found = follow(FreeSpace(), scene, TIMES)
    assert [paths.reference_time for paths in found] == TIMES.tolist()
    np.testing.assert_array_equal(found[3].delay, FreeSpace().trace(scene.at(3e-3)).delay)


def test_shadows_are_renewed_even_if_nothing_moves(monkeypatch):
    tracer = Composite()
    counts = counted(tracer, monkeypatch)
    still = around([car("ahead", x=12.0, y=0.0, speed=0.0)], [(0, 0, 0.6)])
    times = np.arange(0, 3.01 * module.LONGEST, 1e-3)
    follow(tracer, still, times)
    assert counts["facets of ahead"] == 4
