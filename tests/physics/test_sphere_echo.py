"""Echo of a conducting sphere; errors of its paths over frequency, aperture and time."""

import numpy as np
import pytest
from scipy.special import spherical_jn, spherical_yn

from polychirp.channel.materials.library import known_materials
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, sphere, transfer_at
from polychirp.units import to_db
from tests.support.references.physical_optics import scattered

WAVELENGTH = SPEED_OF_LIGHT / 79e9
TRACER = Composite(dynamic_range=1e12)


def ball(radius, edge, *, velocity=(0.0, 0.0, 0.0), **pose):
    """A rotated sphere, so that no lines of its mesh run along the shadow's edge and add up."""
    pose = Pose(yaw=0.3, pitch=0.2, **pose)
    return Actor(
        name="ball", kind="object", mesh=mesh_of(sphere(radius, edge)), pose=pose, velocity=velocity
    )


def mie_rcs(radius):
    """σ = (λ²/4π)|Σ(−1)ⁿ(2n+1)(bₙ−aₙ)|² of a perfectly conducting sphere, m²."""
    x = 2 * np.pi * radius / WAVELENGTH
    n = np.arange(1, int(x + 10 * x ** (1 / 3) + 20))
    j, dj = spherical_jn(n, x), spherical_jn(n, x, derivative=True)
    h = j - 1j * spherical_yn(n, x)
    dh = dj - 1j * spherical_yn(n, x, derivative=True)
    a, b = j / h, (j + x * dj) / (h + x * dh)
    return WAVELENGTH**2 / (4 * np.pi) * np.abs(np.sum((-1.0) ** n * (2 * n + 1) * (b - a))) ** 2


MIE = {0.010: -34.977, 0.025: -27.073, 0.050: -21.052, 0.100: -15.029, 0.250: -7.070}
"""dBsm of spheres, radius m, by an independent evaluation of the series."""


def apparent_rcs(radius, edge, distance):
    """Cross section of a traced sphere by the radar equation, dBsm, for V."""
    paths = TRACER.trace(around([ball(radius, edge)], [(distance, 0, 0)]))
    power = abs(transfer_at(paths, 79e9)[0, 0]) ** 2
    return float(to_db(power * (4 * np.pi) ** 3 * distance**4 / WAVELENGTH**2))


@pytest.mark.parametrize("radius", MIE)
def test_the_reference_series_is_the_tabulated_one(radius):
    """This checks the reference that the tests below use, and no code of polychirp."""
    assert to_db(mie_rcs(radius)) == pytest.approx(MIE[radius], abs=1e-3)


@pytest.mark.parametrize(
    ("radius", "edge"),
    [
        (0.010, 1e-3),
        (0.025, 1e-3),
        (0.050, 2e-3),
        (0.100, 3e-3),
        pytest.param(0.250, 4e-3, marks=pytest.mark.slow),
    ],
)
def test_a_sphere_echoes_as_mie_says(compare, radius, edge):
    """Physical optics cuts the currents off at the shadow's edge and has no creeping wave.

    The cut is worth 1/2kr of the amplitude: 0.26 dB at 10 mm, 0.1 dB at 25 mm, less beyond.
    """
    compare(
        page="canonical-bodies",
        case=f"traced, sphere of radius {1e3 * radius:g} mm",
        quantity="RCS of a sphere, far field, dBsm",
        expected=MIE[radius],
        measured=apparent_rcs(radius, edge, 300.0),
        tolerance=0.3,
        source="Mie series",
    )


@pytest.mark.parametrize(("radius", "distance"), [(0.05, 0.5), (0.1, 2.0), (0.1, 10.0)])
def test_a_near_sphere_echoes_as_its_surface_does(compare, radius, distance):
    """Against the same sphere far away.

    A specular point at R₀ = R − r of a surface of radius r echoes as √σ / (R₀ (R₀ + r)) where
    the radar equation, from the centre, has √σ / R²: a factor of 1 + r/R₀ in amplitude.
    """
    near, far = (apparent_rcs(radius, 0.03 * radius, place) for place in (distance, 1000.0))
    compare(
        page="canonical-bodies",
        case=f"sphere of radius {1e3 * radius:g} mm, centre at {distance:g} m",
        quantity="near over far RCS, dB",
        expected=float(20 * np.log10(1 + radius / (distance - radius))),
        measured=near - far,
        tolerance=0.1,
        source="1 + r/R₀, R₀ to the surface",
    )


