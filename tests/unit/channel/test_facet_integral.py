"""The integral of a linear phase over a triangle, and its terms."""

import numpy as np
import pytest

from polychirp.channel.physical_optics.facet_integral import facet_integral, facet_terms


def by_quadrature(phases):
    """Mean of e^{−jp} over a triangle: Gauss–Legendre on a square folded to it."""
    node, weight = np.polynomial.legendre.leggauss(60)
    a, b = np.meshgrid(0.5 * (node + 1), 0.5 * (node + 1), indexing="ij")
    phase = phases[0] * (1 - a) + a * (phases[1] * (1 - b) + phases[2] * b)
    return np.sum(np.outer(weight, weight) / 4 * 2 * a * np.exp(-1j * phase))


PHASES = [
    (0.0, 0.0, 0.0),
    (0.3, 0.301, 0.305),
    (1.0, 1.0, 2.5),
    (1.0, 2.5, 2.5),
    (-3.0, 0.1, 9.0),
    (5.0, 5.2, 40.0),
    (0.0, 1e-9, 30.0),
    (0.0, 30.0, 30.0 + 1e-12),
]


@pytest.mark.parametrize("phases", PHASES)
def test_the_closed_form_is_the_mean(phases):
    assert facet_integral(*sorted(phases)) == pytest.approx(by_quadrature(phases), abs=2e-9)


@pytest.mark.parametrize("phases", PHASES)
@pytest.mark.parametrize("turn", [0, 1, 2])
def test_the_terms_add_up_to_the_integral(phases, turn):
    order = tuple(np.roll(phases, turn))
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    count = facet_terms(order, weight, place)
    assert np.sum(weight[:count]) == pytest.approx(by_quadrature(phases), abs=2e-9)
    np.testing.assert_allclose(place[:count].sum(axis=1), 1.0)


@pytest.mark.parametrize("phases", [(-3.0, 0.1, 9.0), (5.0, 5.2, 40.0), (0.0, 29.9, 30.0)])
def test_terms_at_their_places_keep_the_integral_over_frequency(phases):
    """A change of frequency by 0.6 % turns each term by its own phase: within 2 %."""
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    count = facet_terms(phases, weight, place)
    change = 0.006
    turned = np.sum(weight[:count] * np.exp(-1j * change * (place[:count] @ np.array(phases))))
    exact = by_quadrature(np.array(phases) * (1 + change))
    assert abs(turned - exact) < 0.02 * max(abs(exact), np.abs(weight[:count]).max())
