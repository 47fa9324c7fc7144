"""Wave over two metal spheres by stationary phase: a reference that knows no rays."""

from typing import NamedTuple

import numpy as np

from polychirp.axes import FloatArray


class Spheres(NamedTuple):
    """Two spheres in the order of the reflections: centres m ``(sphere, xyz)`` and radii, m.

    A sphere with a negative radius is hollow: it reflects on its inner side, opposite to the wave.
    """

    centre: FloatArray
    radius: FloatArray


def length_and_gain(
    spheres: Spheres, source: FloatArray, sink: FloatArray
) -> tuple[float, complex]:
    """Length, m, of the stationary way over both spheres, and its amplitude over that at 1 m.

    Every point of the first sphere lights every point of the second. Each reflection is Kirchhoff's
    integral of a metal surface, twice jk cos θ e^{−jkr}/4πr, and both are taken by stationary
    phase. The wavenumber cancels: the result is that of geometrical optics. Each direction in which
    the length is greatest, not least, advances the phase by π/2.
    """
    normals = [
        _unit(_unit(source - spheres.centre[0]) + _unit(spheres.centre[1] - spheres.centre[0])),
        _unit(_unit(sink - spheres.centre[1]) + _unit(spheres.centre[0] - spheres.centre[1])),
    ]
    for _ in range(40):
        slope, bend = _derivatives(spheres, source, sink, normals)
        step = -np.linalg.solve(bend, slope)
        step *= 0.3 / max(0.3, np.linalg.norm(step))
        normals = [_shifted(n, step[2 * i : 2 * i + 2]) for i, n in enumerate(normals)]
        if np.linalg.norm(step) < 1e-11:
            break
    legs = _legs(spheres, source, sink, normals)
    length = [float(np.linalg.norm(leg)) for leg in legs]
    cosine = [float(-_unit(legs[i]) @ normals[i]) for i in range(2)]
    _, bend = _derivatives(spheres, source, sink, normals)
    area = float(np.prod(spheres.radius**2))
    gain = area * np.prod(cosine) / (np.prod(length) * np.sqrt(abs(np.linalg.det(bend))))
    return sum(length), complex(gain * 1j ** np.sum(np.linalg.eigvalsh(bend) < 0))


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))


def _shifted(normal: FloatArray, step: FloatArray) -> FloatArray:
    """A unit vector moved by two small angles."""
    side = _unit(np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))]))
    return _unit(normal + step[0] * side + step[1] * np.cross(normal, side))


def _legs(
    spheres: Spheres, source: FloatArray, sink: FloatArray, normals: list[FloatArray]
) -> list[FloatArray]:
    first, last = (spheres.centre[i] + spheres.radius[i] * normals[i] for i in range(2))
    return [first - source, last - first, sink - last]


def _derivatives(
    spheres: Spheres, source: FloatArray, sink: FloatArray, normals: list[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """First and second derivatives of the length by the four angles, by differences."""
    h = 1e-4

    def length(angles: FloatArray) -> float:
        moved = [_shifted(n, angles[2 * i : 2 * i + 2]) for i, n in enumerate(normals)]
        return sum(float(np.linalg.norm(leg)) for leg in _legs(spheres, source, sink, moved))

    step = h * np.eye(4)
    slope = np.array([(length(s) - length(-s)) / (2 * h) for s in step])
    bend = np.array(
        [
            [
                (length(a + b) - length(a - b) - length(b - a) + length(-a - b)) / (4 * h * h)
                for b in step
            ]
            for a in step
        ]
    )
    return slope, bend
