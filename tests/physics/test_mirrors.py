"""Reflection in planes: coefficients, an endless mirror, edges, and bodies seen in a mirror."""

import numpy as np
import pytest

from polychirp.channel.materials.fresnel import (
    half_space,
    media_of,
    reflection,
    roughness_factor,
    sheet,
    smooth_reflection,
)
from polychirp.channel.materials.library import NamedMaterial, known_materials
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around, box, mesh_of, sphere, transfer_at
from polychirp.units import to_db

WAVELENGTH = SPEED_OF_LIGHT / 79e9
SMOOTH = NamedMaterial(name="smooth", relative_permittivity=5.0)
TRACER = Composite(materials=(SMOOTH,))


def wall(half=30.0, *, material="metal", **pose):
    """A square in the plane x = 0 that faces +x."""
    return Actor(
        name="wall",
        kind="building",
        pose=Pose(**pose),
        plates=(
            Plate(
                centre=(0, 0, 0),
                half_u=(0, half, 0),
                half_v=(0, 0, half),
                material=material,
                part="wall",
            ),
        ),
    )


# |Γ| by hand from ITU-R P.2040: at 0°; s and p at 45°; s and p at 80°
TABLE = {
    "concrete": (0.3926, 0.5104, 0.2605, 0.8453, 0.3885),
    "glass": (0.4309, 0.5467, 0.2989, 0.8604, 0.3567),
    "wood": (0.1714, 0.2678, 0.0717, 0.7078, 0.4907),
    "brick": (0.3283, 0.4462, 0.1991, 0.8161, 0.4327),
}


ANGLES = ("0°", "45°, s", "45°, p", "80°, s", "80°, p")


@pytest.mark.parametrize("name", TABLE)
def test_half_spaces_reflect_as_fresnel_says(compare, name):
    permittivity = known_materials()[name].permittivity(79e9)
    s, p = half_space(permittivity, np.cos(np.radians([0.0, 45.0, 80.0])))
    found = np.abs([s[0], s[1], p[1], s[2], p[2]])
    for angle, expected, measured in zip(ANGLES, TABLE[name], found, strict=True):
        compare(
            page="materials",
            case=f"{name}, {angle}",
            quantity="|Γ| of a half-space",
            expected=expected,
            measured=float(measured),
            tolerance=1e-4,
            source="Fresnel, by hand from ITU-R P.2040",
        )


PANE = {
    "|R|, 0°": 0.5106,
    "|T|, 0°": 0.5419,
    "|R|, 45°, s": 0.3978,
    "|R|, 45°, p": 0.1996,
    "|R|, 70°, s": 0.6179,
    "|R|, 70°, p": 0.0260,
}


def test_a_pane_reflects_and_transmits_as_a_slab(compare):
    pane = known_materials()["glass"]
    rs, rp, ts, _ = sheet(
        pane.permittivity(79e9), pane.thickness, np.cos(np.radians([0.0, 45.0, 70.0])), 79e9
    )
    found = np.abs([rs[0], ts[0], rs[1], rp[1], rs[2], rp[2]])
    for (what, expected), measured in zip(PANE.items(), found, strict=True):
        compare(
            page="materials",
            case=what,
            quantity="4 mm of glass",
            expected=expected,
            measured=float(measured),
            tolerance=2e-4,
            source="slab of Fresnel's coefficients, by hand",
        )


def test_a_lossless_sheet_keeps_all_power():
    """|R|² + |T|² = 1."""
    rs, rp, ts, tp = sheet(4.0, 1.3e-3, np.linspace(0.05, 1, 20), 79e9)
    np.testing.assert_allclose(np.abs(rs) ** 2 + np.abs(ts) ** 2, 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.abs(rp) ** 2 + np.abs(tp) ** 2, 1.0, rtol=1e-12)


@pytest.mark.parametrize(("cosine", "loss"), [(1.0, -4.29), (0.1, -0.0429)])
def test_roughness_of_three_tenths_of_a_millimetre_costs_four_decibels(compare, cosine, loss):
    """2 (kσ)² in nepers: 8.686 · 2 · (1655.7 · 3e-4)² = 4.29 dB; a hundredth of it at 84.3°."""
    compare(
        page="clouds-and-roughness",
        case=f"0.3 mm rms, cosine of the angle {cosine:g}",
        quantity="coherent reflection of a rough over a smooth mirror, dB",
        expected=loss,
        measured=float(to_db(roughness_factor(3e-4, cosine, 79e9) ** 2)),
        tolerance=0.01 * cosine,
        source="exp(−4(kσ cosθ)²), by hand",
    )


