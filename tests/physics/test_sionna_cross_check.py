"""Line of sight, mirrors, sheets and Doppler of `Composite` beside those of Sionna RT.

Sionna shares no line with our own mechanisms: it finds a mirror by sending rays, and has its own
Fresnel coefficients, polarisation bases and Doppler. Its mirrors are endless, ours end in Fresnel
zones: with edges u ≥ 50 away (in units of √(λ/2·…)) they differ by at most 2/π·u < 1.3 %.
"""

import numpy as np
import pytest

from polychirp.channel.materials.fresnel import half_space, sheet
from polychirp.channel.materials.library import NamedMaterial, known_materials
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.sionna import SionnaRt, llvm_for_sionna
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError, ModelWarning
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, sphere, transfer_at
from polychirp.units import to_db

try:
    llvm_for_sionna()  # without importing: an LLVM that is too old would end pytest
except CapabilityError as missing:
    pytest.skip(str(missing), allow_module_level=True)

pytestmark = pytest.mark.slow  # Sionna compiles its kernels

FREQUENCY = 79e9
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY
KNOWN = known_materials()
SMOOTH = (
    *(
        NamedMaterial(
            name=f"smooth {name}",
            relative_permittivity=KNOWN[name].relative_permittivity,
            conductivity=KNOWN[name].conductivity,
        )
        for name in ("concrete", "asphalt")
    ),
    NamedMaterial(name="smooth and lossless", relative_permittivity=5.0),
)
OURS = Composite(materials=SMOOTH, dynamic_range=1e9)
THEIRS = SionnaRt(materials=SMOOTH, dynamic_range=1e9, max_depth=1, num_samples=100_000)
SOURCE = "Sionna RT 2"
# 2/π·u of the nearest edges of both axes, as in the docstring
EDGE_RATIO = 0.013


def surface(material, *, name="surface", velocity=(0.0, 0.0, 0.0), half=60.0, **pose):
    """A large square in the plane x = 0 of its pose, which faces +x, off centre."""
    plate = Plate(
        centre=(0, 3.0, 2.0), half_u=(0, half, 0), half_v=(0, 0, half), material=material, part="p"
    )
    return Actor(name=name, kind="building", pose=Pose(**pose), velocity=velocity, plates=(plate,))


def road(material):
    """Pitched up by 90°, its outside is up."""
    return surface(material, name="road", pitch=np.pi / 2)


def chosen(paths, transmitter, receiver, bounces):
    mine = (paths.transmitter == transmitter) & (paths.receiver == receiver)
    found = paths.select(mine & (paths.num_bounces == bounces))
    assert found.num_paths == 1
    return found


def both(scene, transmitter=0, receiver=1, bounces=1):
    """The same path as ours and as theirs."""
    return tuple(
        chosen(tracer.trace(scene), transmitter, receiver, bounces) for tracer in (OURS, THEIRS)
    )


def spread(paths):
    """λ/4πd."""
    return WAVELENGTH / (4 * np.pi * paths.delay[0] * SPEED_OF_LIGHT)


@pytest.mark.parametrize("distance", [1.0, 10.0, 100.0])
def test_lines_of_sight_have_friis_amplitude(compare, distance):
    """Without slope, both polarisations: V keeps its sign, H turns it."""
    ours, theirs = both(around([], [(2.0, 1.0, 0.5), (2.0, 1.0 + distance, 0.5)]), bounces=0)
    np.testing.assert_allclose(ours.transfer, theirs.transfer, atol=1e-6 * spread(ours))
    compare(
        page="engines",
        case=f"line of sight, {distance:g} m",
        quantity="path gain, dB",
        expected=float(to_db(np.abs(theirs.transfer[0, 0, 0]) ** 2)),
        measured=float(to_db(np.abs(ours.transfer[0, 0, 0]) ** 2)),
        tolerance=1e-4,  # of single precision
        source=SOURCE,
    )


