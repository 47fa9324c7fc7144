"""Reference for waves over two conductors, one after the other: quadrature in two steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import polarisation_basis

POINTS_AT_A_TIME = 1 << 21
"""Number of pairs of points whose waves are computed at a time. Chosen to limit the memory."""


class Rectangle(NamedTuple):
    """A conductor over a rectangle: centre and both half sides, m ``(xyz,)``.

    u × v is its outer normal in the middle. ``bend`` is its curvature along u and v, 1/m: the
    surface falls below the rectangle by half of it times the square of the distance.
    """

    centre: FloatArray
    u: FloatArray
    v: FloatArray
    bend: tuple[float, float] = (0.0, 0.0)

    @property
    def normal(self) -> FloatArray:
        """Unit vector in the middle, ``(xyz,)``."""
        across = np.cross(self.u, self.v)
        return np.asarray(across / np.linalg.norm(across))

    def at(self, a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Points, m, and normals at (a, b) half sides, ``(point, xyz)``; area elements, m²."""
        sizes = [float(np.linalg.norm(half)) for half in (self.u, self.v)]
        x, y = sizes[0] * a, sizes[1] * b
        depth = 0.5 * (self.bend[0] * x**2 + self.bend[1] * y**2)
        point = self.centre + a[:, None] * self.u + b[:, None] * self.v
        slope = (self.bend[0] * x / sizes[0])[:, None] * self.u
        slope = slope + (self.bend[1] * y / sizes[1])[:, None] * self.v
        normal, stretch = _unit(self.normal + slope)
        area = sizes[0] * sizes[1] * stretch[:, 0]
        return point - depth[:, None] * self.normal, normal, area


def scattered_twice(
    first: Rectangle,
    last: Rectangle,
    transmitter: FloatArray,
    receiver: FloatArray,
    frequency: float,
    *,
    points_per_turn: float = 2.5,
) -> ComplexArray:
    r"""Transfer ``(receiving, transmitting)`` over the first conductor, then over the last.

    The transmitter's wave induces :math:`J_1 = 2n_1\times H` on the first rectangle. These
    currents, not rays, radiate to every point of the last one,

    .. math:: H = -\frac{jk}{4\pi} \iint \frac{e^{-jkr}}{r}\; q \times (J_1 - (J_1\cdot q)\,q)
        \,\mathrm dA

    with q the direction from the point of the current and r its distance, and induce
    :math:`J_2 = 2n_2\times H` there, which radiates to the receiver. Neither rays nor a shadow of
    one rectangle on the other are assumed; a point radiates only to points that it faces. Wrong
    are only terms of 1/kr, the currents of edges, and what returns to the first rectangle.

    Parameters
    ----------
    transmitter, receiver : m, ``(xyz,)``
    frequency : Hz
    points_per_turn : of the quadratures, per 2π of the fastest phase along a side
    """
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    start, upright, area = _points(first, transmitter, last.centre, k, points_per_turn)
    end, end_upright, end_area = _points(last, first.centre, receiver, k, points_per_turn)
    d, r1 = _unit(start - transmitter)
    sent = polarisation_basis(d)
    lit = (np.sum(d * upright, axis=-1) < 0) * area * np.exp(-1j * k * r1[:, 0]) / r1[:, 0]
    # one row per polarisation, of vectors at all points
    current = np.stack(
        [lit[:, None] * 2 * np.cross(upright, np.cross(d, sent[:, t])) for t in range(2)]
    )
    q, r2 = _unit(receiver - end)
    seen = polarisation_basis(-q)
    leaves = (
        (np.sum(q * end_upright, axis=-1) > 0) * end_area * np.exp(-1j * k * r2[:, 0]) / r2[:, 0]
    )
    total = np.zeros((2, 2), dtype=np.complex128)
    step = max(1, POINTS_AT_A_TIME // len(start))
    for begin in range(0, len(end), step):
        some = slice(begin, begin + step)
        field = _magnetic_fields(start, upright, current, end[some], end_upright[some], k)
        for t in range(2):
            induced = 2 * np.cross(end_upright[some], field[t])
            for x in range(2):
                received = np.sum(induced * seen[some, x], axis=-1)
                total[x, t] += np.sum(leaves[some] * received)
    return np.asarray(-1j / (8 * np.pi) * total)


def _magnetic_fields(
    start: FloatArray,
    upright: FloatArray,
    current: ComplexArray,
    end: FloatArray,
    end_upright: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """H at points of the last rectangle, ``(polarisation, point, xyz)``.

    q × (J − (J·q)q) is q × J, so that every component needs only sums of J times q times the wave.
    """
    way = end[:, None] - start
    r = np.sqrt(np.sum(way**2, axis=-1))
    faces = np.einsum("epx,px->ep", way, upright) > 0
    faces &= np.einsum("epx,ex->ep", way, end_upright) < 0
    wave = -1j * wavenumber / (4 * np.pi) * faces * np.exp(-1j * wavenumber * r) / r**2
    found = np.zeros((2, len(end), 3), dtype=np.complex128)
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for t in range(2):
            found[t, :, axis] = (wave * way[..., b]) @ current[t, :, c]
            found[t, :, axis] -= (wave * way[..., c]) @ current[t, :, b]
    return found


def _points(
    rectangle: Rectangle,
    before: FloatArray,
    after: FloatArray,
    wavenumber: float,
    points_per_turn: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gauss points, m, and normals, ``(point, xyz)``, and areas, m² ``(point,)``."""
    nodes = []
    for half, bend in zip((rectangle.u, rectangle.v), rectangle.bend, strict=True):
        size = float(np.linalg.norm(half))
        slope = max(
            abs(float((_unit(at - before)[0] + _unit(at - after)[0]) @ half)) / size
            for at in rectangle.centre + np.array([-1.0, 0.0, 1.0])[:, None] * half
        )
        # other points of the second rectangle are seen at other angles: half a turn per wavelength
        turns = 2 * size * (slope + 2 * abs(bend) * size + 0.15) * wavenumber / (2 * np.pi)
        nodes.append(np.polynomial.legendre.leggauss(int(24 + points_per_turn * turns)))
    (a, wa), (b, wb) = nodes
    across, along = np.meshgrid(a, b, indexing="ij")
    point, normal, area = rectangle.at(across.reshape(-1), along.reshape(-1))
    return point, normal, area * np.outer(wa, wb).reshape(-1)


def _unit(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / length, length
