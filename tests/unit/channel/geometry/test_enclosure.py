"""Winding numbers of closed surfaces."""

import numpy as np
import pytest

from polychirp.channel.geometry.enclosure import winding_numbers
from polychirp.testing.shapes import box, sphere


@pytest.mark.parametrize("corners", [box((1, 1, 1), 0.5), sphere(0.5, 0.2)])
def test_a_closed_surface_winds_once_around_points_inside_and_never_around_points_outside(corners):
    points = np.array([[0.1, 0.2, -0.1], [0.1, 0.2, 3.0]])
    np.testing.assert_allclose(winding_numbers(corners, points), [1.0, 0.0], atol=1e-12)
