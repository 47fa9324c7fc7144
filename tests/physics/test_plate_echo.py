"""Echo of plates, disc and cylinder: near and far, straight and oblique."""

import numpy as np
import pytest

from polychirp.channel.materials.library import known_materials
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, transfer_at
from polychirp.units import to_db
from tests.support.references.physical_optics import scattered
from tests.support.revolved import cylinder, disc

WAVELENGTH = SPEED_OF_LIGHT / 79e9
TRACER = Composite(dynamic_range=1e14)
"""Dynamic range that leaves out no path."""


def body(corners, *, material="metal", **pose):
    return Actor(name="body", kind="object", mesh=mesh_of(corners, material), pose=Pose(**pose))


def apparent_rcs(transfer, distance):
    """Cross section by the radar equation of an echo at ``distance``, dBsm, for V and for H."""
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


NEAR = {
    (0.05, 5.0): 7.33, (0.1, 5.0): 18.88, (0.3, 5.0): 20.31, (1.0, 5.0): 19.09,
    (0.05, 10.0): 7.36, (0.1, 10.0): 19.28, (0.3, 10.0): 26.96, (1.0, 10.0): 25.43,
    (0.05, 30.0): 7.37, (0.1, 30.0): 19.39, (0.3, 30.0): 37.29, (1.0, 30.0): 35.68,
}  # fmt: skip
"""dBsm of plates, side and distance in m, by an independent quadrature."""

LOBES = {0: 19.41, 1: -1.88, 2: -2.14, 5: -4.19, 10: -16.66, 20: -38.12, 40: -31.92}
"""dBsm of a plate of 0.1 m far away, degrees from the normal, by physical optics' sinc."""


@pytest.mark.parametrize(("side", "distance"), NEAR)
def test_the_near_field_integral_is_the_tabulated_one(side, distance):
    """To the table's two decimals."""
    assert near_field_rcs(side, distance) == pytest.approx(NEAR[side, distance], abs=6e-3)


@pytest.mark.parametrize(("side", "distance"), NEAR)
def test_a_plate_echoes_as_its_near_field_integral_says(compare, side, distance):
    """0.1 dB: facets of 4 cm bend the wave front by less than λ/16 at 5 m."""
    paths = TRACER.trace(around([body(plate(side, 0.04))], [(distance, 0, 0)]))
    both = apparent_rcs(transfer_at(paths, 79e9), distance)
    assert both[0] == pytest.approx(both[1], abs=0.01)
    compare(
        page="canonical-bodies",
        case=f"plate {side:g} m at {distance:g} m",
        quantity="RCS of a plate straight on, dBsm",
        expected=NEAR[side, distance],
        measured=float(both[0]),
        tolerance=0.1,
        source="near-field physical optics by quadrature",
    )


@pytest.mark.parametrize(("side", "expected"), [(0.05, 7.37), (0.1, 19.41), (0.3, 38.49)])
def test_far_away_a_plate_has_the_textbook_cross_section(compare, side, expected):
    distance = 3000.0
    paths = TRACER.trace(around([body(plate(side, 0.04))], [(distance, 0, 0)]))
    compare(
        page="canonical-bodies",
        case=f"plate {side:g} m, far field",
        quantity="RCS of a plate straight on, dBsm",
        expected=expected,
        measured=float(apparent_rcs(transfer_at(paths, 79e9), distance)[0]),
        tolerance=0.1,
        source="4πA²/λ²",
    )


@pytest.mark.parametrize("angle", LOBES)
def test_far_away_a_plate_has_the_lobes_of_sinc(compare, angle):
    """4πA²/λ² · (cosθ sinc(ka sinθ))²; real edges differ beyond some 20°."""
    side, distance = 0.1, 3000.0
    turned = body(plate(side, 0.03), yaw=np.radians(angle))
    paths = TRACER.trace(around([turned], [(distance, 0, 0)]))
    both = apparent_rcs(transfer_at(paths, 79e9), distance)
    assert both[0] == pytest.approx(both[1], abs=0.01)
    compare(
        page="canonical-bodies",
        case=f"plate 0.1 m, {angle}° from the normal",
        quantity="RCS of a plate, far field, dBsm",
        expected=LOBES[angle],
        measured=float(both[0]),
        tolerance=0.1,
        source="physical optics: 4πA²/λ² · (cosθ sinc(2a sinθ/λ))²",
    )


@pytest.mark.parametrize(
    ("case", "corners", "expected", "tolerance", "source"),
    [
        ("disc, diameter 0.12 m", disc(0.06, 0.02), 20.48, 0.1, "4πA²/λ²"),
        ("cylinder, radius 0.05 m, height 0.1 m", cylinder(0.05, 0.1, 1e-3), -0.82, 0.3, "krh²"),
    ],
)
def test_far_away_bodies_of_revolution_have_textbook_cross_sections(
    compare, case, corners, expected, tolerance, source
):
    """Straight ahead. At the cylinder's shadow edge physical optics has a ripple below 0.1 dB."""
    distance = 3000.0
    paths = TRACER.trace(around([body(corners)], [(distance, 0, 0)]))
    both = apparent_rcs(transfer_at(paths, 79e9), distance)
    assert both[0] == pytest.approx(both[1], abs=0.3)
    compare(
        page="canonical-bodies",
        case=case,
        quantity="RCS straight on, far field, dBsm",
        expected=expected,
        measured=float(both[0]),
        tolerance=tolerance,
        source=source,
    )


@pytest.mark.parametrize("material", ["metal", "glass", "rubber", "plastic"])
def test_kernels_agree_with_the_plain_formula(material):
    """Bistatic, all polarisations, with phases: the sum of paths is the sum over facets.

    A plate of three cells by three is too small to be integrated along its border, and its cells
    are too small to be divided.
    """
    corners = plate(0.09, 0.03)
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


def test_a_pane_returns_what_a_slab_does(compare):
    """Straight on, glass of 4 mm echoes 20 log₁₀ 0.5106 = −5.84 dB of metal."""
    echo = {
        material: transfer_at(
            TRACER.trace(around([body(plate(0.1, 0.05), material=material)], [(20, 0, 0)])), 79e9
        )[0, 0]
        for material in ("metal", "glass")
    }
    compare(
        page="materials",
        case="pane of glass 4 mm over metal, straight on, traced",
        quantity="echo of a plate, ratio of amplitudes",
        expected=0.5106,
        measured=float(abs(echo["glass"] / echo["metal"])),
        tolerance=2e-3,
        source="slab of Fresnel's coefficients, by hand",
    )
