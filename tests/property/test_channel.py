"""What no tracer may break: reciprocity, and a world that has no preferred place or bearing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polychirp.channel.base import RayTracer
from polychirp.channel.composite import Composite
from polychirp.channel.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around, box, mesh_of, plate, transfer_at

BODY = mesh_of(box((0.4, 0.3, 0.2), 0.04))
PANE = mesh_of(plate(0.3, 0.04), "glass")
TRACERS = [FreeSpace(), Composite(dynamic_range=1e12)]
METRES = st.floats(-3, 3)


def street(turn=0.0, dx=0.0, dy=0.0, *, tilt=0.3):
    """Two bodies, a point, road and wall, and two radars; the whole turned and moved."""
    c, s = np.cos(turn), np.sin(turn)

    def at(x, y, z, yaw=0.0, pitch=0.0):
        return Pose(x=c * x - s * y + dx, y=s * x + c * y + dy, z=z, yaw=yaw + turn, pitch=pitch)

    def along(x, y):
        return (c * x - s * y, s * x + c * y, 0.0)

    plates = (
        Plate(centre=(0, 0, 0), half_u=(40, 0, 0), half_v=(0, 9, 0), material="asphalt", part="r"),
        Plate(centre=(0, 5, 3), half_u=(30, 0, 0), half_v=(0, 0, 3), material="concrete", part="w"),
    )
    actors = [
        Actor(
            name="box", kind="object", mesh=BODY, pose=at(7, 1, 0.6, tilt), velocity=along(-9, 1)
        ),
        Actor(name="pane", kind="object", mesh=PANE, pose=at(9, -2, 0.7, 2.8, 0.1)),
        Actor(
            name="point",
            kind="object",
            pose=at(5, -1, 1),
            points=(PointScatterer(position=(0, 0, 0), rcs=0.5),),
        ),
        Actor(name="street", kind="road", pose=at(0, 0, 0), plates=plates),
    ]
    places = [at(0, 0, 0.5).position, at(1, 2.5, 0.8).position]
    return around(actors, places, velocities=[along(3, 0), along(-2, 1)])


@pytest.mark.parametrize("tracer", TRACERS)
def test_it_is_a_ray_tracer(tracer):
    assert isinstance(tracer, RayTracer)
    assert "line-of-sight" in tracer.capabilities


@pytest.mark.parametrize("tracer", TRACERS)
@given(tilt=st.floats(-1, 1))
@settings(max_examples=8)
def test_exchanging_transmitter_and_receiver_transposes_the_channel(tracer, tilt):
    """Reciprocity of a still world: H_ij(f) = H_ji(f)ᵀ."""
    scene = street(tilt=tilt)
    still = around(
        [Actor(name=a.name, kind=a.kind, pose=a.pose, mesh=a.mesh, plates=a.plates, points=a.points)
         for a in scene.actors[2:]],
        scene.radar_position,
    )  # fmt: skip
    paths = tracer.trace(still)
    for frequency in (78.7e9, 79e9):
        there = transfer_at(paths, frequency, 0, 1)
        back = transfer_at(paths, frequency, 1, 0)
        np.testing.assert_allclose(there, back.T, atol=1e-9 * np.abs(there).max())
        for own in (0, 1):
            echo = transfer_at(paths, frequency, own, own)
            np.testing.assert_allclose(echo, echo.T, atol=1e-5 * np.abs(echo).max())


@pytest.mark.parametrize("tracer", TRACERS)
@given(turn=st.floats(-3, 3), dx=METRES, dy=METRES)
@settings(max_examples=8)
def test_moving_and_turning_the_world_changes_nothing(tracer, turn, dx, dy):
    """Delays, rates and matrices stay; V and H refer to the vertical, so turns are about it."""
    one, other = tracer.trace(street()), tracer.trace(street(turn, dx, dy))
    for t, x in ((0, 0), (0, 1), (1, 0), (1, 1)):
        for frequency in (78.7e9, 79e9):
            expected = transfer_at(one, frequency, t, x)
            found = transfer_at(other, frequency, t, x)
            np.testing.assert_allclose(found, expected, atol=2e-5 * np.abs(expected).max())
    strongest, its_twin = (np.argmax(np.abs(p.transfer[:, 0, 0])) for p in (one, other))
    rate = pytest.approx(one.delay_rate[strongest], rel=1e-6, abs=0)
    assert other.delay_rate[its_twin] == rate


@given(distance=st.floats(2, 40), bearing=st.floats(-1.5, 1.5))
@settings(max_examples=20)
def test_the_composite_agrees_with_free_space_in_an_empty_world(distance, bearing):
    place = (distance * np.cos(bearing), distance * np.sin(bearing), 0.2)
    target = Actor(
        name="t",
        kind="object",
        pose=Pose(x=3.0, y=-1.0),
        points=(PointScatterer(position=(0, 0, 0), rcs=2.0),),
    )
    scene = around([target], [(0, 0, 0), place], velocities=[(1, 0, 0), (0, -7, 0)])
    exact, found = FreeSpace().trace(scene), Composite(dynamic_range=1e9).trace(scene)
    for field in ("transmitter", "receiver", "delay", "delay_rate", "transfer", "arrival"):
        np.testing.assert_array_equal(getattr(found, field), getattr(exact, field))


def test_the_number_of_threads_changes_no_bit():
    import numba

    tracer, scene = TRACERS[1], street()
    many = tracer.trace(scene)
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        one = tracer.trace(scene)
    finally:
        numba.set_num_threads(before)
    np.testing.assert_array_equal(many.transfer, one.transfer)
    np.testing.assert_array_equal(many.delay, one.delay)


def test_a_trace_leaves_nothing_weaker_than_the_dynamic_range():
    paths = Composite(dynamic_range=1e3).trace(street())
    power = np.max(np.abs(paths.transfer) ** 2, axis=(1, 2))
    for t, x in ((0, 0), (0, 1), (1, 0), (1, 1)):
        mine = power[(paths.transmitter == t) & (paths.receiver == x)]
        assert mine.min() >= mine.max() / 1e3
