"""Cross sections over aspect: bodies with a known answer, plane waves, and cars."""

import numpy as np
import pytest

from polychirp.channel.rcs import cross_sections, far_distance, running_median
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.mesh import EMPTY_MESH, Mesh
from polychirp.testing.shapes import box, mesh_of, plate, sphere
from polychirp.traffic.fittings import Fittings
from polychirp.traffic.shapes import SHAPES
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import to_db

WAVELENGTH = SPEED_OF_LIGHT / 79e9
WAVENUMBER = 2 * np.pi / WAVELENGTH
TRACER = Composite(max_bounces=1, diffuse=False)
"""Tracer with physical optics alone, to which the expected values apply."""


def test_a_sphere_looks_alike_from_everywhere(compare):
    """Mie's −15.03 dBsm of r = 0.1 m, times (1 + r/R₀)² near by.

    What is left is the stepped edge of the shadow, a mesh's doing: 0.06 dB at 2.5 mm, 0.6 at 4.
    """
    azimuth = np.radians(np.arange(0.5, 360.0, 36.0))
    found = cross_sections(mesh_of(sphere(0.1, 2.5e-3)), azimuth, tracer=TRACER, distance=10.0)
    level = to_db(found.rcs[:, 0, 0])
    compare(
        page="canonical-bodies",
        case="sphere r = 0.1 m at 10 m, median over 10 aspects",
        quantity="RCS, dBsm",
        expected=-15.029 + 20 * np.log10(1 + 0.1 / 9.9),
        measured=float(np.median(level)),
        tolerance=0.3,
        source="Mie series, and the near field of a specular point",
    )
    compare(
        page="canonical-bodies",
        case="sphere r = 0.1 m at 10 m, 10 aspects",
        quantity="greatest less least RCS, dB",
        expected=0.0,
        measured=float(np.ptp(level)),
        tolerance=0.2,
        source="symmetry",
    )


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.0, 5.0, 10.0])
def test_plane_waves_see_the_lobes_of_a_plate(compare, angle):
    """σ = 4πA²/λ² · cos²θ sinc²(2 s sin θ/λ), from afar, where 2kR is 10⁷ rad and more."""
    side, turn = 0.1, np.radians(angle)
    mesh = mesh_of(plate(side, 0.03))
    distance = far_distance(mesh, 79e9)
    found = cross_sections(mesh, np.array([turn]), tracer=TRACER, distance=distance)
    lobe = np.cos(turn) * np.sinc(2 * side / WAVELENGTH * np.sin(turn))
    compare(
        page="canonical-bodies",
        case=f"plate 0.1 m, plane wave, {angle:g}° off the normal",
        quantity="RCS, dBsm",
        expected=float(to_db(4 * np.pi * side**4 / WAVELENGTH**2 * lobe**2)),
        measured=float(to_db(found.rcs[0, 0, 0])),
        tolerance=0.1,
        source="physical optics, 4πA²/λ² · cos²θ sinc²",
    )


def box_from_afar(size, azimuth, elevation):
    """(4π/λ²)|∬ cosθ e^{2jk r̂·x} dA|² of a metal box, m²: three rectangles, no distance.

    On a face across axis i the integral is r̂ᵢ e^{jkrᵢLᵢ} ∏ Lₘ sinc(kr̂ₘLₘ) over the other two.
    """
    toward = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    phase = WAVENUMBER * np.abs(toward) * size
    across = size * np.sinc(phase / np.pi)
    total = 0.0
    for axis in range(3):
        others = np.delete(across, axis)
        total = total + np.abs(toward[axis]) * np.exp(1j * phase[axis]) * np.prod(others)
    return 4 * np.pi / WAVELENGTH**2 * np.abs(total) ** 2


def test_double_precision_is_enough_for_plane_waves():
    """A box of a car's size seen from hundreds of kilometres, beside a formula without distance.

    2kR is 10⁹ rad; the wave front still bends by up to 0.01 rad, which is the tolerance of the
    amplitude, as a share of the greatest.
    """
    size = np.array([1.6, 1.2, 0.6])
    azimuth, elevation = np.radians([0.05, 3.0, 20.0, 45.0, 88.0]), 0.02
    mesh = mesh_of(box(size, 0.1))
    distance = far_distance(mesh, 79e9)
    assert 2 * WAVENUMBER * distance > 5e8
    found = cross_sections(mesh, azimuth, tracer=TRACER, distance=distance, elevation=elevation)
    expected = np.sqrt([box_from_afar(size, angle, elevation) for angle in azimuth])
    for polarisation in range(2):
        amplitude = np.sqrt(found.rcs[:, polarisation, polarisation])
        np.testing.assert_allclose(amplitude, expected, atol=0.01 * np.max(expected))


