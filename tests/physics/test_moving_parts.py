"""Parts of bodies that move within a frame: echoes, delays, shadows; people who walk."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from polychirp.axes import FloatArray
from polychirp.channel.base import all_pairs
from polychirp.channel.direct.moving_parts import part_echoes
from polychirp.channel.geometry.part_reflections import echoing
from polychirp.channel.scene.ground_truth import truth
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.channel.tracers.path_interpolation import interpolate_paths
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.mesh import Plate
from polychirp.model.moving_parts import Ellipsoids, Movement, MovingParts, Rods
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.testing.shapes import mesh_of, sphere
from polychirp.traffic.articulated_bodies.person import SKIN_REFLECTIVITY
from polychirp.traffic.articulated_bodies.tubes import Spokes
from polychirp.traffic.road_users import Bicycle, Motorcycle, Pedestrian

FREQUENCY = 79e9
WAVENUMBER = 2 * np.pi * FREQUENCY / SPEED_OF_LIGHT


@dataclass(frozen=True)
class Still:
    """Parts that do not move."""

    parts: MovingParts

    def parts_at(self, time: float) -> MovingParts:
        del time
        return self.parts


@dataclass(frozen=True)
class Orbit:
    """A small ball on a circle about the axis y of its actor."""

    radius: float
    rate: float

    def parts_at(self, time: float) -> MovingParts:
        turn = self.rate * time
        centre = self.radius * np.array([[np.cos(turn), 0.0, np.sin(turn)]])
        ball = Ellipsoids(centre=centre, axes=0.01 * np.eye(3)[None], reflectivity=[1.0])
        return MovingParts(ellipsoids=ball)


def seen(body: Actor, *eyes: tuple[float, float, float], time: float = 0.0) -> Scene:
    """A body, and isotropic radars at places in the world, m."""
    radars = tuple(
        Radar(name=str(n), mount=Pose(x=x, y=y, z=z), array=AntennaArray(pattern=ISOTROPIC))
        for n, (x, y, z) in enumerate(eyes)
    )
    holder = Actor(name="radars", kind="object")
    return Scene(time=time, actors=(body, holder), radars=radars, carriers=(1,) * len(radars))


def body_of(movement: Movement, **changes: object) -> Actor:
    return replace(Actor(name="body", kind="object", movement=movement), **changes)


def transfer(paths: PropagationPaths, transmitter: int = 0, receiver: int = 0) -> complex:
    """Sum of the echoes between two radars at the frequency of the paths, V to V."""
    mine = paths.select((paths.transmitter == transmitter) & (paths.receiver == receiver))
    mine = mine.select(mine.num_bounces > 0)
    turn = np.exp(-2j * np.pi * FREQUENCY * mine.delay)
    return complex(np.sum(mine.transfer[:, 0, 0] * turn))


def cross_section(scene: Scene, distance: float, *, coherent: bool = True) -> FloatArray:
    """Monostatic cross sections from all radars, which are at ``distance``, m², ``(radar,)``."""
    own = np.repeat(np.arange(len(scene.radars))[:, None], 2, axis=1)
    paths = part_echoes(scene, 0, frequency=FREQUENCY, pairs=own)
    turn = np.exp(-2j * np.pi * FREQUENCY * paths.delay)
    echo = np.zeros(len(scene.radars), dtype=complex)
    power = np.zeros(len(scene.radars))
    np.add.at(echo, paths.transmitter, paths.transfer[:, 0, 0] * turn)
    np.add.at(power, paths.transmitter, np.abs(paths.transfer[:, 0, 0]) ** 2)
    wavelength = SPEED_OF_LIGHT / FREQUENCY
    return (
        (np.abs(echo) ** 2 if coherent else power) * (4 * np.pi) ** 3 * distance**4 / wavelength**2
    )


SEMI_AXES = np.array([0.06, 0.09, 0.15])
TILT = Pose(yaw=0.3, pitch=0.2, roll=-0.1).rotation
TILTED = Still(
    MovingParts(
        ellipsoids=Ellipsoids(
            centre=np.zeros((1, 3)), axes=(TILT * SEMI_AXES).T[None], reflectivity=[1.0]
        )
    )
)


@pytest.mark.parametrize(
    ("case", "transmitter", "receiver"), [("own", 0, 0), ("40 deg apart", 0, 1)]
)
def test_an_ellipsoid_echoes_as_its_mesh_does_by_physical_optics(
    case, transmitter, receiver, compare
):
    """Geometric optics with both curvatures against the sum over 3 mm facets, at 6 m."""
    eyes = ((6.0, 0.0, 0.5), (4.5, 3.9, -0.3))
    unit = sphere(1.0, 0.025)
    mesh = mesh_of((unit * SEMI_AXES) @ TILT.T)
    solid = seen(Actor(name="solid", kind="object", mesh=mesh), *eyes)
    exact = transfer(Composite(max_bounces=1).trace(solid), transmitter, receiver)
    found = transfer(FreeSpace().trace(seen(body_of(TILTED), *eyes)), transmitter, receiver)
    ratio = found / exact
    compare(
        page="road-users",
        quantity="echo of an ellipsoid over that of its facets, dB",
        case=case,
        source="physical optics of a mesh of 2 to 4 mm",
        expected=0.0,
        measured=20 * np.log10(abs(ratio)),
        tolerance=0.3,
    )


def test_an_ellipsoid_has_the_path_length_of_its_facets():
    """Over a change of frequency the phases of both echoes turn alike: to 1 mm of path."""
    eyes = ((6.0, 0.0, 0.5), (4.5, 3.9, -0.3))
    paths = FreeSpace().trace(seen(body_of(TILTED), *eyes))
    own = paths.select((paths.transmitter == 0) & (paths.receiver == 1) & (paths.num_bounces > 0))
    (length,) = SPEED_OF_LIGHT * own.delay
    angle = np.linspace(0, 2 * np.pi, 721)
    polar = np.linspace(0, np.pi, 361)
    sphere_points = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)),
            np.outer(np.sin(polar), np.sin(angle)),
            np.outer(np.cos(polar), np.ones_like(angle)),
        ],
        axis=-1,
    )
    points = (sphere_points * SEMI_AXES) @ TILT.T
    shortest = np.min(sum(np.linalg.norm(points - np.array(eye), axis=-1) for eye in eyes))
    assert length == pytest.approx(shortest, abs=1e-5)


@pytest.mark.parametrize("slant", [0.0, 2.0, 10.0])
def test_a_tube_of_rods_echoes_as_the_integral_along_it(slant):
    """A tube of 0.6 m at 7 m, in the near field, by brute quadrature of its line current."""
    reach, radius, half = 0.02, 0.015, 0.3
    middles = np.arange(-half + reach, half - reach / 2, reach)
    direction = np.array([np.sin(np.radians(slant)), 0.3, np.cos(np.radians(slant))])
    direction /= np.linalg.norm(direction)
    count = len(middles)
    tube = Rods(
        centre=middles[:, None] * direction,
        reach=np.tile(reach * direction, (count, 1)),
        radius=np.full(count, radius),
        reflectivity=np.ones(count),
    )
    eye = np.array([7.0, 0.2, 0.1])
    found = transfer(FreeSpace().trace(seen(body_of(Still(MovingParts(rods=tube))), tuple(eye))))
    along = np.linspace(-half, half, 60001)
    window = np.clip(np.minimum(along - middles[0], middles[-1] - along) / reach + 1, 0, 1)
    window = np.sin(np.pi / 2 * window) ** 2
    points = along[:, None] * direction
    way = eye - points
    length = np.linalg.norm(way, axis=1)
    cosine = np.linalg.norm(np.cross(way / length[:, None], direction), axis=1)
    near = length - radius * cosine  # to the surface
    current = window * np.sqrt(WAVENUMBER * radius * cosine) * np.exp(-2j * WAVENUMBER * near)
    echo = np.trapezoid(current / near**2, along)
    expected = SPEED_OF_LIGHT / FREQUENCY / (4 * np.pi) ** 1.5 * abs(echo)
    broadside = SPEED_OF_LIGHT / FREQUENCY / (4 * np.pi) ** 1.5 / 49 * np.sqrt(WAVENUMBER * radius)
    assert abs(found) == pytest.approx(expected, abs=0.02 * broadside * 0.1, rel=0.03)


@pytest.mark.parametrize("angle", [0.0, 60.0, 90.0, 120.0])
def test_a_rod_scatters_to_another_radar_as_the_integral_around_it(angle):
    """Both radars are in the plane across a tube: physical optics around its circumference.

    The two-dimensional integral is over the side that both see, with the share of the currents that
    radiates towards the second radar. The tube is wide, so that the integral has one zone of
    stationary phase far from its ends.
    """
    radius, turn = 0.3, np.radians(angle)
    rod = Rods(
        centre=np.zeros((1, 3)), reach=[[0.0, 0.0, 0.05]], radius=[radius], reflectivity=[1.0]
    )
    ends = 1e4 * np.array([[np.cos(s * turn / 2), np.sin(s * turn / 2), 0.0] for s in (-1, 1)])
    there = echoing(MovingParts(rods=rod), (ends[:1], ends[1:]), wavenumber=WAVENUMBER)
    around = np.linspace(-0.5 * (np.pi - turn), 0.5 * (np.pi - turn), 40001)
    normal = np.stack([np.cos(around), np.sin(around), 0 * around], axis=-1)
    both = ends.sum(axis=0) / 1e4
    # a soft end of the integral leaves the stationary point alone
    soft = np.cos(np.pi / 2 * around / around[-1]) ** 2
    phase = WAVENUMBER * radius * normal @ both
    integral = np.trapezoid(soft * 0.5 * (normal @ both) * np.exp(1j * phase), around)
    expected = WAVENUMBER * radius / np.sqrt(np.pi) * abs(integral) * 0.05
    assert there.amplitude[0, 0] == pytest.approx(expected, rel=0.03)


def test_echoes_are_the_same_there_and_back():
    walker = Pedestrian(name="walker", x=0.0, y=0.0, speed=1.4).actor()
    scene = seen(walker, (9.0, 2.0, 0.5), (6.0, -7.0, 0.8), time=0.3)
    paths = FreeSpace().trace(scene)
    # between both instants of scattering the limbs move by 1e-8 m
    assert transfer(paths, 0, 1) == pytest.approx(transfer(paths, 1, 0), rel=1e-4)


def test_delays_follow_a_turning_part_to_third_order():
    """A point on a wheel of 0.3 m with 10 m/s, after 1 ms: |jerk| t³/6 is 2 µm there and back."""
    wheel = body_of(Orbit(radius=0.3, rate=10.0 / 0.3), velocity=(10.0, 0.0, 0.0))
    scene, late = seen(wheel, (20.0, 3.0, 1.0), time=0.013), 1e-3
    begin, end = FreeSpace().trace(scene), FreeSpace().trace(scene.at(scene.time + late))
    exact = SPEED_OF_LIGHT * end.delay[0]
    jerk = 10.0**3 / 0.3**2
    error = SPEED_OF_LIGHT * begin.delays_after(late)[0][0] - exact
    assert abs(error) < 2.2 * jerk * late**3 / 6
    straight = SPEED_OF_LIGHT * (begin.delay + begin.delay_rate * late)[0] - exact
    assert abs(straight) > 100e-6
    assert begin.delay_acceleration[0] != 0


def test_the_rate_of_a_turning_part_is_that_of_its_place():
    wheel = body_of(Orbit(radius=0.3, rate=10.0 / 0.3), velocity=(10.0, 0.0, 0.0))
    for time in (0.0, 0.02, 0.05):
        scene = seen(wheel, (2000.0, 0.0, 0.0), time=time)
        (rate,) = 0.5 * SPEED_OF_LIGHT * FreeSpace().trace(scene).delay_rate
        turn = 10.0 / 0.3 * time
        assert rate == pytest.approx(10.0 * np.sin(turn) - 10.0, abs=2e-3)


def test_the_body_hides_its_own_far_arm():
    """Seen from its left, a standing person's trunk hides the right arm."""
    stander = Pedestrian(name="stander", x=0.0, y=0.0).actor()
    scene = seen(stander, (0.0, 12.0, 1.2))
    paths = FreeSpace().trace(scene)
    assert paths.bounce_point[:, 1].max() > 0.2
    assert paths.bounce_point[:, 1].min() > -0.1