@pytest.mark.parametrize("material", ["smooth concrete", "smooth asphalt", "metal", "glass"])
@pytest.mark.parametrize("angle", [10.0, 45.0, 60.0, 75.0, 85.0])
def test_roads_reflect_both_polarisations_as_in_sionna(compare, material, angle):
    """Amplitude and sign of V (in the plane of incidence) and H (across), 12 m of journey."""
    height, reach = 6 * np.cos(np.radians(angle)), 6 * np.sin(np.radians(angle))
    scene = around([road(material)], [(-reach, 0.3, height), (reach, 0.3, height)])
    ours, theirs = both(scene)
    np.testing.assert_allclose(ours.transfer, theirs.transfer, atol=EDGE_RATIO * spread(ours))
    for number, name in enumerate("VH"):
        mine, other = (
            paths.transfer[0, number, number] / spread(paths) for paths in (ours, theirs)
        )
        compare(
            page="engines",
            case=f"road, {material}, {angle:g}° from the normal, {name}",
            quantity="|Γ|",
            expected=float(abs(other)),
            measured=float(abs(mine)),
            tolerance=EDGE_RATIO * max(abs(other), 0.1),
            source=SOURCE,
        )


@pytest.mark.parametrize("material", ["smooth concrete", "smooth and lossless", "glass", "brick"])
def test_sionna_gives_fresnel_coefficients_through_our_adapter(material):
    """Exactly, as its mirrors have no edges: Γp into V with its sign, −Γs into H.

    A point of reflection that is 0.5 mm off turns the angle by 1e-4.
    """
    table = {row.name: row for row in SMOOTH} | dict(KNOWN)
    row, angle = table[material], np.radians(60.0)
    height, reach = 6 * np.cos(angle), 6 * np.sin(angle)
    scene = around([road(material)], [(-reach, 0.3, height), (reach, 0.3, height)])
    theirs = chosen(THEIRS.trace(scene), 0, 1, 1)
    permittivity, cosine = row.permittivity(FREQUENCY), np.cos(angle)
    if row.thickness:
        s, p = sheet(permittivity, row.thickness, cosine, FREQUENCY)[:2]
    else:
        s, p = half_space(permittivity, cosine)
    rough = np.exp(-2 * (2 * np.pi / WAVELENGTH * row.roughness * cosine) ** 2)
    expected = np.diag([p, -s]) * rough
    np.testing.assert_allclose(theirs.transfer[0] / spread(theirs), expected, atol=1e-3)


def test_walls_echo_a_radar_as_in_sionna(compare):
    """λ/8πR and the sign of a conductor."""
    ours, theirs = both(around([surface("metal", x=-3.0)], [(5.0, 1.0, 2.0)]), 0, 0)
    np.testing.assert_allclose(ours.transfer, theirs.transfer, atol=EDGE_RATIO * spread(ours))
    compare(
        page="engines",
        case="own echo of a metal wall at 8 m",
        quantity="path gain, dB",
        expected=float(to_db(np.abs(theirs.transfer[0, 0, 0]) ** 2)),
        measured=float(to_db(np.abs(ours.transfer[0, 0, 0]) ** 2)),
        tolerance=float(to_db((1 + EDGE_RATIO) ** 2)),
        source=SOURCE,
    )


def test_a_tilted_pane_turns_polarisation_as_in_sionna():
    """All four entries, receiving and transmitting polarisation told apart."""
    pane = surface("glass", roll=0.5, yaw=0.3, pitch=0.4)
    ours, theirs = both(around([pane], [(4.0, -5.0, 1.0), (7.0, 3.0, -2.0)]))
    cross = np.abs(theirs.transfer[0, 0, 1] - theirs.transfer[0, 1, 0])
    assert cross > 0.02 * spread(theirs)  # a transposed matrix would not pass
    np.testing.assert_allclose(ours.transfer, theirs.transfer, atol=EDGE_RATIO * spread(ours))


DOPPLER = {
    "radar at 8 m/s to a wall": ((0.0, 0.0, 0.0), [(-8.0, 0.0, 0.0)], 0),
    "wall at 8 m/s to a radar": ((8.0, 0.0, 0.0), [(0.0, 0.0, 0.0)], 0),
    "wall and two radars": (
        tuple(np.array([3.0, 1.0, 0.0])),
        [(-8.0, 5.0, 0.0), (2.0, -20.0, 1.0)],
        1,
    ),
}