def test_aspect_and_range_count_from_the_middle_of_the_mesh():
    """A plate 3 m off its mesh's origin has the same cross section as one at the origin."""
    corners, azimuth = plate(0.1, 0.03), np.radians([0.0, 2.0])
    here, there = (
        cross_sections(
            mesh_of(corners + np.array([shift, 0, 0])), azimuth, tracer=TRACER, distance=5.0
        )
        for shift in (0.0, 3.0)
    )
    np.testing.assert_allclose(there.rcs, here.rcs, rtol=1e-6, atol=1e-12)
    assert there.centre == (3.0, 0.0, 0.0)


def test_a_left_hand_echo_has_a_positive_azimuth():
    """Only the face to the left of a box without its other faces echoes, and only at +90°."""
    corners = box((0.1, 0.1, 0.1), 0.05)
    left = corners[np.all(corners[..., 1] > 0.049, axis=1)]
    found = cross_sections(mesh_of(left), np.radians([90.0, -90.0]), tracer=TRACER, distance=10.0)
    assert to_db(found.rcs[0, 0, 0]) > 15
    assert found.rcs[1, 0, 0] == 0


def test_progress_ends_with_all_aspects():
    seen = []
    cross_sections(
        mesh_of(plate(0.1, 0.05)),
        np.linspace(-0.2, 0.2, 40),
        tracer=TRACER,
        distance=10.0,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen == [(0, 40), (16, 40), (32, 40), (40, 40)]


def test_a_radar_inside_the_body_is_refused():
    with pytest.raises(InputError, match="inside the sphere around the body"):
        cross_sections(mesh_of(sphere(1.0, 0.2)), np.zeros(1), tracer=TRACER, distance=0.9)


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(InputError, match="without faces has no echo"):
        cross_sections(EMPTY_MESH, np.zeros(1), tracer=TRACER, distance=10.0)


def test_a_running_median_goes_around_the_circle():
    """A spike at the rear is seen from both sides of ±180°, and nowhere else."""
    azimuth = np.radians(np.arange(-180.0, 180.0))
    values = np.where(np.degrees(azimuth) % 360 == 180.0, 9.0, 1.0)
    assert np.all(running_median(values, azimuth, np.radians(1.5)) == 1.0)
    values = np.where(np.abs(np.abs(np.degrees(azimuth)) - 180.0) < 2.5, 9.0, 1.0)
    smooth = running_median(values, azimuth, np.radians(1.5))
    assert np.flatnonzero(smooth == 9.0).tolist() == [0, 1, 2, 358, 359]


MEDIAN_ERROR = 1.0
"""dB, that the default mesh of 100 000 facets keeps at 10 m."""


@pytest.mark.slow
def test_a_cars_echo_has_converged_with_its_mesh(compare):
    """The default mesh beside one of five times as many facets; single lobes move with the mesh."""
    azimuth = np.random.default_rng(1).uniform(-np.pi, np.pi, 48)
    coarse, fine = (
        to_db(
            cross_sections(
                vehicle_mesh("sedan", max_edge=edge, coarseness=coarseness),
                azimuth,
                tracer=TRACER,
                distance=10.0,
                elevation=-0.022,
            ).rcs[:, 0, 0]
        )
        for edge, coarseness in ((0.05, 1.0), (0.015, 0.5))
    )
    compare(
        page="vehicles",
        case="sedan at 10 m, V, 48 random aspects, default mesh",
        quantity="median |error|, dB",
        expected=0.0,
        measured=float(np.median(np.abs(coarse - fine))),
        tolerance=MEDIAN_ERROR,
        source="the same body with five times as many facets",
    )


def without(mesh, material):
    """The faces of a mesh that are not of a material."""
    kept = mesh.material != mesh.materials.index(material)
    return Mesh(
        vertex=mesh.vertex,
        face=mesh.face[kept],
        material=mesh.material[kept],
        part=mesh.part[kept],
        materials=mesh.materials,
        parts=mesh.parts,
    )


SEDAN = SHAPES["sedan"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("side", "bearings", "radii", "reach"),
    [
        ("front", (0.0,), (SEDAN.metal_front.radius, SEDAN.front.radius), SEDAN.metal_front.x),
        ("side", (90.0, -90.0), (SEDAN.side, SEDAN.flank.radius), SEDAN.width / 2),
        ("rear", (180.0,), (SEDAN.metal_rear.radius, SEDAN.rear.radius), -SEDAN.metal_rear.x),
    ],
)
def test_without_its_plastic_a_sedan_echoes_as_a_smooth_body(compare, side, bearings, radii, reach):
    """A specular point of radii r₁, r₂ at R₀ of the radar, the middle of the body at R.

    σ = π r₁ r₂ · R⁴ / (R₀² (R₀ + r₁)(R₀ + r₂)). Bonnet, cabin and wheels add the rest: 2 dB.
    """
    distance, height = 10.0, 0.5
    azimuth = np.radians([b + off for b in bearings for off in range(-10, 11)])
    mesh = without(vehicle_mesh("sedan"), "plastic")
    corners = mesh.corners.reshape(-1, 3)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    found = cross_sections(
        mesh,
        azimuth,
        tracer=TRACER,
        distance=distance,
        elevation=np.arcsin((height - middle[2]) / distance),
    )
    shift = {"front": -middle[0], "side": 0.0, "rear": middle[0]}[side]
    r0, (r1, r2) = distance - reach - shift, radii
    smooth = np.pi * r1 * r2 * distance**4 / (r0**2 * (r0 + r1) * (r0 + r2))
    compare(
        page="vehicles",
        case=f"sedan without plastic at 10 m, {side} ±10°, V",
        quantity="median RCS, dBsm",
        expected=float(to_db(smooth)),
        measured=float(to_db(np.median(found.rcs[:, 0, 0]))),
        tolerance=2.0,
        source="geometrical optics of the radii in traffic/shapes.py",
    )


def beam_by_quadrature(radius, length, limits, distance, height):
    """RCS, m², of an upright beam that is curved from above: −(j/8π)∬ 2 cosθ e^(−2jkr)/r² dS."""
    turn = np.linspace(-1, 1, 2401) * np.arcsin(length / 2 / radius)
    z = np.linspace(*limits, 401)
    along, across = radius * (np.cos(turn) - 1), radius * np.sin(turn)
    to_radar = np.stack(
        np.broadcast_arrays(distance - along[:, None], -across[:, None], height - z), axis=-1
    )
    away = np.linalg.norm(to_radar, axis=-1)
    outward = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)[:, None]
    cosine = np.sum(to_radar * outward, axis=-1) / away
    field = 2 * np.maximum(cosine, 0) * np.exp(-2j * WAVENUMBER * away) / away**2
    total = np.trapezoid(np.trapezoid(field, z, axis=1), radius * turn)
    return np.abs(total / (8 * np.pi)) ** 2 * (4 * np.pi) ** 3 * distance**4 / WAVELENGTH**2


