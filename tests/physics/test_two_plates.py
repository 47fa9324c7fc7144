"""Bounces from plate to plate: ray tubes beside a quadrature in two steps, which knows no rays."""

import numpy as np
import pytest

from polychirp.channel.materials.library import known_materials
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.units import to_db
from tests.support.references.physical_optics import scattered
from tests.support.references.two_steps import Rectangle, scattered_twice
from tests.support.two_plates import drawn_plates

FREQUENCY = 79e9
WAVELENGTH = SPEED_OF_LIGHT / FREQUENCY


def test_both_ways_over_two_mirrors_are_transposed():
    """Near specular, where physical optics is reciprocal."""
    (plates,) = drawn_plates(1, 0.0, seed=8)
    first, last = plates.rectangles
    there = scattered_twice(first, last, plates.transmitter, plates.receiver, FREQUENCY)
    back = scattered_twice(last, first, plates.receiver, plates.transmitter, FREQUENCY)
    np.testing.assert_allclose(there, back.T, atol=0.01 * np.abs(there).max())


@pytest.mark.slow
def test_a_large_first_plate_shows_the_image_of_the_transmitter():
    """What a small plate scatters of the image in a mirror far larger than the Fresnel zone.

    The mean of both ways, as in `scattered`.
    """
    mirror = Rectangle(np.zeros(3), np.array([0, 0.16, 0]), np.array([0, 0, 0.16]))
    place, normal = np.array([0.15, 0.05, 0.0]), np.array([-0.8, -0.6, 0.0])
    u, v = 0.015 * np.array([0.6, -0.8, 0.0]), np.array([0.0, 0.0, 0.015])
    u = u if np.cross(u, v) @ normal > 0 else -u
    small = Rectangle(place, u, v)
    start, end = np.array([3.0, -1.0, 0.1]), np.array([-1.0, -3.0, 0.05])
    there = scattered_twice(mirror, small, start, end, FREQUENCY)
    back = scattered_twice(small, mirror, end, start, FREQUENCY)
    found = 0.5 * (there + back.T)
    a, b, c, d = place - u - v, place + u - v, place + u + v, place - u + v
    corners = np.array([[a, b, c], [a, c, d]])
    image = start * [-1, 1, 1]
    expected = scattered(corners, known_materials()["metal"], image, end, FREQUENCY)
    singular = [np.linalg.svd(matrix, compute_uv=False) for matrix in (found, expected)]
    np.testing.assert_allclose(*singular, rtol=0.03)


@pytest.mark.slow
def test_near_specular_tubes_are_right_to_a_decibel(compare):
    """Drawn plates whose middles turn the wave to the receiver, all polarisations together."""
    error, level = [], []
    for plates in drawn_plates(16, 0.0, seed=3):
        ends = plates.transmitter, plates.receiver
        right = np.linalg.norm(scattered_twice(*plates.rectangles, *ends, FREQUENCY))
        found = np.linalg.norm(plates.traced(FREQUENCY))
        level.append(to_db((right * 4 * np.pi * plates.length / WAVELENGTH) ** 2 / 2))
        error.append(to_db((found / right) ** 2))
    strong = np.abs(error)[np.array(level) > -20]
    for name, value, tolerance in (
        ("median", np.median(strong), 1.0),
        ("greatest", strong.max(), 3.0),
    ):
        compare(
            page="multi-bounce",
            case="16 pairs of plates of 0.12 to 0.25 m, near specular, within 20 dB of two mirrors",
            quantity=f"{name} |error| of the power, dB",
            expected=0.0,
            measured=float(value),
            tolerance=tolerance,
            source="physical optics by quadrature in two steps",
        )