@pytest.mark.parametrize("case", DOPPLER)
def test_mirrors_shift_frequencies_as_in_sionna(compare, case):
    wall, speeds, receiver = DOPPLER[case]
    places = [(8.0, 0.0, 0.0), (5.0, 7.0, 1.0)][: receiver + 1]
    scene = around([surface("metal", velocity=wall)], places, velocities=speeds)
    ours, theirs = both(scene, 0, receiver)
    shift = [-FREQUENCY * float(paths.delay_rate[0]) for paths in (ours, theirs)]
    if not receiver:
        # 2 v f/c; of second order are 1e-4 Hz, and single precision is 3e-4 Hz
        assert shift == pytest.approx([4216.250, 4216.250], abs=2e-3)
    compare(
        page="engines",
        case=case,
        quantity="Doppler shift, Hz",
        expected=shift[1],
        measured=shift[0],
        tolerance=0.02,  # a point of reflection that is 0.5 mm off
        source=SOURCE,
    )


def test_delays_and_directions_are_those_of_sionna(compare):
    """All at rest. Corners at 85 m are rounded to 4 µm; points of reflection by 0.5 mm at 5 m."""
    places = [(4.0, -5.0, 1.0), (7.0, 3.0, -2.0)]
    scene = around([surface("glass", roll=0.5, yaw=0.3, pitch=0.4)], places)
    for transmitter, receiver, bounces in ((0, 1, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1), (1, 1, 1)):
        ours, theirs = both(scene, transmitter, receiver, bounces)
        name = f"{transmitter} to {receiver}, {('direct', 'mirrored')[bounces]}"
        compare(
            page="engines",
            case=name,
            quantity="length, m",
            expected=float(theirs.delay[0]) * SPEED_OF_LIGHT,
            measured=float(ours.delay[0]) * SPEED_OF_LIGHT,
            tolerance=1e-5,
            source=SOURCE,
        )
        for end in ("departure", "arrival"):
            mine, other = (getattr(paths, end)[0] for paths in (ours, theirs))
            compare(
                page="engines",
                case=f"{name}: {end}",
                quantity="angle between, rad",
                expected=0.0,
                measured=float(np.linalg.norm(mine - other)),
                tolerance=2e-4,
                source=SOURCE,
            )
        assert list(theirs.bounce_actor) == list(ours.bounce_actor)
        assert list(theirs.bounce_kind) == list(ours.bounce_kind)
        np.testing.assert_allclose(theirs.bounce_point, ours.bounce_point, atol=1e-3)


def test_where_a_plate_is_halved_by_the_reflection_point_there_is_still_one_path():
    """On the diagonal of its two triangles."""
    plate = Plate(
        centre=(0, 0, 0), half_u=(20, 0, 0), half_v=(0, 20, 0), material="metal", part="p"
    )
    scene = around(
        [Actor(name="p", kind="road", plates=(plate,))], [(-5.0, -5, 1.0), (5.0, 5, 1.0)]
    )
    assert THEIRS.trace(scene).num_paths == 6  # two direct, two over the plate, two echoes


