"""A wave between two radars, and from a point back to them, in an empty world."""

import numpy as np
import pytest

from polychirp.channel.geometry.retarded_delay import retarded_leg
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around
from polychirp.units import to_db

WAVELENGTH = SPEED_OF_LIGHT / 79e9
BOTH = pytest.mark.parametrize("tracer", [FreeSpace(), Composite()])


def point(place, *, rcs=1.0, velocity=(0.0, 0.0, 0.0)):
    x, y, z = place
    return Actor(
        name="target",
        kind="object",
        pose=Pose(x=x, y=y, z=z),
        velocity=velocity,
        points=(PointScatterer(position=(0.0, 0.0, 0.0), rcs=rcs),),
    )


@BOTH
def test_the_direct_path_obeys_friis(compare, tracer):
    """|A|² = (λ/4πd)², and V keeps its sign while H, turned with the antenna, changes it."""
    paths = tracer.trace(around([], [(0, 0, 0.5), (10, 3, 0.5)]))
    distance = np.hypot(10, 3)
    assert paths.num_paths == 2
    assert set(zip(paths.transmitter, paths.receiver, strict=True)) == {(0, 1), (1, 0)}
    np.testing.assert_allclose(paths.delay, distance / SPEED_OF_LIGHT, rtol=1e-14)
    expected = WAVELENGTH / (4 * np.pi * distance) * np.diag([1, -1])
    np.testing.assert_allclose(paths.transfer[0], expected, atol=1e-17)
    compare(
        page="paths",
        case=f"{tracer.kind}, 10.44 m",
        quantity="gain of the line of sight, dB",
        expected=20 * np.log10(WAVELENGTH / (4 * np.pi * distance)),
        measured=float(to_db(np.abs(paths.transfer[0, 0, 0]) ** 2)),
        tolerance=1e-3,
        source="Friis: (λ/4πd)²",
    )


@BOTH
def test_a_radar_receives_itself_only_by_echo(tracer):
    assert tracer.trace(around([], [(0, 0, 0.5)])).num_paths == 0


@BOTH
def test_two_radars_at_one_place_are_refused(tracer):
    """The Friis equation has no value at distance 0."""
    with pytest.raises(InputError, match="radars '0' and '1' are at the same position"):
        tracer.trace(around([], [(0, 0, 0.5), (0, 0, 0.5)]))


@BOTH
def test_a_point_obeys_the_radar_equation(compare, tracer):
    """|A|² = σλ²/((4π)³ r₁² r₂²), for the own echo and between two radars."""
    paths = tracer.trace(around([point((0, 0, 0), rcs=3.0)], [(10, 0, 0), (0, 20, 0)]))
    legs = np.array([10.0, 20.0])
    echoes = paths.select(paths.num_bounces == 1)
    assert echoes.num_paths == 4
    for p in range(4):
        r1, r2 = legs[echoes.transmitter[p]], legs[echoes.receiver[p]]
        expected = 3.0 * WAVELENGTH**2 / ((4 * np.pi) ** 3 * r1**2 * r2**2)
        power = np.abs(np.diag(echoes.transfer[p])) ** 2
        np.testing.assert_allclose(power, expected, rtol=1e-12)
        assert echoes.delay[p] * SPEED_OF_LIGHT == pytest.approx(r1 + r2, rel=1e-14)
    compare(
        page="paths",
        case=f"{tracer.kind}, 3 m² at 10 m",
        quantity="gain of the echo of a point, dB",
        expected=10 * np.log10(3.0 * WAVELENGTH**2 / ((4 * np.pi) ** 3 * 10.0**4)),
        measured=float(to_db(np.abs(echoes.transfer[0, 0, 0]) ** 2)),
        tolerance=1e-3,
        source="radar equation: σλ²/((4π)³R⁴)",
    )


@BOTH
def test_eight_metres_per_second_shift_79_gigahertz_by_4216_hertz(compare, tracer):
    """2v/λ = 2 · 8 · 79e9/c = 4216.250 Hz; during the flight a target goes v/c further."""
    scene = around([point((10, 0, 0), velocity=(-8.0, 0, 0))], [(0, 0, 0)])
    compare(
        page="paths",
        case=f"{tracer.kind}, point, 8 m/s",
        quantity="Doppler shift at 79 GHz, Hz",
        expected=4216.250,
        measured=float(-79e9 * tracer.trace(scene).delay_rate[0]),
        tolerance=1e-3,
        source="2v/λ",
    )


@BOTH
def test_a_receding_target_is_seen_where_it_was(tracer):
    """Received at t, the wave met the target at t − τ/2: cτ/2 = R + v(t − τ/2)."""
    scene = around([point((10, 0, 0), velocity=(50.0, 0, 0))], [(0, 0, 0)])
    for time in (0.0, 3e-3):
        paths = tracer.trace(scene.at(time))
        expected = 2 * (10.0 + 50.0 * time) / (SPEED_OF_LIGHT + 50.0)
        assert paths.delay[0] == pytest.approx(expected, rel=1e-14, abs=0)
        rate = 100.0 / (SPEED_OF_LIGHT + 50.0)
        assert paths.delay_rate[0] == pytest.approx(rate, rel=1e-12, abs=0)


def test_the_delay_is_that_of_light_between_moving_bodies():
    """|X(t) − S(t−τ)| = cτ, whatever the motion: here speeds of a hundredth of light's."""
    rng = np.random.default_rng(1)
    source, sink = rng.normal(size=(2, 50, 3)) * 30
    vs, vx = rng.normal(size=(2, 50, 3)) * 3e6
    late = rng.uniform(0, 1e-6, 50)

    def leg(time):
        return retarded_leg(
            source=source + vs * time,
            source_velocity=vs,
            sink=sink + vx * time,
            sink_velocity=vx,
            later_delay=late + 0.25 * time,
            later_delay_rate=0.25,
        )

    delay, rate, flight = leg(0.0)
    arrival = sink - vx * late[:, None]
    start = source - vs * (late + delay)[:, None]
    np.testing.assert_allclose(arrival - start, SPEED_OF_LIGHT * delay[:, None] * flight, atol=1e-9)
    step = 1e-9
    change = (leg(step)[0] - leg(-step)[0]) / (2 * step)
    np.testing.assert_allclose(rate, change, atol=1e-6)
