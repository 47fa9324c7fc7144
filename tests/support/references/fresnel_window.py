"""Reference for the Fresnel window of a flat mirror: a sum over its area."""

from __future__ import annotations

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT


def window_by_area(
    rectangle: tuple[FloatArray, FloatArray, FloatArray],
    transmitter: FloatArray,
    point: FloatArray,
    frequency: float,
    *,
    points: int = 600,
) -> complex:
    r"""Share of an endless mirror's wave that a rectangle reflects to a point.

    The Kirchhoff integral of the rectangle, :math:`(jk/4\pi)\int (\cos\theta_1+\cos\theta_2)
    e^{-jk(r_1+r_2)}/(r_1r_2)\,\mathrm dA`, over :math:`e^{-jkL}/L` of the image, by Gauss's
    quadrature with ``points`` along each side.

    Parameters
    ----------
    rectangle : centre and both half sides, m, ``(xyz,)``
    transmitter, point : m, ``(xyz,)``, before the rectangle
    frequency : Hz
    """
    centre, u, v = rectangle
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    across = np.cross(u, v)
    normal = across / np.linalg.norm(across)
    node, weight = np.polynomial.legendre.leggauss(points)
    place = centre + node[:, None, None] * u + node[:, None] * v
    there, back = place - transmitter, point - place
    r1, r2 = np.linalg.norm(there, axis=-1), np.linalg.norm(back, axis=-1)
    facing = back @ normal / r2 - there @ normal / r1
    wave = facing * np.exp(-1j * k * (r1 + r2)) / (r1 * r2)
    total = np.sum(weight[:, None] * weight * wave) * np.linalg.norm(across)
    image = transmitter - 2 * ((transmitter - centre) @ normal) * normal
    length = np.linalg.norm(point - image)
    return complex(1j * k / (4 * np.pi) * total * length * np.exp(1j * k * length))