@pytest.mark.parametrize("height", [0.455, 0.5, 0.6])
def test_a_bumper_beam_echoes_as_the_integral_over_its_face(compare, height):
    """Seen from ahead, 10 m from its middle; the plastic and all else are left out."""
    car = vehicle_mesh("sedan", fittings=Fittings())
    is_beam = car.part == car.parts.index("bumper-beam-front")
    mesh = mesh_of(car.corners[is_beam])
    ends = mesh.corners.reshape(-1, 3)
    middle, tip = 0.5 * (ends[:, 0].max() + ends[:, 0].min()), ends[:, 0].max()
    across = 10.0
    elevation = np.arcsin((height - 0.455) / across)
    found = cross_sections(
        mesh, np.zeros(1), tracer=TRACER, distance=across, elevation=float(elevation)
    )
    from_tip = middle + across * np.cos(elevation) - tip
    expected = beam_by_quadrature(
        SHAPES["sedan"].skin_front.radius, 0.66 * SHAPES["sedan"].width, (0.405, 0.505),
        from_tip, height,
    ) * (across / from_tip) ** 4  # fmt: skip
    compare(
        page="vehicles",
        case=f"bumper beam of the sedan alone at 10 m, {height:g} m high",
        quantity="RCS, dBsm",
        expected=float(to_db(expected)),
        measured=float(to_db(found.rcs[0, 0, 0])),
        tolerance=0.5,
        source="integral of physical optics over its face",
    )
