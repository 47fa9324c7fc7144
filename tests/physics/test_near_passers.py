r"""The echo of a car's side that passes near a radar, beside a quadrature without facets.

A metal side curves away by 60 m along the car and 8 m across it, as a car's does. Physical optics
near its mirror point gives :math:`|H| = |\int\cos\theta\,e^{-2jkR}/R^2\,dA|/4\pi`.
"""

import numpy as np
import pytest

from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, transfer_at
from polychirp.units import to_db

FREQUENCY = 79e9
WAVENUMBER = 2 * np.pi * FREQUENCY / SPEED_OF_LIGHT
LENGTH, HEIGHT = 3.0, 0.5  # m
ALONG, ACROSS = 60.0, 8.0  # radii, m
TRACER = Composite(max_bounces=1)


def curved(y, z):
    """Depth of the side behind its foremost point, m."""
    return y**2 / (2 * ALONG) + z**2 / (2 * ACROSS)


def side(edge):
    """The side with triangles of legs of ``edge``, m ``(face, corner, xyz)``; it faces −x."""
    y = np.linspace(-LENGTH / 2, LENGTH / 2, int(np.ceil(LENGTH / edge)) + 1)
    z = np.linspace(-HEIGHT / 2, HEIGHT / 2, int(np.ceil(HEIGHT / edge)) + 1)
    grid = np.stack(np.meshgrid(y, z, indexing="ij"), axis=-1)
    point = np.concatenate([curved(grid[..., :1], grid[..., 1:]), grid], axis=-1)
    a, b, c, d = point[:-1, :-1], point[1:, :-1], point[1:, 1:], point[:-1, 1:]
    halves = [np.stack(corners, axis=2).reshape(-1, 3, 3) for corners in ((a, c, b), (a, d, c))]
    return np.concatenate(halves)


def traced(mesh, distance, shift):
    """Amplitude of the traced echo, with the side shifted by ``shift`` m along itself."""
    body = Actor(name="side", kind="object", mesh=mesh, pose=Pose(x=distance, y=shift))
    return abs(transfer_at(TRACER.trace(around([body], [(0.0, 0.0, 0.0)])), FREQUENCY)[0, 0])


def by_quadrature(distance, shift):
    """The same by sums over cells of 1 by 4 mm."""
    y = np.arange(-LENGTH / 2, LENGTH / 2, 1e-3)[:, None] + 0.5e-3
    z = np.arange(-HEIGHT / 2, HEIGHT / 2, 4e-3) + 2e-3
    x = distance + curved(y, z)
    length = np.sqrt(x**2 + (y + shift) ** 2 + z**2)
    facing = (x - (y + shift) * y / ALONG - z * z / ACROSS) / length
    wave = facing * np.exp(-2j * WAVENUMBER * length) / length**2
    return abs(np.sum(wave) * 4e-6) / (4 * np.pi)


@pytest.mark.parametrize("distance", [1.5, 2.2, 4.0, 7.0, 12.0])
def test_a_passing_side_does_not_flicker(distance):
    """Whole facets with edges of 5 cm flicker by 2.3 dB at 2.2 m.

    The facets' chords are 39 µm off the curved side, which is worth up to 0.7 dB of the level.
    """
    mesh = mesh_of(side(0.05))
    ratio = np.array(
        [traced(mesh, distance, s) / by_quadrature(distance, s) for s in np.arange(0, 0.1, 0.012)]
    )
    assert np.std(ratio) / np.mean(ratio) < 10 ** (-28 / 20)
    assert to_db(np.mean(ratio) ** 2) == pytest.approx(0.0, abs=0.8)