def test_a_wall_hides_a_walker_and_a_radar_beside_it_does_not_lose_him():
    walker = Pedestrian(name="walker", x=0.0, y=0.0, speed=1.4).actor()
    wall = Actor(
        name="wall",
        kind="building",
        plates=(
            Plate(
                centre=(4.0, 0.0, 1.5),
                half_u=(0.0, 1.5, 0.0),
                half_v=(0.0, 0.0, 1.5),
                material="concrete",
                part="wall",
            ),
        ),
    )
    scene = seen(walker, (9.0, 0.0, 0.5), (0.0, 9.0, 0.5))
    scene = replace(scene, actors=(*scene.actors, wall))
    paths = Composite(reflecting_planes=False, diffraction=False).trace(scene)
    assert transfer(paths, 0, 0) == 0
    assert abs(transfer(paths, 1, 1)) > 0
    found = truth(scene, 0, ["walker"])
    assert not found.is_visible[0]
    assert truth(scene, 1, ["walker"]).is_visible[0]


def test_truth_has_the_body_s_rate_and_those_of_its_limbs():
    walker = Pedestrian(name="walker", x=0.0, y=0.0, speed=1.4).actor()
    found = truth(seen(walker, (15.0, 0.0, 0.8), time=0.4), 0, ["walker"])
    assert found.range_rate[0] == pytest.approx(-1.4, abs=0.02)
    assert 14.2 < found.range[0] < 15.0
    assert found.place_range_rate.min() < -3.5
    assert found.extent(0).length < 0.9


