"""Reference for the compiled physical optics: one formula for all facets, slow and simple."""

from __future__ import annotations

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.materials.fresnel import reflection
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import polarisation_basis
from polychirp.model.material import Material


def scattered(
    corners: FloatArray,
    material: Material,
    transmitter: FloatArray,
    receiver: FloatArray,
    frequency: float,
) -> ComplexArray:
    r"""Transfer ``(receiving, transmitting)`` of triangles that are all illuminated and seen.

    The sum over facets that `polychirp.channel.physical_optics.paths` states, at one frequency and
    with its phase: :math:`\sum a`, with F averaged over both directions of propagation.

    Parameters
    ----------
    corners : m ``(face, corner, xyz)``
    transmitter, receiver : m, ``(xyz,)``
    frequency : Hz
    """
    there = _one_way(corners, material, transmitter, receiver, frequency)
    back = _one_way(corners, material, receiver, transmitter, frequency)
    return np.asarray(0.5 * (there + back.T))


def scalar_scattered(
    corners: FloatArray, transmitter: FloatArray, receiver: FloatArray, frequency: float
) -> complex:
    r"""Scalar sum over illuminated and seen triangles by which `power_estimate` judges their echo.

    .. math:: \sum |F| \frac{A}{8\pi r_1 r_2} e^{-jk(r_1+r_2)} I, \quad
        |F|^2 = (\cos\theta_1 + \cos\theta_2)^2 + (n \cdot d_1 \times d_2)^2

    Parameters as for `scattered`.
    """
    wavenumber = 2 * np.pi * frequency / SPEED_OF_LIGHT
    centroid = corners.mean(axis=1)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.linalg.norm(cross, axis=-1)
    d1, r1 = _unit(centroid - transmitter)
    d2, r2 = _unit(centroid - receiver)
    n = cross / double[:, None]
    facing = np.hypot(np.sum((d1 + d2) * n, axis=-1), np.sum(np.cross(d1, d2) * n, axis=-1))
    p = wavenumber * np.einsum("fx,fcx->fc", d1 + d2, corners - centroid[:, None])
    way = (r1 + r2)[:, 0]
    weight = facing * 0.5 * double / (8 * np.pi * (r1 * r2)[:, 0])
    return complex(np.sum(weight * np.exp(-1j * wavenumber * way) * _triangle_mean(p)))


def _one_way(
    corners: FloatArray,
    material: Material,
    transmitter: FloatArray,
    receiver: FloatArray,
    frequency: float,
) -> ComplexArray:
    wavenumber = 2 * np.pi * frequency / SPEED_OF_LIGHT
    centroid = corners.mean(axis=1)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.linalg.norm(cross, axis=-1, keepdims=True)
    n = cross / double
    d, r1 = _unit(centroid - transmitter)
    q, r2 = _unit(receiver - centroid)
    side = np.cross(d, n)
    size = np.linalg.norm(side, axis=-1, keepdims=True)
    s = np.where(size > 1e-9, side / np.maximum(size, 1e-9), _unit(corners[:, 1] - centroid)[0])
    r = d - 2 * np.sum(n * d, axis=-1, keepdims=True) * n
    gamma_s, gamma_p = (g[:, None] for g in reflection(material, -np.sum(n * d, -1), frequency))
    sent, received = polarisation_basis(d), polarisation_basis(-q)
    p = wavenumber * np.einsum("fx,fcx->fc", d - q, corners - centroid[:, None])
    common = -1j / (8 * np.pi) * 0.5 * double * np.exp(-1j * wavenumber * (r1 + r2)) / (r1 * r2)
    weight = common[:, 0] * _triangle_mean(p)
    total = np.zeros((2, 2), dtype=np.complex128)
    for t in range(2):
        e = sent[:, t]
        along_s = np.sum(e * s, axis=-1, keepdims=True)
        along_p = np.sum(e * np.cross(d, s), axis=-1, keepdims=True)
        reflected = gamma_s * along_s * s + gamma_p * along_p * np.cross(r, s)
        current = np.cross(n, np.cross(d, e) + np.cross(r, reflected))
        magnetic = -np.cross(n, e + reflected)
        for x in range(2):
            w = received[:, x]
            f = np.sum(current * w, axis=-1) + np.sum(np.cross(magnetic, q) * w, axis=-1)
            total[x, t] = np.sum(weight * f)
    return total


def _unit(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / length, length


def _triangle_mean(phases: FloatArray) -> ComplexArray:
    """Mean of e^{−jp} over triangles, p linear: Gauss–Legendre in squares folded to triangles."""
    # the number of nodes follows the fastest phase
    spread = float(np.max(np.ptp(phases, axis=-1), initial=0.0))
    node, weight = np.polynomial.legendre.leggauss(8 + int(0.6 * spread))
    u, wu = 0.5 * (node + 1), 0.5 * weight
    total = np.zeros(len(phases), dtype=np.complex128)
    for a, wa in zip(u, wu, strict=True):
        for b, wb in zip(u, wu, strict=True):
            phase = phases[:, 0] * (1 - a) + a * (phases[:, 1] * (1 - b) + phases[:, 2] * b)
            total += wa * wb * 2 * a * np.exp(-1j * phase)
    return total
