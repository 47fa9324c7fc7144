"""Echo of a trihedral by Kirchhoff's integral over its mouth, near or far, on or off its axis."""

from __future__ import annotations

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT


def trihedral_echo(
    side: float, place: FloatArray, frequency: float, *, points: int = 1000
) -> float:
    r"""Magnitude of the echo of `polychirp.testing.shapes.trihedral` between isotropic antennas.

    .. math:: |a| = \left|\frac{1}{8\pi} \iint (\cos\theta_1 + \cos\theta_2)
        \frac{e^{-jk(s_1+s_2)}}{s_1 s_2}\,\mathrm dA\right|

    Three mirrors turn the radar over at the apex, so that a wave leaves through the mouth as if it
    came from this image, :math:`s_1` away. A ray that leaves through a point p of the mouth came
    in along the line from the radar to −p: where that line crosses the plane of the mouth must be
    in the mouth, too. Both ends of the ray are as far from the apex, by the sum of their
    coordinates along the three edges, as the mouth is, and all points between them are nearer,
    because this sum is convex: no mirror ends before the ray meets it. Bounces of one and two
    mirrors are left out; they return little to a radar within some 15° of the axis.

    Parameters
    ----------
    side : length of the edges at the apex, m
    place : of the radar, m ``(xyz,)``; the apex is at the origin, the axis is +x
    frequency : Hz
    points : of the quadrature, along both sides of a square around the mouth
    """
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    angle = 2 * np.pi / 3 * np.arange(3)
    edges = side * np.stack(
        [
            np.full(3, np.sqrt(1 / 3)),
            np.sqrt(2 / 3) * np.cos(angle),
            np.sqrt(2 / 3) * np.sin(angle),
        ],
        axis=-1,
    )
    height, reach = side / np.sqrt(3), side * np.sqrt(2 / 3)
    line = reach * ((np.arange(points) + 0.5) * 2 / points - 1)
    y, z = np.meshgrid(line, line, indexing="ij")
    leaves = np.stack([np.full_like(y, height), y, z], axis=-1)
    share = (height - place[0]) / (-height - place[0])
    enters = place + share * (-leaves - place)
    inverse = np.linalg.inv(edges)
    is_open = np.all(leaves @ inverse > 0, axis=-1) & np.all(enters @ inverse > 0, axis=-1)
    s1 = np.linalg.norm(leaves + place, axis=-1)
    s2 = np.linalg.norm(leaves - place, axis=-1)
    facing = (leaves[..., 0] + place[0]) / s1 + (place[0] - leaves[..., 0]) / s2
    wave = np.exp(-1j * k * (s1 + s2 - 2 * np.linalg.norm(place))) / (s1 * s2)
    cell = (2 * reach / points) ** 2
    return float(np.abs(np.sum(is_open * facing * wave)) * cell / (8 * np.pi))