@pytest.mark.parametrize(
    ("who", "height", "low", "high"), [("adult", 1.75, -8.0, 0.0), ("child", 1.15, -12.0, -6.0)]
)
def test_a_person_echoes_as_published(who, height, low, high, compare):
    """Mean over aspects and gait at 10 m, with no calibrated factor.

    Published means of adults at 77–79 GHz are −8 to 0 dBsm. The child's interval is the adult's,
    lowered by the ratio of the areas.
    """
    azimuth = np.radians(np.arange(0.0, 360.0, 2.0))
    eyes = [(10 * np.cos(a), 10 * np.sin(a), 0.6) for a in azimuth]
    found = []
    for phase in np.arange(8) / 8:
        walker = Pedestrian(name="w", x=0.0, y=0.0, speed=0.8 * height, height=height, phase=phase)
        found.append(cross_section(seen(walker.actor(), *eyes), 10.0))
    level = 10 * np.log10(np.mean(found))
    compare(
        page="road-users",
        quantity="mean RCS of a walker, dBsm",
        case=who,
        source="the middle of published means",
        expected=0.5 * (low + high),
        measured=level,
        tolerance=0.5 * (high - low),
    )


def test_skin_reflects_as_its_permittivity_says():
    """Debye's term of Gabriel's model of dry skin, and Fresnel's formula, by hand."""
    omega = 2 * np.pi * 77e9
    epsilon = 4.0 + 32.0 / (1 + 1j * omega * 7.234e-12)
    epsilon += 1100.0 / (1 + (1j * omega * 32.481e-9) ** 0.8)
    root = np.sqrt(epsilon)
    assert abs((1 - root) / (1 + root)) ** 2 == pytest.approx(SKIN_REFLECTIVITY, abs=0.01)


