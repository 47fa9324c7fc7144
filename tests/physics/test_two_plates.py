"""Bounces from plate to plate, beside a quadrature in two steps, which knows no rays."""

import numpy as np
import pytest

from polychirp.channel.materials.library import known_materials
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, dihedral, mesh_of, plate, transfer_at
from polychirp.units import to_db
from tests.support.references.physical_optics import scattered
from tests.support.references.two_steps import Rectangle, scattered_twice
from tests.support.two_plates import any_plates, drawn_plates

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


def level_and_error(plates):
    """Power over that of two mirrors and error of the traced power, dB, all polarisations."""
    ends = plates.transmitter, plates.receiver
    right = np.linalg.norm(scattered_twice(*plates.rectangles, *ends, FREQUENCY))
    mirrors = np.sqrt(2) * WAVELENGTH / (4 * np.pi * plates.length)
    if not right:
        return -np.inf, 0.0
    found = np.linalg.norm(plates.traced(FREQUENCY))
    return to_db((right / mirrors) ** 2), to_db((found / right) ** 2)


def errors_above(level, plates):
    """|Error|, dB, of the pairs whose power over that of two mirrors exceeds a level, dB."""
    found = np.array([level_and_error(pair) for pair in plates])
    return np.abs(found[found[:, 0] > level, 1])


def test_bounces_from_plate_to_plate_are_right_to_a_decibel():
    """Near specular and off it: with sharp shadows, the latter is wrong by 3 dB in the median."""
    for degrees, tolerance in ((0.0, 0.1), (1.5, 1.0)):
        error = errors_above(-40.0, drawn_plates(3, np.radians(degrees), seed=21))
        assert len(error) == 3
        assert np.median(error) < 0.3
        assert np.max(error) < tolerance


@pytest.mark.slow
@pytest.mark.parametrize(
    ("degrees", "median", "greatest"),
    [(0.0, 0.1, 1.0), (0.5, 0.1, 1.0), (1.5, 0.3, 3.0), (5.0, 1.0, 3.0)],
)
def test_bounces_off_the_specular_direction(compare, degrees, median, greatest):
    """Drawn plates of which the last is turned, all polarisations together."""
    error = errors_above(-40.0, drawn_plates(24, np.radians(degrees), seed=3))
    assert len(error) >= 8
    for name, value, tolerance in (
        ("median", np.median(error), median),
        ("greatest", error.max(), greatest),
    ):
        compare(
            page="multi-bounce",
            case=f"24 pairs of plates of 0.12 to 0.25 m, {degrees:g}° off the specular direction,"
            " within 40 dB of two mirrors",
            quantity=f"{name} |error| of the power, dB",
            expected=0.0,
            measured=float(value),
            tolerance=tolerance,
            source="physical optics by quadrature in two steps",
        )


@pytest.mark.slow
def test_bounces_between_drawn_plates(compare):
    """Of many sizes, distances and angles, bistatic, one of the two turned by up to 5°."""
    error = errors_above(-40.0, (pair for _, pair in any_plates(24, seed=31)))
    assert len(error) >= 8
    for name, value, tolerance in (
        ("median", np.median(error), 0.3),
        ("greatest", error.max(), 3.0),
    ):
        compare(
            page="multi-bounce",
            case="24 pairs of plates of 0.1 to 0.5 m, 0.5 to 6 m apart, 0° to 5° off the specular"
            " direction, within 40 dB of two mirrors",
            quantity=f"{name} |error| of the power, dB",
            expected=0.0,
            measured=float(value),
            tolerance=tolerance,
            source="physical optics by quadrature in two steps",
        )


@pytest.mark.slow
def test_half_a_gigahertz_off_bounces_are_as_right():
    """The delay of what edges diffract is that of the way over them."""
    error = []
    for plates in drawn_plates(4, np.radians(1.5), seed=22):
        ends = plates.transmitter, plates.receiver
        for frequency in (78.5e9, 79.5e9):
            right = scattered_twice(*plates.rectangles, *ends, frequency)
            found = plates.traced(frequency)
            error.append(to_db(np.linalg.norm(found) ** 2 / np.linalg.norm(right) ** 2))
    assert np.median(np.abs(error)) < 0.5
    assert np.max(np.abs(error)) < 3.0


def one_pair():
    (plates,) = drawn_plates(1, np.radians(1.5), seed=23)
    return plates


def wall(place, towards, side=1.0, material="metal"):
    """A plate at a place, m, that faces along a way."""
    yaw = np.arctan2(towards[1], towards[0])
    pitch = np.arcsin(towards[2] / np.linalg.norm(towards))
    x, y, z = place
    pose = Pose(x=x, y=y, z=z, yaw=yaw, pitch=pitch)
    mesh = mesh_of(plate(side, 0.1), material)
    return Actor(name="wall", kind="object", mesh=mesh, pose=pose)


def test_what_stands_between_hides_each_leg():
    plates = one_pair()
    first, last = (pose.position for pose in plates.pose)
    free = np.abs(plates.traced(FREQUENCY)).max()
    for start, end in ((plates.transmitter, first), (first, last), (last, plates.receiver)):
        hidden = plates.traced(FREQUENCY, [wall(0.5 * (start + end), end - start)])
        assert np.abs(hidden).max() < 1e-3 * free
    beside = wall(first + np.array([0.0, 0.0, 3.0]), last - first)
    np.testing.assert_allclose(
        plates.traced(FREQUENCY, [beside]), plates.traced(FREQUENCY), rtol=0, atol=1e-9 * free
    )


def test_a_corner_of_two_touching_bodies_is_that_of_one_body():
    """At their common edge, the wave of one goes on in the other: there is no window."""
    corners = dihedral(0.2, 0.05)
    half = len(corners) // 2
    echo = []
    for groups in ((corners,), (corners[:half], corners[half:])):
        actors = [
            Actor(name=str(number), kind="object", mesh=mesh_of(group), pose=Pose(yaw=0.05))
            for number, group in enumerate(groups)
        ]
        world = Composite(dynamic_range=1e20).prepare(around(actors, [(30.0, 0.0, 0.0)]))
        echo.append(transfer_at(tube_paths(world, np.array([[0, 0]])), FREQUENCY))
    one, two = (np.abs(matrix[0, 0]) for matrix in echo)
    assert to_db((two / one) ** 2) == pytest.approx(0.0, abs=0.1)
