"""What physical optics lacks at an edge: a conducting strip, solved exactly.

A strip of width w = 2a, thin and endless, is lit at an angle φ from its normal, with the electric
field along it ("soft") or across it ("hard"). Echo widths of three routes, e^{+jωt}:

*Exact.* With x = a cosθ, q = J dx/dθ and the Hankel kernel, both polarisations are one integral,

    ∫ H₀⁽²⁾(ka|cosθ − cosθ'|) q(θ') dθ' = g(θ),

where g = (4/k) e^{jkx sinφ} if soft (EFIE, ηJ for J). If hard, (d²/dx² + k²) of the left side is
4k cosφ e^{jkx sinφ}, hence g = 4/(k cosφ) e^{jkx sinφ} + C₁ cos kx + C₂ sin kx, in which both C
make the current vanish at the edges (Hallén 1938). The logarithm of the kernel is integrated in
closed form on the cosines cos nθ, which carry the current's behaviour at the edges with them, so
that the error falls exponentially with the number of unknowns.

*Physical optics.* J = 2n×H: k w² cos²φ sinc²(kw sinφ), the same for both.

*With fringe currents* (Ufimtsev 1962): the half-plane's diffraction, less that of its physical
optics, at both edges: 1 ± tan(φ/2) where physical optics has ± cotφ, soft; the signs of the tangent
change places and that of physical optics turns if hard.

The first tests check these references against each other; the last one holds polychirp to them.
"""

import numpy as np
import pytest
from scipy.special import j0, y0

from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, transfer_at
from polychirp.units import to_db

WAVELENGTH = SPEED_OF_LIGHT / 79e9
K = 2 * np.pi / WAVELENGTH
BOTH = pytest.mark.parametrize("polarisation", ["soft", "hard"])
MOST = {"soft": 2.0, "hard": 3.5}
"""Amplitude that physical optics lacks at both edges together, up to 80° from the normal."""


class Strip:
    """The exact currents of a strip, width in wavelengths."""

    def __init__(self, width, unknowns=None):
        self.half = 0.5 * width * WAVELENGTH
        self.size = size = unknowns or int(12 * width) + 40
        self.theta = (np.arange(size) + 0.5) * np.pi / size
        self.x = self.half * np.cos(self.theta)
        orders = np.arange(1, size)
        cosines = np.cos(np.outer(self.theta, orders))
        # ∫ ln|cosθ − cosθ'| cos nθ' dθ' is −(π/n) cos nθ, and −π ln 2 for n = 0
        log_rule = -(np.pi * np.log(2) + 2 * (cosines * (np.pi / orders)) @ cosines.T) / size
        gap = np.abs(np.subtract.outer(self.x, self.x)) * K
        np.fill_diagonal(gap, 1.0)
        logarithm = np.log(gap / (K * self.half))
        smooth = j0(gap) - 1j * (y0(gap) - 2 / np.pi * logarithm * j0(gap))
        np.fill_diagonal(gap, 0.0)
        own = 1 - 2j / np.pi * (np.log(0.5 * K * self.half) + np.euler_gamma)
        np.fill_diagonal(smooth, own)
        self.matrix = -2j / np.pi * log_rule * j0(gap) + np.pi / size * smooth
        # q at both edges, by its cosines
        self.edges = np.stack(
            [(1 + 2 * cosines @ sign) / size for sign in (np.ones(size - 1), (-1.0) ** orders)]
        )

    def wave(self, angle):
        return np.exp(1j * K * self.x * np.sin(angle))

    def soft(self, angle):
        """Current q at the nodes, times η."""
        return np.linalg.solve(self.matrix, 4 / K * self.wave(angle))

    def hard(self, angle):
        """Current q at the nodes."""
        free = np.stack([np.cos(K * self.x), np.sin(K * self.x)], axis=1)
        whole = np.block([[self.matrix, -free], [self.edges, np.zeros((2, 2))]])
        right = np.append(4 / (K * np.cos(angle)) * self.wave(angle), [0, 0])
        return np.linalg.solve(whole, right)[: self.size]

    def radiated(self, current, angle):
        """∫ J e^{jkx sinφ} dx."""
        return np.pi / self.size * np.sum(current * self.wave(angle))

    def amplitude(self, polarisation, angle):
        """B back to where the wave came from; the echo width is |B|²/4k, and phases count."""
        if polarisation == "soft":
            return 1j * K * self.radiated(self.soft(angle), angle)
        return 1j * K * np.cos(angle) * self.radiated(self.hard(angle), angle)


def of_optics(width, angle):
    """B of physical optics: both edges' ± cotφ e^{±jkw sinφ}."""
    phase = K * width * WAVELENGTH * np.sin(angle)
    return 2j * np.cos(angle) * K * width * WAVELENGTH * np.sinc(phase / np.pi)