def test_the_mie_series_is_right_where_it_is_known():
    """A large sphere has πr²: −21.05 dBsm for 5 cm within its ripple of 0.1 dB."""
    assert to_db(mie_rcs(0.05)) == pytest.approx(to_db(np.pi * 0.05**2), abs=0.1)


def lit_half(corners, places):
    """Faces that face all places; a sphere hides no other part of itself."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    ways = np.asarray(places) - corners.mean(axis=1)[:, None]
    return corners[np.all(np.einsum("fx,fpx->fp", normal, ways) > 0, axis=1)]


def test_paths_keep_the_response_over_a_gigahertz():
    """Paths compared with the sum over all facets at every frequency: errors below −30 dB."""
    places = [(6.0, 0, 0.3), (5.0, 2.0, 0.5)]
    actor = ball(0.2, 0.012)
    paths = TRACER.trace(around([actor], places))
    echoes = paths.select(paths.num_bounces > 0)
    errors = []
    for t, x in ((0, 0), (0, 1)):
        corners = lit_half(actor.pose.to_outer(actor.mesh.corners), [places[t], places[x]])
        for frequency in (78.5e9, 78.8e9, 79.5e9):
            exact = scattered(
                corners,
                known_materials()["metal"],
                np.array(places[t]),
                np.array(places[x]),
                frequency,
            )[0, 0]
            found = transfer_at(echoes, frequency, t, x)[0, 0]
            errors.append(np.abs(found - exact) / np.abs(exact))
    assert 20 * np.log10(np.median(errors)) < -30


def test_paths_keep_the_phase_across_an_aperture():
    """The arrival direction predicts the echo at an element 3 mm aside: below −30 dB."""
    place, aside = np.array([6.0, 0.5, 0.3]), np.array([0.0, 3e-3, 0.0])
    actor = ball(0.25, 0.012)
    paths = TRACER.trace(around([actor], [place]))
    turn = np.exp(2j * np.pi / WAVELENGTH * paths.arrival @ aside)
    turn *= np.exp(-2j * np.pi * 79e9 * paths.delay)
    found = np.sum(paths.transfer[:, 0, 0] * turn)
    corners = lit_half(actor.pose.to_outer(actor.mesh.corners), [place])
    exact = scattered(corners, known_materials()["metal"], place, place + aside, 79e9)[0, 0]
    assert 20 * np.log10(abs(found / exact - 1)) < -30


def test_paths_foretell_the_next_tenth_of_a_millisecond():
    """After 1.5 mm at 15 m/s (0.4 λ), errors of extrapolated phases are below −30 dB."""
    scene = around([ball(0.25, 0.012, velocity=(-12.0, 9.0, 0.0), x=6.0)], [(0, 0, 0.3)])
    later = 1e-4
    now, then = TRACER.trace(scene), TRACER.trace(scene.at(later))
    turn = np.exp(-2j * np.pi * 79e9 * (now.delay + now.delay_rate * later))
    foretold = np.sum(now.transfer[:, 0, 0] * turn)
    exact = transfer_at(then, 79e9)[0, 0]
    assert 20 * np.log10(abs(foretold / exact - 1)) < -30


def test_a_body_that_comes_nearer_has_falling_delays(compare):
    """8 m/s straight ahead: 2v/λ, reduced by the oblique facets of the sphere's lit half."""
    scene = around([ball(0.1, 5e-3, velocity=(-8.0, 0, 0), x=10.0)], [(0, 0, 0)])
    paths = TRACER.trace(scene)
    strongest = np.argmax(np.abs(paths.transfer[:, 0, 0]))
    compare(
        page="paths",
        case="sphere of radius 0.1 m, 8 m/s, strongest path",
        quantity="Doppler shift at 79 GHz, Hz",
        expected=4216.25,
        measured=float(-79e9 * paths.delay_rate[strongest]),
        tolerance=4.0,
        source="2v/λ; a path is the mean over a zone whose edges recede a little slower",
    )
