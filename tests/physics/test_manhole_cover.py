"""A manhole cover in its frame: its echo from above and at grazing incidence by other routes."""

import numpy as np
import pytest

from polychirp.channel.materials.fresnel import reflection
from polychirp.channel.materials.library import known_materials
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.testing.shapes import around, transfer_at
from polychirp.traffic.furniture import ManholeCover
from polychirp.traffic.street import Road, Street
from polychirp.units import to_db

WAVENUMBER = 2 * np.pi * 79e9 / SPEED_OF_LIGHT
TRACER = Composite(dynamic_range=1e30, max_length=np.inf, max_bounces=1, diffuse=False)
COVER = ManholeCover(name="m", x=0.0, y=0.0)
TALL = ManholeCover(name="m", x=0.0, y=0.0, height=0.02)
INNER, OUTER = 0.324, 0.374  # radii of the frame, m


def apparent(cover, eye, road=None):
    """Cross section by the radar equation, dBsm, for V and for H."""
    bodies = [cover.actor()] if road is None else [cover.actor(), road.actor()]
    paths, distance = TRACER.trace(around(bodies, [eye])), np.linalg.norm(eye)
    # the radar's own image below the road is nearer than the cover
    paths = paths.select(paths.delay * SPEED_OF_LIGHT / 2 > distance - 1.0)
    power = np.abs(np.diag(transfer_at(paths, 79e9))) ** 2
    return to_db(power * (4 * np.pi) ** 3 * distance**4 * (WAVENUMBER / 2 / np.pi) ** 2)


def from_above(height):
    """Cross section of disc and ring straight below, m², by the integral of Kirchhoff.

    On the axis, a = (jk/4π·…) ∫ 2πρ e^(−2jkr) / r² dρ with r² = H² + ρ² and ρ dρ = r dr. The slow
    1/r is constant over a Fresnel zone, so that each rim at r has the term e^(−2jkr) / r.
    """
    rims = np.hypot(height, np.array([0.0, 0.32, INNER, OUTER]))
    terms = np.exp(-2j * WAVENUMBER * (rims - height)) / rims
    integral = 2 * np.pi * np.sum(terms * [1, -1, 1, -1]) / (2j * WAVENUMBER)
    # far away the integral is A/H², and σ is 4πA²/λ²
    return 4 * np.pi * (WAVENUMBER / 2 / np.pi) ** 2 * height**4 * np.abs(integral) ** 2


def of_the_wall(height, eye, material=None):
    """Cross section of the frame's outer wall, m², by 2000 strips, as seen from ``eye``.

    A strip at z has the field of the radar and of its image, weakened by Γ, on the way there and
    back. Around the wall, the path grows with y²/2 (1/d + 1/r): by stationary phase, the amplitude
    is that of far away, √(kr) a metre, times √(d / (d + r)). The radar equation for the middle at
    d + r thus reads (1 + r/d)³ times the cross section of far away.
    """
    across = np.hypot(*eye[:2]) - OUTER
    grazing, distance = np.arctan2(eye[2], across), np.hypot(across, eye[2])
    z = (np.arange(2000) + 0.5) * height / 2000
    turn = np.exp(1j * WAVENUMBER * z * np.sin(grazing))
    bounce = 0.0
    if material is not None:
        bounce = reflection(known_materials()[material], np.sin(grazing), 79e9)[1]
    wall = np.sum((turn + bounce / turn) ** 2) * height / 2000
    return WAVENUMBER * OUTER * np.abs(wall) ** 2 * (1 + OUTER / distance) ** 3


def test_far_above_a_cover_has_the_cross_section_of_its_area(compare):
    """A = π (0.32² + 0.374² − 0.324²) m², and σ = 4πA²/λ²."""
    area = np.pi * (0.32**2 + OUTER**2 - INNER**2)
    expected = to_db(4 * np.pi * (area * WAVENUMBER / 2 / np.pi) ** 2)
    assert to_db(from_above(1e5)) == pytest.approx(expected, abs=0.01)
    compare(
        page="road-users",
        quantity="RCS of a manhole cover from above, dBsm",
        case="far field, 100 km",
        source="4πA²/λ²",
        expected=float(expected),
        measured=float(apparent(COVER, (0.0, 0.0, 1e5))[0]),
        tolerance=0.1,
    )