def of_fringes(polarisation, width, angle):
    """B of the fringe currents of both edges, each as if the other were not there."""
    turn = np.exp(1j * K * width * WAVELENGTH * np.sin(angle))
    tangent = np.tan(0.5 * angle)
    if polarisation == "soft":
        return (1 + tangent) * turn + (1 - tangent) / turn
    return -((1 - tangent) * turn + (1 + tangent) / turn)


@BOTH
@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2])
def test_the_exact_strip_scatters_as_much_as_it_takes(polarisation, angle):
    """Optical theorem: power over all directions is what the currents take from the wave."""
    strip = Strip(10)
    current = getattr(strip, polarisation)(angle)
    share = 1.0 if polarisation == "soft" else np.cos(angle)
    taken = share * np.real(np.pi / strip.size * np.sum(current * strip.wave(angle).conj()))
    around_it = 2 * np.pi * np.arange(720) / 720
    shares = np.ones(720) if polarisation == "soft" else np.cos(around_it)
    far = np.array([strip.radiated(current, a) for a in around_it]) * shares
    assert K / (8 * np.pi) * np.mean(np.abs(far) ** 2) * 2 * np.pi == pytest.approx(taken, rel=1e-8)


@BOTH
def test_the_exact_strip_does_not_depend_on_its_unknowns(polarisation):
    coarse, fine = (Strip(10, size).amplitude(polarisation, 0.7) for size in (120, 240))
    assert abs(fine / coarse - 1) < 1e-8


def test_fringe_currents_are_all_that_optics_lacks_if_edges_do_not_see_each_other():
    """Soft: along the strip the wave of one edge vanishes at the other. So both solutions hold."""
    strip = Strip(10)
    for degrees in (0.0, 10.0, 30.0, 50.0, 70.0):
        angle = np.radians(degrees)
        lack = strip.amplitude("soft", angle) - of_optics(10, angle)
        assert abs(lack - of_fringes("soft", 10, angle)) < 0.01


def test_hard_edges_see_each_other_less_the_farther_they_are_apart():
    """What fringe currents of single edges leave over is diffracted twice: it falls as 1/√w."""

    def left_over(width):
        strip, angles = Strip(width), np.radians(np.arange(0.0, 30.0, 1.0))
        known = [of_optics(width, a) + of_fringes("hard", width, a) for a in angles]
        exact = [strip.amplitude("hard", a) for a in angles]
        return np.sqrt(np.mean(np.abs(np.subtract(exact, known)) ** 2))

    assert left_over(40) / left_over(10) == pytest.approx(0.5, rel=0.1)


@BOTH
@pytest.mark.parametrize("width", [5, 10, 20])
def test_optics_lacks_no_more_than_two_edges(polarisation, width):
    """Of each edge 1 ± tan(φ/2); if hard, edges see each other, and the sum is up to 3.5."""
    strip = Strip(width)
    angles = np.radians(np.arange(0.0, 80.0, 1.0))
    lack = [abs(strip.amplitude(polarisation, a) - of_optics(width, a)) for a in angles]
    assert max(lack) < MOST[polarisation] + 0.01


@BOTH
@pytest.mark.parametrize("lobe", [0, 1, 4, 8, 12, 16])
def test_lobes_of_a_plate_are_those_of_optics_and_within_the_edges_of_the_exact_ones(
    compare, polarisation, lobe
):
    """A traced plate of 10 λ, as a strip of its width: σ = 2L²/λ · echo width. V is soft.

    The plate has the lobes of physical optics in closed form, and what these lack of the exact
    ones is bounded by the two edges.
    """
    width, distance = 10, 3000.0
    side = width * WAVELENGTH
    angle = np.arcsin((lobe + 0.5) / (2 * width)) if lobe else 0.0
    mesh = mesh_of(plate(side, 0.02))
    actor = Actor(name="plate", kind="object", mesh=mesh, pose=Pose(yaw=angle))
    paths = Composite(dynamic_range=1e14).trace(around([actor], [(distance, 0, 0)]))
    entry = 0 if polarisation == "soft" else 1
    power = abs(transfer_at(paths, 79e9)[entry, entry]) ** 2
    echo = power * (4 * np.pi) ** 3 * distance**4 / WAVELENGTH**2 / (2 * side**2)
    optics = abs(of_optics(width, angle)) ** 2 / (4 * K * WAVELENGTH)
    assert to_db(echo) == pytest.approx(to_db(optics), abs=0.1)
    exact = abs(Strip(width).amplitude(polarisation, angle)) ** 2 / (4 * K * WAVELENGTH)
    compare(
        page="canonical-bodies",
        case=f"lobe {lobe}, {np.degrees(angle):.1f}° from the normal, {polarisation}",
        quantity="echo width of a strip of 10 λ, dB over λ",
        expected=float(to_db(exact)),
        measured=float(to_db(echo)),
        tolerance=float(20 * np.log10(1 + MOST[polarisation] / abs(of_optics(width, angle)))),
        source="integral equation of the strip",
    )
