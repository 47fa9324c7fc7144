"""The window of a flat mirror's border, beside Kirchhoff's integral over its area."""

import numpy as np
import pytest
from scipy.special import fresnel

from polychirp.channel.ray_tubes import fresnel_window
from polychirp.constants import SPEED_OF_LIGHT
from tests.support.kernels import callable_from_python
from tests.support.references.fresnel_window import window_by_area

FREQUENCY = 79e9
WAVENUMBER = 2 * np.pi * FREQUENCY / SPEED_OF_LIGHT
window = callable_from_python(fresnel_window.window)


def border_of(*corners):
    """Edges of a polygon, m ``(edge, end, xyz)``."""
    corner = np.array(corners, dtype=float)
    return np.stack([corner, np.roll(corner, -1, axis=0)], axis=1)


def through(border, transmitter, point):
    """The window of a border in the plane z = 0."""
    image = (transmitter[0], transmitter[1], -transmitter[2])
    return window(border, (0.0, 0.0, 1.0), image, tuple(point), WAVENUMBER)


def rectangle(x, y):
    """Border of a rectangle about the origin with these half sides, m."""
    return border_of((-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0))


def test_the_window_is_the_integral_over_the_area():
    """Drawn rectangles, on both sides of the shadow's border; terms of the angle are left out."""
    rng = np.random.default_rng(5)
    error = []
    for _ in range(40):
        x, y = rng.uniform(0.05, 0.2, 2)
        transmitter = rng.uniform([-3, -3, 4], [3, 3, 9])
        mirrored = transmitter * [1, 1, -1]
        specular = rng.uniform(-1.6, 1.6, 2) * (x, y)
        way = np.append(specular, 0.0) - mirrored
        point = mirrored + way * (1 + rng.uniform(1.0, 3.0) / np.linalg.norm(way))
        sides = np.array([x, 0, 0]), np.array([0, y, 0])
        right = window_by_area((np.zeros(3), *sides), transmitter, point, FREQUENCY, points=300)
        error.append(abs(through(rectangle(x, y), transmitter, point).share - right))
    assert np.median(error) < 3e-3
    assert np.max(error) < 0.03


@pytest.mark.parametrize("off", [-0.3, -0.05, -1e-4, 0.0, 1e-4, 0.02, 0.2])
def test_a_long_edge_is_a_knife_edge(off):
    """(1 + j)/2 times Fresnel's integral from the edge on; ½ at the border of the shadow."""
    border = border_of((-60, -60, 0), (off, -60, 0), (off, 60, 0), (-60, 60, 0))
    found = through(border, (0.0, 0.0, 6.0), (0.0, 0.0, 3.0)).share
    detour = np.hypot(off, 6.0) + np.hypot(off, 3.0) - 9.0
    u = np.sign(-off) * np.sqrt(2 * WAVENUMBER * detour / np.pi)
    s, c = fresnel(u)
    assert found == pytest.approx(0.5 * (1 + 1j) * ((0.5 - c) - 1j * (0.5 - s)), abs=6e-3)


def test_windows_of_neighbours_add_up():
    """Two halves of a rectangle leave what the whole leaves, also with S on their common edge."""
    left = border_of((-0.2, -0.1, 0), (0.03, -0.1, 0), (0.03, 0.1, 0), (-0.2, 0.1, 0))
    right = border_of((0.03, -0.1, 0), (0.2, -0.1, 0), (0.2, 0.1, 0), (0.03, 0.1, 0))
    for x in (-0.5, 0.0, 0.03, 0.1):
        ends = (x, 0.02, 5.0), (x, 0.02, 2.0)
        both = through(left, *ends).share + through(right, *ends).share
        assert both == pytest.approx(through(rectangle(0.2, 0.1), *ends).share, abs=2e-3)


def test_the_nearest_point_is_the_specular_one_or_on_the_border():
    border = rectangle(0.2, 0.1)
    inside = through(border, (0.1, 0.0, 5.0), (0.1, 0.0, 2.0))
    assert inside.nearest == inside.specular == pytest.approx((0.1, 0.0, 0.0), abs=1e-12)
    outside = through(border, (0.5, 0.05, 5.0), (0.5, 0.05, 2.0))
    assert outside.specular == pytest.approx((0.5, 0.05, 0.0), abs=1e-12)
    assert outside.nearest == pytest.approx((0.2, 0.05, 0.0), abs=1e-3)