def test_interpolated_echoes_are_those_of_every_time():
    walker = replace(Pedestrian(name="w", x=0.0, y=0.0, speed=1.4, heading=2.8).actor())
    scene, times = seen(walker, (12.0, 1.0, 0.6)), 0.1 + 1e-3 * np.arange(24)
    snapshots = interpolate_paths(Composite(), scene, times)
    exact = np.array([transfer(Composite().trace(scene.at(float(t)))) for t in times])
    found = np.array([transfer(one) for one in snapshots])
    # parts are traced at each of these times, whatever their jerk is
    assert np.mean(np.abs(found - exact) ** 2) < 1e-9 * np.mean(np.abs(exact) ** 2)


def test_all_pairs_of_two_radars_have_echoes():
    walker = Pedestrian(name="walker", x=0.0, y=0.0, speed=1.4).actor()
    scene = seen(walker, (9.0, 2.0, 0.5), (6.0, -7.0, 0.8))
    paths = part_echoes(scene, 0, frequency=FREQUENCY, pairs=all_pairs(scene))
    pairs = set(zip(paths.transmitter.tolist(), paths.receiver.tolist(), strict=True))
    assert pairs == {(0, 0), (0, 1), (1, 0), (1, 1)}


@pytest.mark.parametrize(
    ("kind", "speed", "low", "high"), [(Bicycle, 5.0, -3.0, 5.0), (Motorcycle, 14.0, 0.0, 10.0)]
)
def test_two_wheelers_echo_as_published(kind, speed, low, high, compare):
    """Mean over aspects and turns of the wheels, at 10 m.

    The bicycle has no calibrated factor; the motorcycle's groups of corners are calibrated.
    """
    azimuth = np.radians(np.arange(0.0, 360.0, 3.0))
    eyes = [(10 * np.cos(a), 10 * np.sin(a), 0.6) for a in azimuth]
    found = [
        cross_section(seen(kind(name="b", x=0.0, y=0.0, speed=speed, phase=p).actor(), *eyes), 10.0)
        for p in np.arange(4) / 4
    ]
    compare(
        page="road-users",
        quantity="mean RCS, dBsm",
        case=f"{kind.__name__.lower()} with rider",
        source="the middle of published means",
        expected=0.5 * (low + high),
        measured=10 * np.log10(np.mean(found)),
        tolerance=0.5 * (high - low),
    )