def test_the_kernel_reflects_as_the_plain_formulas():
    names = tuple(known_materials())
    table = media_of(names, known_materials(), 79e9)
    for number, name in enumerate(names):
        for cosine in (1.0, 0.6, 0.1, 1e-3):
            plain = reflection(known_materials()[name], cosine, 79e9)
            rough = roughness_factor(known_materials()[name].roughness, cosine, 79e9)
            found = smooth_reflection(table, number, cosine, 2 * np.pi / WAVELENGTH)
            np.testing.assert_allclose(np.array(found) * rough, plain, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("distance", [8.0, 30.0])
def test_a_large_mirror_shows_the_radar_itself_at_twice_the_distance(compare, distance):
    """λ/4π(2R) = λ/8πR, with a conductor's change of sign."""
    paths = TRACER.trace(around([wall(200.0)], [(distance, 1.0, 2.0)]))
    assert paths.num_paths == 1
    expected = -WAVELENGTH / (8 * np.pi * distance) * np.eye(2)
    # edges 198 m away leave 1/(π·515) of ripple each at 30 m
    np.testing.assert_allclose(paths.transfer[0], expected, atol=3e-3 * abs(expected[0, 0]))
    compare(
        page="canonical-bodies",
        case=f"infinite mirror at {distance:g} m",
        quantity="gain from a radar to itself, dB",
        expected=20 * np.log10(WAVELENGTH / (8 * np.pi * distance)),
        measured=float(to_db(np.abs(paths.transfer[0, 0, 0]) ** 2)),
        tolerance=0.05,
        source="image: λ/8πR",
    )
    assert paths.delay[0] * SPEED_OF_LIGHT == pytest.approx(2 * distance)
    assert list(paths.bounce_kind) == [Bounce.REFLECTION]
    assert not paths.is_mirrored[0]


def test_a_mirror_at_an_angle_keeps_both_polarisations_apart():
    """Radars at one height beside a vertical wall: V is across the plane of incidence, H in it."""
    paths = TRACER.trace(around([wall(material="smooth")], [(5, -5, 0), (5, 5, 0)]))
    mirrored = paths.select((paths.num_bounces == 1) & (paths.transmitter != paths.receiver))
    s, p = half_space(5.0, np.cos(np.pi / 4))
    length = 10 * np.sqrt(2)
    spread = WAVELENGTH / (4 * np.pi * length)
    found = np.abs(mirrored.transfer[0]) / spread
    np.testing.assert_allclose(found, np.abs(np.diag([s, p])), atol=0.006)


def test_half_a_mirror_halves_the_field(compare):
    """F = ½ at a plate's edge."""
    half = 30.0
    paths = TRACER.trace(around([wall(half)], [(8.0, half, 0.0)]))
    expected = 0.5 * WAVELENGTH / (8 * np.pi * 8.0)
    compare(
        page="canonical-bodies",
        case="radar opposite the edge of a large mirror at 8 m",
        quantity="gain from a radar to itself, dB",
        expected=20 * np.log10(expected),
        measured=float(to_db(np.abs(paths.transfer[0, 0, 0]) ** 2)),
        tolerance=0.1,
        source="half of λ/8πR",
    )


@pytest.mark.parametrize("half", [0.05, 0.15, 0.5])
@pytest.mark.parametrize("angle", [0.0, 45.0])
def test_a_finite_mirror_has_the_integral_of_its_fresnel_zones(compare, half, angle):
    """Against the diffraction integral over the plate by quadrature; notes of it: 0.1 dB."""
    distance, k = 10.0, 2 * np.pi / WAVELENGTH
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    places = [(distance * c, -distance * s, 0.0), (distance * c, distance * s, 0.0)]
    ends = (0, 1) if angle else (0, 0)
    node, weight = np.polynomial.legendre.leggauss(600)
    y, z = np.meshgrid(half * node, half * node)
    w = np.outer(weight, weight) * half**2
    r1 = np.sqrt((distance * c) ** 2 + (y + distance * s) ** 2 + z**2)
    r2 = np.sqrt((distance * c) ** 2 + (y - distance * s) ** 2 + z**2)
    inner = np.sum(w * np.exp(-1j * k * (r1 + r2 - 2 * distance)) / (r1 * r2)) * c
    exact = np.abs(inner) / (4 * np.pi)  # F = 1 makes this λ/4π(r1+r2)
    paths = TRACER.trace(around([wall(half)], places[: ends[1] + 1]))
    found = paths.select(
        (paths.num_bounces == 1) & (paths.transmitter == ends[0]) & (paths.receiver == ends[1])
    )
    compare(
        page="canonical-bodies",
        case=f"half side {half:g} m at 10 m, {angle:g}° from the normal",
        quantity="gain of the image in a square mirror, dB",
        expected=20 * np.log10(exact),
        measured=float(to_db(np.abs(found.transfer[0, 0, 0]) ** 2)),
        tolerance=0.12,
        source="diffraction integral by quadrature",
    )


def test_a_wall_that_comes_nearer_moves_its_echo_by_twice_its_speed():
    """The image moves at twice the wall's speed: delay rate −2v/c."""
    moving = Actor(
        name="truck", kind="building", velocity=(5.0, 0, 0), plates=wall().plates, pose=Pose()
    )
    paths = TRACER.trace(around([moving], [(8.0, 0, 0)]))
    assert paths.delay_rate[0] * SPEED_OF_LIGHT == pytest.approx(-10.0, rel=1e-6)


def test_a_mirror_shows_a_body_a_second_and_a_third_time(compare):
    """A ball before a metal wall: direct, over the wall one way (twice), and both ways.

    The image of the radar is 2·6 m behind: legs by Pythagoras. By geometric optics, a sphere of
    radius r echoes with :math:`\\lambda / 4\\pi (s_1 + s_2 + 2 s_1 s_2 / r)` at distances s from
    its surface; the angle between both legs changes that by less than 0.01 dB here.
    """
    radius = 0.1
    ball = Actor(
        name="ball",
        kind="object",
        mesh=mesh_of(sphere(radius, 3e-3)),
        pose=Pose(x=4.0, y=7.0, yaw=0.3, pitch=0.2),
    )
    paths = Composite(dynamic_range=1e12).trace(around([ball, wall()], [(6.0, 0, 0)]))
    direct, image = np.hypot(2, 7), np.hypot(10, 7)
    over = paths.select(_meeting(paths, Bounce.SCATTERING))
    legs = {1: (direct, direct), 2: (direct, image), 3: (image, image)}
    for bounces, (there, back) in legs.items():
        mine = over.select(over.num_bounces == bounces)
        # the path there over the wall, and the one back, are two of a kind
        field = abs(transfer_at(mine, 79e9)[0, 0]) / (2 if bounces == 2 else 1)
        first, second = there - radius, back - radius
        spread = first + second + 2 * first * second / radius
        sphere_echo = WAVELENGTH / (4 * np.pi * spread)
        compare(
            page="multi-bounce",
            case=f"sphere of radius 0.1 m before a wall, {bounces - 1} mirrored legs",
            quantity="gain from a radar to itself, dB",
            expected=20 * np.log10(sphere_echo),
            measured=float(to_db(field**2)),
            tolerance=0.15,
            source="geometric optics with the image's distance",
        )
        assert np.all(mine.is_mirrored == (bounces > 1))


def _mirrored_and_direct(radius, receiver, screens):
    """Echo of a ball, by way of a metal wall, and from a radar at the place of its image."""
    ball = Actor(
        name="ball",
        kind="object",
        mesh=mesh_of(sphere(radius, 0.02)),
        pose=Pose(x=4.0, y=7.0, yaw=0.3, pitch=0.2),
    )
    tracer = Composite(dynamic_range=1e14, max_bounces=1, diffraction=False)
    found = []
    for actors, x in (([ball, wall(), *screens], 6.0), ([ball, *screens], -6.0)):
        paths = tracer.trace(around(actors, [(x, 0.0, 0.0), receiver]))
        over = paths.select(_meeting(paths, Bounce.SCATTERING))
        # one leg over the wall, the first, or none
        first = over.bounce_kind[over.bounce_start[:-1]] == Bounce.REFLECTION
        over = over.select((over.num_bounces == 1) if x < 0 else first & (over.num_bounces == 2))
        found.append(transfer_at(over, 79e9, 0, 1)[0, 0])
    return found


@pytest.mark.parametrize("screened", [False, True])
def test_a_mirror_shows_the_shadows_that_the_image_of_the_radar_casts(screened):
    """A metal wall turns V over, and else is a radar behind it: drawn balls and receivers.

    The edge of the ball's own shadow counts in echoes to another radar, and so does the edge of
    the shadow of a screen, which hides the lower half of the ball from the wall. The same facets
    are lit by the same spherical wave.
    """
    screen = Actor(
        name="screen", kind="building", mesh=mesh_of(box((0.02, 1.0, 1.0), 0.5)),
        pose=Pose(x=3.2, y=6.44, z=-0.5, yaw=0.6),
    )  # fmt: skip
    random = np.random.default_rng(3)
    for _ in range(10):
        receiver = (*random.uniform((7.0, 3.0), (14.0, 10.0)), random.uniform(-1.0, 1.0))
        mirrored, direct = _mirrored_and_direct(
            random.uniform(0.1, 0.4), receiver, [screen] if screened else []
        )
        assert abs(mirrored + direct) < 1e-4 * abs(direct)


def before_a_wall(velocity=(0.0, 0.0, 0.0)):
    """A ball, a wall at x = 0 that moves, and two radars that move."""
    ball = Actor(
        name="ball",
        kind="object",
        mesh=mesh_of(sphere(0.1, 5e-3)),
        pose=Pose(x=4.0, y=7.0, yaw=0.3, pitch=0.2),
        velocity=(-7.0, 11.0, 0.0),
    )
    mirror = Actor(name="wall", kind="building", velocity=velocity, plates=wall().plates)
    places, moves = [(6.0, 0, 0), (5.0, 3.0, 0.4)], [(3.0, 9.0, 0), (-5.0, -2.0, 0)]
    return around([ball, mirror], places, velocities=moves)


def test_mirrored_paths_leave_for_their_mirror_points():
    """Departure and arrival point from the radars to the first and the last bounce."""
    scene = before_a_wall()
    paths = Composite(dynamic_range=1e4).trace(scene)
    paths = paths.select(_meeting(paths, Bounce.SCATTERING))
    for ends, direction, bounce in (
        (paths.transmitter, paths.departure, paths.bounce_start[:-1]),
        (paths.receiver, paths.arrival, paths.bounce_start[1:] - 1),
    ):
        way = paths.bounce_point[bounce] - scene.radar_position[ends]
        way /= np.linalg.norm(way, axis=-1, keepdims=True)
        # the point of a gathered path is a mean, too, of a body of 0.1 m
        assert np.all(np.sum(way * direction, axis=-1) > np.cos(0.02))
    mirror = paths.bounce_point[paths.bounce_kind == Bounce.REFLECTION]
    np.testing.assert_allclose(mirror[:, 0], 0.0, atol=1e-12)


def test_mirrored_paths_foretell_the_next_tenth_of_a_millisecond():
    """Everything moves, the mirror too; foretold phases of the strongest pairs, below −30 dB."""
    scene, later = before_a_wall((2.0, 0.0, 0.0)), 1e-4
    tracer = Composite(dynamic_range=1e12)
    now, then = tracer.trace(scene), tracer.trace(scene.at(later))
    for t, x in ((0, 0), (0, 1), (1, 0)):
        for bounces in (2, 3):
            old, new = (
                p.select((p.transmitter == t) & (p.receiver == x) & (p.num_bounces == bounces))
                for p in (now, then)
            )
            turn = np.exp(-2j * np.pi * 79e9 * (old.delay + old.delay_rate * later))
            foretold = np.sum(old.transfer[:, 0, 0] * turn)
            exact = transfer_at(new, 79e9, t, x)[0, 0]
            assert 20 * np.log10(abs(foretold / exact - 1)) < -30


def _meeting(paths, kind):
    """Numbers of the paths that have a bounce of a kind."""
    owner = np.repeat(np.arange(paths.num_paths), paths.num_bounces)
    return np.unique(owner[paths.bounce_kind == kind])


def test_a_point_is_not_mirrored_but_hidden():
    """Points are isotropic and have no surface: walls only hide them."""
    target = Actor(name="p", kind="object", points=(PointScatterer(position=(-3, 0, 0), rcs=1.0),))
    paths = TRACER.trace(around([target, wall()], [(8.0, 0, 0)]))
    assert np.all(paths.bounce_kind == Bounce.REFLECTION)