@pytest.mark.parametrize("angle", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("material", ["glass", "plastic"])
def test_a_pane_lets_through_what_a_slab_does(material, angle):
    """In place of the air that it displaces: T e^{+jkt cosθ}; and as ours does."""
    ends = [(-4.0, 0.0, 0.0), (4.0, 0.0, 0.0)]
    scene = around([surface(material, yaw=angle)], ends)
    theirs = chosen(THEIRS.trace(scene), 0, 1, 1)
    row, cosine = KNOWN[material], np.cos(angle)
    found = sheet(row.permittivity(FREQUENCY), row.thickness, cosine, FREQUENCY)
    air = np.exp(2j * np.pi / WAVELENGTH * row.thickness * cosine)
    expected = np.diag([found.transmission_s, -found.transmission_p]) * air
    np.testing.assert_allclose(theirs.transfer[0] / spread(theirs), expected, atol=1e-3)
    assert list(theirs.bounce_kind) == [Bounce.TRANSMISSION]
    ours = chosen(OURS.trace(scene), 0, 1, 0)
    np.testing.assert_allclose(theirs.transfer, ours.transfer, atol=1e-3 * spread(ours))


def test_every_face_of_a_bent_pane_has_its_own_angle():
    """Faces of one sheet, bent round the transmitter's side of the z axis."""
    turn = np.radians([-70.0, -40.0, -10.0, 20.0, 50.0, 80.0])
    foot = np.column_stack([3.0 * np.cos(turn), 3.0 * np.sin(turn), np.full(6, -4.0)])
    top = foot + np.array([0.0, 0.0, 8.0])
    faces = [(foot[:-1], foot[1:], top[1:]), (foot[:-1], top[1:], top[:-1])]
    corners = np.concatenate([np.stack(corner, axis=1) for corner in faces])
    pane = Actor(name="pane", kind="object", mesh=mesh_of(corners, "glass"))
    for place in ((0.0, -1.5, 0.2), (1.0, 1.2, -1.0)):
        scene = around([pane], [place, (9.0, 0.7, 0.3)])
        with pytest.warns(ModelWarning):  # of bodies' echoes and of large facets
            theirs, ours = THEIRS.trace(scene), chosen(OURS.trace(scene), 0, 1, 0)
        is_through = (theirs.transmitter == 0) & (theirs.receiver == 1) & theirs.is_direct
        theirs = theirs.select(is_through)
        np.testing.assert_allclose(theirs.transfer, ours.transfer, atol=1e-3 * spread(ours))


@pytest.mark.parametrize("nu", [0.3, 1.0, 2.0, 4.0])
def test_a_knife_edge_diffracts_as_it_should(nu):
    """Exact for H, which is along the edge: (1+j)/2·[(½−C) − j(½−S)], phase and all."""
    from scipy.special import fresnel

    over = nu / np.sqrt(2 / WAVELENGTH * (1 / 5 + 1 / 5))
    edge = surface("metal", half=20.0, z=over - 22.0)
    scene = around([edge], [(-5.0, 0.013, 0.0), (5.0, 0.013, 0.0)])
    paths = SionnaRt(max_depth=1, diffraction=True).trace(scene)
    s, c = fresnel(nu)
    exact = -(1 + 1j) / 2 * ((0.5 - c) - 1j * (0.5 - s)) * WAVELENGTH / (4 * np.pi * 10.0)
    exact *= np.exp(-2j * np.pi * 10.0 / WAVELENGTH)
    assert transfer_at(paths, FREQUENCY, 0, 1)[1, 1] == pytest.approx(exact, rel=0.02)
    assert Bounce.DIFFRACTION in paths.bounce_kind


def test_two_walls_mirror_each_other():
    """Wall at 0 and at 10 m, radar at 4 m: 20 m of journey over both, either way round.

    Two conductors turn the field over twice, and it arrives from behind as a line of sight.
    """
    far = surface("metal", name="far", x=10.0, yaw=np.pi)
    paths = SionnaRt(max_depth=2, num_samples=100_000).trace(
        around([surface("metal"), far], [(4.0, 0.0, 0.0)])
    )
    twice = paths.select(paths.num_bounces == 2)
    np.testing.assert_allclose(twice.delay * SPEED_OF_LIGHT, [20.0, 20.0], atol=1e-5)
    np.testing.assert_allclose(
        twice.transfer,
        np.broadcast_to(spread(twice) * np.diag([1, -1]), (2, 2, 2)),
        atol=1e-4 * spread(twice),
    )
    assert sorted(twice.bounce_actor.tolist()) == [1, 1, 2, 2]


def test_a_body_blocks_and_is_warned_of():
    ball = Actor(name="ball", kind="object", mesh=mesh_of(sphere(0.5, 0.1)))
    with pytest.warns(ModelWarning, match="wrong by 5 to 30 dB"):
        paths = THEIRS.trace(around([ball], [(-4.0, 0.0, 0.0), (4.0, 0.0, 0.0)]))
    assert np.all(paths.num_bounces > 0)


def test_the_same_seed_gives_the_same_paths_and_another_one_others():
    """Fifty rays, which are too few: what they meet behind panes is a matter of chance."""
    panes = [
        surface("glass", name=f"pane {x}", half=4.0, x=float(x), y=-3.0, z=-2.0) for x in (0, 3, 7)
    ]
    scene = around(panes, [(-3.0, 0.1, 0.2), (9.0, -0.2, 0.3)])
    found = {seed: SionnaRt(num_samples=50, seed=seed).trace(scene) for seed in range(4)}
    assert len({paths.num_paths for paths in found.values()}) > 1
    for seed, first in found.items():
        second = SionnaRt(num_samples=50, seed=seed).trace(scene)
        assert np.array_equal(first.transfer, second.transfer)
        assert np.array_equal(first.delay, second.delay)