def test_spokes_cover_the_rates_from_rim_to_rim():
    """Seen from behind, rates of spokes reach v (1 ± 0.30/0.345), those of frame and tyre are v."""
    speed, eye = 5.0, (-15.0, 0.3, 0.5)
    rates, frame = [], []
    for time in np.arange(40) * 1e-3:
        bike = Bicycle(name="b", x=speed * time, y=0.0, speed=speed).actor()
        paths = FreeSpace().trace(seen(bike, eye, time=time))
        rate = 0.5 * SPEED_OF_LIGHT * paths.delay_rate
        strong = np.abs(paths.transfer[:, 0, 0]) ** 2
        rates.append(rate)
        frame.append(np.sum(strong * rate) / np.sum(strong))
    whole = np.concatenate(rates)
    reach = 0.30 / 0.345
    assert whole.max() == pytest.approx(speed * (1 + reach), rel=0.08)
    assert whole.min() == pytest.approx(speed * (1 - reach), abs=0.4)
    assert np.mean(frame) == pytest.approx(speed, abs=0.5)


def test_a_spoke_flashes_every_time_that_it_is_seen_from_across():
    """With 32 spokes and 5 m/s, upright spokes pass 32 v / (2 pi r) = 74 times in a second."""
    speed, radius, count = 5.0, 0.345, 32
    wheel = Spokes(x=0.0, z=radius, count=count, inner=0.025, outer=0.3, flange=0.0, radius=1e-3)
    eye = np.array([[-40.0, 0.0, radius]])
    times = np.arange(400) * 2.5e-4
    power = []
    for time in times:
        parts = MovingParts(rods=wheel.at(speed * float(time) / radius))
        found = echoing(parts, (eye, eye), wavenumber=WAVENUMBER)
        turn = np.exp(-2j * WAVENUMBER * np.linalg.norm(found.point - eye, axis=-1))
        power.append(abs(np.sum(found.amplitude * turn)) ** 2)
    spectrum = np.abs(np.fft.rfft(np.array(power) - np.mean(power), 8 * len(times)))
    rate = np.fft.rfftfreq(8 * len(times), times[1])[np.argmax(spectrum)]
    assert rate == pytest.approx(count * speed / (2 * np.pi * radius), rel=0.02)


def test_a_wheel_rolls_without_slip():
    """The lowest point of a wheel stands, the highest one has twice the speed."""
    wheel = Spokes(x=0.0, z=0.3, count=8, inner=0.0, outer=0.6, flange=0.0, radius=1e-3)
    step, speed = 1e-6, 2.0
    tips = [wheel.at(speed * t / 0.3).centre for t in (-step, step)]
    rate = (tips[1] - tips[0])[:, 0] / (2 * step) + speed
    height = wheel.at(0.0).centre[:, 2]
    assert rate == pytest.approx(speed * height / 0.3, abs=1e-6)


def test_rims_do_not_turn_and_the_frame_is_rigid():
    ride = Bicycle(name="b", x=0.0, y=0.0, speed=5.0).actor().movement
    assert ride is not None
    now, later = ride.parts_at(0.0).rods, ride.parts_at(0.05).rods
    still = np.all(now.centre == later.centre, axis=1)
    assert 0.5 < np.mean(still) < 0.6