def test_near_above_a_cover_the_fresnel_zones_of_its_rims_add_up(compare):
    """Mean power over 21 heights, as zones pass by; each one to 3 % of the greatest amplitude."""
    heights = np.linspace(4.0, 6.0, 21)
    expected = np.array([from_above(h) for h in heights])
    found = np.array([10 ** (apparent(COVER, (0.0, 0.0, h + 0.006))[0] / 10) for h in heights])
    np.testing.assert_allclose(
        np.sqrt(found), np.sqrt(expected), atol=0.03 * np.sqrt(expected.max())
    )
    compare(
        page="road-users",
        quantity="RCS of a manhole cover from above, dBsm",
        case="4 to 6 m, mean",
        source="Kirchhoff's integral on the axis",
        expected=float(to_db(expected.mean())),
        measured=float(to_db(found.mean())),
        tolerance=0.2,
    )


@pytest.mark.parametrize("height", [0.006, 0.02, 0.05])
def test_without_a_road_the_frame_echoes_as_an_upright_cylinder(compare, height):
    """From 100 m at its own height, where only the outer wall faces the radar.

    The factor of the distance d of the wall, as of `of_the_wall`, is 0.05 dB here.
    """
    cover = ManholeCover(name="m", x=0.0, y=0.0, height=height)
    compare(
        page="road-users",
        quantity="RCS of a manhole cover at grazing incidence, dBsm",
        case=f"{1e3 * height:g} mm high, no road",
        source="krh² (1 + r/d)³",
        expected=float(to_db(WAVENUMBER * OUTER * height**2 * (1 + OUTER / 99.626) ** 3)),
        measured=float(apparent(cover, (100.0, 0.0, height / 2))[0]),
        tolerance=0.3,
    )


@pytest.mark.parametrize("material", ["metal", "asphalt"])
@pytest.mark.parametrize("eye", [(10.0, 0.0, 0.5), (8.0, 6.0, 1.5), (20.0, 0.0, 0.6)])
def test_on_a_road_the_wall_and_its_images_add_up(compare, material, eye):
    """V waves: straight, by way of the road on one leg or the other, and on both."""
    road = Road(length=80.0, width=30.0, material=material)
    grazing = np.degrees(np.arctan2(eye[2], np.hypot(*eye[:2])))
    compare(
        page="road-users",
        quantity="RCS of a manhole cover at grazing incidence, dBsm",
        case=f"20 mm high on {material}, {grazing:.1f}°",
        source="integral over the wall, by strips, with its image",
        expected=float(to_db(of_the_wall(0.02, eye, material))),
        measured=float(apparent(TALL, eye, road)[0]),
        tolerance=0.5,
    )


def test_the_echo_is_the_same_all_around():
    """Over azimuth; the corners of the polygons change it by less than 0.3 dB."""
    turns = np.radians(np.linspace(0.0, 50.0, 9))
    found = [apparent(TALL, (30 * np.cos(a), 30 * np.sin(a), 0.01))[0] for a in turns]
    assert np.ptp(found) < 0.3


def test_faces_look_up_and_outwards():
    """The area of the tops is that of disc and ring; the wall's flux of (x, y) is 2π r² h."""
    corner = COVER.actor().mesh.corners
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2
    tops = np.pi * (0.32**2 + OUTER**2 - INNER**2)
    assert np.sum(area[:, 2]) == pytest.approx(tops, rel=2e-3)
    outwards = np.sum(corner.mean(axis=1)[:, :2] * area[:, :2])
    assert outwards == pytest.approx(2 * np.pi * OUTER**2 * 0.006, rel=2e-3)


def test_a_street_has_manhole_covers():
    (body,) = Street(furniture=(COVER,)).scene().actors
    assert (body.name, body.kind) == ("m", "furniture")
