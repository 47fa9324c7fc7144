"""Echo of a conducting plate: near and far, straight and oblique."""

import numpy as np
import pytest

from polychirp.channel.composite import Composite
from polychirp.channel.materials import known_materials
from polychirp.channel.plain_optics import scattered
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, transfer_at
from polychirp.units import to_db

WAVELENGTH = SPEED_OF_LIGHT / 79e9
TRACER = Composite(dynamic_range=1e14)
"""Nothing is left out, however weak."""


def body(corners, *, material="metal", **pose):
    return Actor(name="body", kind="object", mesh=mesh_of(corners, material), pose=Pose(**pose))


def apparent_rcs(transfer, distance):
    """dBsm that the radar equation reads from an echo at ``distance``, for V and for H."""
    power = np.abs(np.diag(transfer)) ** 2
    return to_db(power * (4 * np.pi) ** 3 * distance**4 / WAVELENGTH**2)


def near_field_rcs(side, distance):
    """PO of a square at normal incidence by quadrature, without facets.

    a = −(j/8π) ∬ 2 cosθ (1 + cos²θ)/… : at normal incidence both polarisations average
    F = 2 cosθ (1 − z²/r²); its mean over the square's two axes is the same for V and H.
    """
    node, weight = np.polynomial.legendre.leggauss(int(60 + 400 * side))
    y, z = np.meshgrid(0.5 * side * node, 0.5 * side * node)
    w = np.outer(weight, weight) * (0.5 * side) ** 2
    r = np.sqrt(distance**2 + y**2 + z**2)
    phase = np.exp(-4j * np.pi / WAVELENGTH * (r - distance))
    total = np.sum(w * 2 * (distance / r) * (1 - z**2 / r**2) * phase / r**2) / (8 * np.pi)
    return to_db(np.abs(total) ** 2 * (4 * np.pi) ** 3 * distance**4 / WAVELENGTH**2)


@pytest.mark.parametrize("side", [0.05, 0.1, 0.3])
@pytest.mark.parametrize("distance", [5.0, 10.0, 30.0])
def test_a_plate_echoes_as_its_near_field_integral_says(side, distance):
    """0.1 dB: facets of 4 cm bend the wave front by less than λ/16 at 5 m."""
    paths = TRACER.trace(around([body(plate(side, 0.04))], [(distance, 0, 0)]))
    found = apparent_rcs(transfer_at(paths, 79e9), distance)
    np.testing.assert_allclose(found, near_field_rcs(side, distance), atol=0.1)


def test_far_away_a_plate_has_the_textbook_cross_section():
    """σ = 4πA²/λ², and the lobes of sinc² off the normal."""
    side, distance = 0.1, 3000.0
    for angle in np.radians([0.0, 1.0, 2.0, 5.0, 10.0, 20.0]):
        paths = TRACER.trace(around([body(plate(side, 0.03), yaw=angle)], [(distance, 0, 0)]))
        lobe = np.sinc(2 * side / WAVELENGTH * np.sin(angle)) * np.cos(angle)
        expected = to_db(4 * np.pi * side**4 / WAVELENGTH**2 * lobe**2)
        found = apparent_rcs(transfer_at(paths, 79e9), distance)
        np.testing.assert_allclose(found, expected, atol=0.1)


@pytest.mark.parametrize("material", ["metal", "glass", "rubber", "plastic"])
def test_kernels_agree_with_the_plain_formula(material):
    """Bistatic, all polarisations, phase and all: the sum of paths is the sum over facets."""
    corners = plate(0.2, 0.05)
    pose = Pose(x=0.3, y=-0.2, z=0.1, yaw=0.2, pitch=0.1)
    places = np.array([[8.0, 2.0, 0.5], [6.0, -3.0, 1.5]])
    actor = Actor(name="b", kind="object", mesh=mesh_of(corners, material), pose=pose)
    paths = TRACER.trace(around([actor], places))
    echoes = paths.select(paths.num_bounces > 0)
    row = known_materials()[material]
    for t, x in ((0, 0), (0, 1), (1, 0)):
        expected = scattered(pose.to_outer(corners), row, places[t], places[x], 79e9)
        found = transfer_at(echoes, 79e9, t, x)
        # fields are kept in single precision
        np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_a_pane_returns_what_a_slab_does():
    """Straight on, glass of 4 mm echoes 20 log₁₀ 0.5106 = −5.84 dB of metal."""
    echo = {
        material: transfer_at(
            TRACER.trace(around([body(plate(0.1, 0.05), material=material)], [(20, 0, 0)])), 79e9
        )[0, 0]
        for material in ("metal", "glass")
    }
    assert abs(echo["glass"] / echo["metal"]) == pytest.approx(0.5106, abs=2e-3)
