"""References for diffraction: integrals over lit surfaces, slow and simple, without edges."""

from __future__ import annotations

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import polarisation_basis


def beside_obstacle(
    corners: FloatArray, transmitter: FloatArray, receiver: FloatArray, frequency: float
) -> complex:
    r"""Field behind absorbing triangles, over what it is without them.

    .. math:: \frac{U}{U_0} = 1 - \frac{j d}{\lambda} \iint \frac{\cos\alpha + \cos\beta}{2}\,
        \frac{e^{-jk(r_1+r_2-d)}}{r_1 r_2}\, dA

    Kirchhoff's integral (Born & Wolf §8.3) over the triangles, α and β being the angles of both
    legs with the normal on the receiver's side, by midpoints: triangles should be so small that
    the phase turns by less than about 1 rad on them. They should cover each line only once: of a
    body, they are those that the transmitter illuminates.

    Parameters
    ----------
    corners : m ``(face, corner, xyz)``
    transmitter, receiver : m, ``(xyz,)``
    frequency : Hz
    """
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    centroid, surface = _areas(corners, transmitter)
    d, r1 = _unit(centroid - transmitter)
    q, r2 = _unit(receiver - centroid)
    length = float(np.linalg.norm(receiver - transmitter))
    turn = np.exp(-1j * k * (r1 + r2 - length)) / (r1 * r2)
    slope = 0.5 * np.sum(surface * (d + q), axis=-1)
    return complex(1 - 1j * k * length / (2 * np.pi) * np.sum(slope * turn[:, 0]))


def beside_rectangle(
    low: tuple[float, float],
    high: tuple[float, float],
    depth: float,
    point: FloatArray,
    frequency: float,
) -> complex:
    """Field behind an absorbing rectangle across x, over what it is without it.

    The integral of `beside_obstacle` for a transmitter at the origin, by Gauss's quadrature with 40
    points on every 4 cm and 8 cm of both sides.

    Parameters
    ----------
    low, high : least and greatest y and z of the rectangle, m
    depth : its x, m
    point : m, ``(xyz,)``
    frequency : Hz
    """
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    (y, across), (z, upwards) = (
        _gauss(a, b, round((b - a) / step))
        for a, b, step in zip(low, high, (0.04, 0.08), strict=True)
    )
    place = np.stack(np.broadcast_arrays(depth, y[:, None], z), axis=-1)
    d, r1 = _unit(place)
    q, r2 = _unit(point - place)
    length = float(np.linalg.norm(point))
    wave = 0.5 * (d[..., 0] + q[..., 0]) * np.exp(-1j * k * (r1 + r2 - length))[..., 0]
    total = across @ (wave / (r1 * r2)[..., 0]) @ upwards
    return complex(1 - 1j * k * length / (2 * np.pi) * total)


def _gauss(low: float, high: float, panels: int) -> tuple[FloatArray, FloatArray]:
    """Places and weights of 40 points on each of ``panels`` equal parts."""
    node, weight = np.polynomial.legendre.leggauss(40)
    end = np.linspace(low, high, panels + 1)
    half = 0.5 * np.diff(end)[:, None]
    return (end[:-1, None] + half * (1 + node)).ravel(), (half * weight).ravel()


def beside_conductor(
    corners: FloatArray, transmitter: FloatArray, receiver: FloatArray, frequency: float
) -> ComplexArray:
    r"""Transfer ``(receiving, transmitting)`` past lit triangles of metal.

    The sum of the unobstructed field and of the field that the currents :math:`J = 2 n\times H` of
    the lit side radiate forwards, with no test of whether they face the receiver: near-field
    physical optics as in `polychirp.channel.physical_optics.paths`, by midpoints. Parameters as for
    `beside_obstacle`.
    """
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    centroid, surface = _areas(corners, transmitter)
    d, r1 = _unit(centroid - transmitter)
    q, r2 = _unit(receiver - centroid)
    ahead, length = _unit(receiver - transmitter)
    straight = polarisation_basis(-ahead) @ polarisation_basis(ahead).T
    total = np.asarray(straight * np.exp(-1j * k * length) / (2 * k * length), dtype=np.complex128)
    common = -1j / (8 * np.pi) * np.exp(-1j * k * (r1 + r2)) / (r1 * r2)
    sent, received = polarisation_basis(d), polarisation_basis(-q)
    for t in range(2):
        # the surface points away from the transmitter, the normal of a lit side towards it
        current = -2 * np.cross(surface, np.cross(d, sent[:, t]))
        for x in range(2):
            total[x, t] += np.sum(common[:, 0] * np.sum(current * received[:, x], axis=-1))
    return total


def _areas(corners: FloatArray, transmitter: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centroids, and areas times the normal that points away from the transmitter."""
    centroid = corners.mean(axis=1)
    surface = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    away = np.sum(surface * (centroid - transmitter), axis=-1, keepdims=True)
    return centroid, np.asarray(np.where(away > 0, surface, -surface))


def _unit(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / length, length
