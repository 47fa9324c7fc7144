"""Invariances of all tracers: reciprocity, energy, and no preferred place or scale."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polychirp.channel.base import RayTracer
from polychirp.channel.materials.fresnel import half_space, roughness_factor, sheet
from polychirp.channel.materials.library import NamedMaterial, known_materials
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around, box, mesh_of, plate, transfer_at
from polychirp.threads import limit_cores
from tests.support.references.physical_optics import scattered

BODY = mesh_of(box((0.4, 0.3, 0.2), 0.04))
PANE = mesh_of(plate(0.3, 0.04), "glass")
TRACERS = [FreeSpace(), Composite(dynamic_range=1e12)]
METRES = st.floats(-3, 3)
PERMITTIVITIES = st.builds(lambda e, loss: complex(e, -loss), st.floats(1, 30), st.floats(0, 30))
COSINES = st.floats(1e-3, 1)
ANY_BAND = {"lowest_frequency": 1e9, "highest_frequency": 1e12}
SCALED_TABLE = (
    NamedMaterial(name="metal", conductivity=float("inf"), **ANY_BAND),
    NamedMaterial(name="stone", relative_permittivity=5.0, **ANY_BAND),
)
"""Materials without losses, or perfect conductors, so that only lengths over λ count."""


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
    tracer, scene = TRACERS[1], street()
    limit_cores(2)
    many = tracer.trace(scene)
    limit_cores(1)
    try:
        one = tracer.trace(scene)
    finally:
        limit_cores(None)
    np.testing.assert_array_equal(many.transfer, one.transfer)
    np.testing.assert_array_equal(many.delay, one.delay)


def test_a_trace_leaves_nothing_weaker_than_the_dynamic_range():
    paths = Composite(dynamic_range=1e3).trace(street())
    power = np.max(np.abs(paths.transfer) ** 2, axis=(1, 2))
    for t, x in ((0, 0), (0, 1), (1, 0), (1, 1)):
        mine = power[(paths.transmitter == t) & (paths.receiver == x)]
        assert mine.min() >= mine.max() / 1e3


@given(permittivity=PERMITTIVITIES, thickness=st.floats(1e-5, 0.05), cosine=COSINES)
def test_no_surface_returns_more_than_it_gets(permittivity, thickness, cosine):
    """|R|² + |T|² ≤ 1 for a sheet, |Γ| ≤ 1 for a half-space, and ρ ≤ 1, whatever they are of."""
    rs, rp, ts, tp = sheet(permittivity, thickness, cosine, 79e9)
    assert abs(rs) ** 2 + abs(ts) ** 2 <= 1 + 1e-12
    assert abs(rp) ** 2 + abs(tp) ** 2 <= 1 + 1e-12
    assert np.max(np.abs(half_space(permittivity, cosine))) <= 1 + 1e-12
    assert 0 <= roughness_factor(thickness, cosine, 79e9) <= 1


@given(permittivity=st.floats(1, 30), thickness=st.floats(1e-5, 0.05), cosine=COSINES)
def test_a_sheet_without_loss_keeps_all_power(permittivity, thickness, cosine):
    rs, rp, ts, tp = sheet(permittivity, thickness, cosine, 79e9)
    assert abs(rs) ** 2 + abs(ts) ** 2 == pytest.approx(1, abs=1e-9)
    assert abs(rp) ** 2 + abs(tp) ** 2 == pytest.approx(1, abs=1e-9)


@pytest.mark.slow
@given(side=st.floats(2, 5), tilt=st.floats(0, 0.8))
@settings(max_examples=4)
def test_a_plate_returns_no_more_than_it_intercepts(side, tilt):
    """Power over the hemisphere before a conductor ≤ A cosθ; less of it, the smaller the plate.

    Its other half of the extinction is the shadow, behind. What physical optics loses is the
    part of its lobes beyond grazing, of order λ/side. Above and below are alike.
    """
    far, wavelength = 3000.0, SPEED_OF_LIGHT / 79e9
    size, metal = side * wavelength, known_materials()["metal"]
    corners = plate(size, wavelength)
    source = far * np.array([np.cos(tilt), np.sin(tilt), 0.0])
    node, weight = np.polynomial.legendre.leggauss(14)
    returned = 0.0
    for c, w in zip(0.5 * (node + 1), 0.5 * weight, strict=True):
        for turn in np.pi * (np.arange(14) + 0.5) / 14:
            s = np.sqrt(1 - c**2)
            way = np.array([c, s * np.cos(turn), s * np.sin(turn)])
            column = scattered(corners, metal, source, far * way, 79e9)[:, 0]
            section = np.sum(np.abs(column) ** 2) * (4 * np.pi) ** 3 * far**4 / wavelength**2
            returned += 0.5 * w / 14 * section  # the hemisphere is half of all directions
    assert 1 - 0.4 / side < returned / (size**2 * np.cos(tilt)) < 1


@given(scale=st.floats(0.25, 4), tilt=st.floats(-0.6, 0.6))
@settings(max_examples=8)
def test_a_world_of_another_size_is_the_same_at_another_wavelength(scale, tilt):
    """All lengths times s, frequency over s: Maxwell's equations give the same transfer.

    A dimensionless number per pair; delays times s. (Cells of 4 cm do not scale, but their
    weights add to one; shadow rays start 3 mm off a facet at any scale, so no body hides any.)
    """

    def world(s):
        size = (0.12 * s, 0.09 * s, 0.06 * s)
        body = Actor(
            name="box",
            kind="object",
            mesh=mesh_of(box(size, 0.02 * s)),
            pose=Pose(x=3 * s, y=1 * s, z=0.6 * s, yaw=tilt),
        )
        wall = Plate(
            centre=(0, 4 * s, 0),
            half_u=(2 * s, 0, 0),
            half_v=(0, 0, 0.7 * s),
            material="stone",
            part="wall",
        )
        places = [(0, 0, 0.5 * s), (0.3 * s, 1.1 * s, 0.7 * s)]
        street = Actor(name="street", kind="building", plates=(wall,))
        scene = around([body, street], places)
        tracer = Composite(frequency=79e9 / s, dynamic_range=1e14, materials=SCALED_TABLE)
        paths = tracer.trace(scene)
        assert np.any(paths.is_mirrored)
        return paths

    one, other = world(1.0), world(scale)
    for t, x in ((0, 0), (0, 1), (1, 0), (1, 1)):
        expected = transfer_at(one, 79e9, t, x)
        found = transfer_at(other, 79e9 / scale, t, x)
        np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max())
