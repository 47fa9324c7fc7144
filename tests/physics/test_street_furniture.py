"""Guard rail, sign, bollard and kerb: their echoes by other routes, and their meshes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import fresnel

from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.scoring.echoes import echoes_of
from polychirp.traffic.furniture import Bollard, GuardRail, Kerb, TrafficSign
from polychirp.traffic.street import Street

WAVELENGTH = SPEED_OF_LIGHT / 79e9
TRACER = Composite(max_bounces=1)


def seen(body: Actor, eye: tuple[float, float, float]) -> Scene:
    x, y, z = eye
    radar = Radar(name="r", mount=Pose(x=x, y=y, z=z), array=AntennaArray(pattern=ISOTROPIC))
    return Scene(
        time=0.0, actors=(body, Actor(name="o", kind="object")), radars=(radar,), carriers=(1,)
    )


def gain(body: Actor, eye: tuple[float, float, float]) -> float:
    """Power of the coherent echo of a body over the transmitted power, dB."""
    paths = TRACER.trace(seen(body, eye))
    turn = np.exp(-2j * np.pi * 79e9 * paths.delay)
    return float(20 * np.log10(max(abs(np.sum(paths.transfer[:, 0, 0] * turn)), 1e-20)))


@pytest.mark.parametrize("distance", [4.0, 8.0])
def test_a_bollard_echoes_as_a_long_cylinder(distance, compare):
    """Geometric optics, at the distance d from the surface.

    A sphere has the amplitude λ r / (8π d (d + r)). Along a cylinder the factor r / (d + r), which
    is due to both curvatures, keeps its root only. Of the cylinder's line, 0.6 m above and below
    the radar count: Fresnel's integral of the phase k z²/d over an endless line's.
    """
    radius, height = 0.06, 1.2
    near = distance - radius
    sine, cosine = fresnel(0.5 * height * np.sqrt(4.0 / (WAVELENGTH * near)))
    share = np.sqrt(2.0) * np.hypot(sine, cosine)
    line = WAVELENGTH / (8 * np.pi * near) * np.sqrt(radius / (near + radius))
    expected = 20 * np.log10(line * share)
    bollard = Bollard(name="b", x=0.0, y=0.0, height=height).actor()
    compare(
        page="road-users",
        quantity="gain from a radar to itself, dB",
        case=f"bollard at {distance:g} m",
        source="geometric optics of a cylinder, Fresnel's integral along it",
        expected=float(expected),
        measured=gain(bollard, (distance, 0.0, 0.6)),
        tolerance=0.8,
    )


def test_a_sign_straight_on_echoes_as_a_plate_of_its_size(compare):
    """The image of the radar in a finite mirror, another mechanism of the channel."""
    plate = Plate(
        centre=(0.035, 0.0, 2.3),
        half_u=(0.0, 0.3, 0.0),
        half_v=(0.0, 0.0, 0.3),
        material="metal",
        part="plate",
    )
    eye = (12.0, 0.0, 2.3)
    compare(
        page="road-users",
        quantity="gain from a radar to itself, dB",
        case="sign at 12 m, straight on",
        source="image in a finite mirror",
        expected=gain(Actor(name="m", kind="building", plates=(plate,)), eye),
        measured=gain(TrafficSign(name="s", x=0.0, y=0.0).actor(), eye),
        tolerance=0.5,
    )


def test_a_guard_rail_echoes_as_the_lines_of_its_waves(compare):
    """Each crest and trough is a cylinder of the least radius of curvature, h²/8π²d.

    Geometric optics of a cylinder, and the sum of the powers of all, as a mean over heights. Three
    are whole. The sheet ends at two more, so that each has half of the amplitude.
    """
    rail = GuardRail(name="g", x=0.0, y=0.0, length=4.0)
    radius = 0.31**2 / (8 * np.pi**2 * 0.083)
    one = 20 * np.log10(WAVELENGTH / (8 * np.pi * 5.0) * np.sqrt(radius / (5.0 + radius)))
    found = [gain(rail.actor(), (0.3, 5.0, height)) for height in np.linspace(0.45, 0.75, 31)]
    compare(
        page="road-users",
        quantity="gain from a radar to itself, dB",
        case="guard rail at 5 m, abeam, mean over heights",
        source="geometric optics of three cylinders and two halves",
        expected=one + 10 * np.log10(3.0 + 2.0 / 4.0),
        measured=10 * np.log10(np.mean(10 ** (np.array(found) / 10))),
        tolerance=1.0,
    )
    assert gain(rail.actor(), (4.3, 2.5, 0.6)) < one


def front_of_rail(eye: tuple[float, float, float], length: float) -> float:
    """Power of the echo of a rail's face over the transmitted power, dB.

    Physical optics, summed over the cosine itself, by pieces of 0.1 mm across and 2 mm along it.
    """
    share = (np.arange(3000) + 0.5) / 3000
    y, z = 0.0415 * (1 - np.cos(4 * np.pi * share)), 0.75 - 0.31 * (1 - share)
    slope = 0.0415 * 4 * np.pi * np.sin(4 * np.pi * share) / 0.31
    k, total = 2 * np.pi / WAVELENGTH, 0.0 + 0.0j
    for x in np.arange(-length / 2, length / 2, 2e-3) + 1e-3:
        way = np.stack([np.full_like(y, eye[0] - x), eye[1] - y, eye[2] - z])
        away = np.linalg.norm(way, axis=0)
        facing = np.maximum(way[1] - slope * way[2], 0.0) / away
        along = np.sinc(2 * k * way[0] / away * 1e-3 / np.pi)
        total += np.sum(facing * along * np.exp(-2j * k * away) / away**2)
    area = 2e-3 * 0.31 / 3000
    return float(20 * np.log10(abs(total) * area * k / (2 * np.pi) * WAVELENGTH / (4 * np.pi)))


@pytest.mark.parametrize("eye", [(0.3, 5.0, 0.45), (0.3, 5.0, 0.5), (0.2, 3.0, 0.5)])
def test_the_face_of_a_guard_rail_echoes_as_its_cosine(eye):
    rail = GuardRail(name="g", x=0.0, y=0.0, length=2.0).actor()
    mesh = rail.mesh
    kept = mesh.part == mesh.parts.index("beam")
    beam = replace(mesh, face=mesh.face[kept], material=mesh.material[kept], part=mesh.part[kept])
    assert gain(replace(rail, mesh=beam), eye) == pytest.approx(front_of_rail(eye, 2.0), abs=0.7)


def test_the_side_of_a_guard_rail_that_radars_see_has_the_finer_facets():
    mesh = GuardRail(name="g", x=0.0, y=0.0, length=4.0).actor().mesh
    corner = mesh.corners[mesh.part == mesh.parts.index("beam")]
    faces = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, 1] > 0
    assert np.sum(faces) > 3 * np.sum(~faces)


def test_the_beam_of_a_guard_rail_has_the_size_of_its_standard():
    rail = GuardRail(name="g", x=0.0, y=0.0, length=4.0)
    front = rail.actor().mesh
    corner = front.corners[front.part == front.parts.index("beam")]
    assert corner[..., 2].min() == pytest.approx(0.44, abs=1e-6)
    assert corner[..., 1].max() == pytest.approx(0.083, abs=1e-3)


def test_posts_stand_at_both_ends_and_between():
    mesh = GuardRail(name="g", x=0.0, y=0.0, length=6.0, post_spacing=2.0).actor().mesh
    posts = mesh.corners[mesh.part == mesh.parts.index("post")]
    assert len(set(np.round(posts[..., 0].mean(axis=1) / 2.0 - 0.5))) == 4


@pytest.mark.parametrize("body", [Bollard(name="b", x=0.0, y=0.0)])
def test_a_bollard_is_closed_and_faces_outwards(body):
    corner = body.actor().mesh.corners
    volume = np.sum(np.cross(corner[:, 0], corner[:, 1]) * corner[:, 2]) / 6
    assert volume == pytest.approx(math.pi * 0.06**2 * 0.9, rel=0.01)


def test_a_kerb_mirrors_only_what_comes_straight():
    """A radar abeam sees its image, weakened by |Γ| = 0.39 and some roughness; one ahead does not.

    The loss by roughness of concrete is at most 6 dB, and the finite face adds at most 3 dB.
    """
    kerb = Kerb(name="k", x=0.0, y=0.0, length=10.0, height=0.4).actor()
    abeam, ahead = (0.0, 3.0, 0.2), (20.0, 3.0, 0.2)
    mirror = 20 * np.log10(0.39 * WAVELENGTH / (8 * np.pi * 3.0))
    assert mirror - 6.0 < gain(kerb, abeam) < mirror + 3.0
    # of a radar 15 m beyond its end, the edges of the finite mirror return next to nothing
    assert gain(kerb, ahead) < mirror - 40.0


def test_furniture_is_clutter_and_no_target():
    post = Bollard(name="post", x=8.0, y=0.0).actor()
    scene = seen(post, (0.0, 0.0, 0.5))
    echoes = echoes_of(TRACER.trace(scene), scene, 0)
    assert echoes.is_clutter[0]


def test_a_street_has_furniture_of_every_kind():
    street = Street(
        furniture=(
            GuardRail(name="a", x=0.0, y=-5.0),
            TrafficSign(name="b", x=3.0, y=5.0),
            Bollard(name="c", x=6.0, y=5.0),
            Kerb(name="d", x=0.0, y=-4.0),
        )
    )
    assert [actor.name for actor in street.scene().actors] == ["a", "b", "c", "d"]
    assert {actor.kind for actor in street.scene().actors} == {"furniture"}


def test_posts_farther_apart_than_the_rail_is_long_are_refused():
    with pytest.raises(
        InputError, match="guard rail 'g' has posts every 3 m, but is only 2 m long"
    ):
        GuardRail(name="g", x=0.0, y=0.0, length=2.0, post_spacing=3.0)
