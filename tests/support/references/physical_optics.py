"""Reference for the compiled physical optics: one formula for all facets, slow and simple."""

from __future__ import annotations

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.materials.fresnel import reflection
from polychirp.channel.materials.library import known_materials
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


def scattered_by_rectangle(
    rectangle: tuple[FloatArray, FloatArray, FloatArray],
    material: Material,
    transmitter: FloatArray,
    receiver: FloatArray,
    frequency: float,
    *,
    points_per_turn: float = 3.0,
) -> ComplexArray:
    r"""Transfer ``(receiving, transmitting)`` of a flat rectangle, by quadrature without facets.

    Gauss-Legendre quadrature in both directions, with the exact distances, directions, angles of
    incidence and coefficients of every point: nothing is linear over a facet.

    Parameters
    ----------
    rectangle : centre and both half sides, m ``(xyz,)``; the normal is along their vector product
    points_per_turn : per 2π of the fastest phase along a side
    """
    centre, u, v = rectangle
    wavenumber = 2 * np.pi * frequency / SPEED_OF_LIGHT
    nodes = []
    for half in (u, v):
        ends = centre + np.array([-1.0, 1.0])[:, None] * half
        middle = _unit(half)[0]
        slope = max(
            abs(float((_unit(end - place)[0] @ middle) + (_unit(end - other)[0] @ middle)))
            for place, other in ((transmitter, receiver),)
            for end in (*ends, centre)
        )
        turns = 2 * wavenumber * float(np.linalg.norm(half)) * slope / (2 * np.pi)
        nodes.append(np.polynomial.legendre.leggauss(int(60 + points_per_turn * turns)))
    (a, wa), (b, wb) = nodes
    area = 4 * np.linalg.norm(np.cross(u, v))
    n = _unit(np.cross(u, v))[0]
    total = np.zeros((2, 2), dtype=np.complex128)
    for one, weight in zip(a, wa, strict=True):  # row by row: little memory
        point = centre + one * u + b[:, None] * v
        weights = 0.25 * area * weight * wb + 0j
        there = _radiated(point, n, weights, material, transmitter, receiver, frequency)
        back = _radiated(point, n, weights, material, receiver, transmitter, frequency)
        total += 0.5 * (there + back.T)
    return total


def metal_rectangle_by_cells(
    rectangle: tuple[FloatArray, FloatArray, FloatArray],
    transmitter: FloatArray,
    receiver: FloatArray,
    frequency: float,
) -> ComplexArray:
    r"""Transfer ``(receiving, transmitting)`` of a rectangle of metal, by small cells.

    As `scattered_by_rectangle`, but the phase is linear over a cell, of which the second-order part
    is at most 0.03 rad at the nearest place: for plates of many hundred wavelengths.
    """
    centre, *halves = rectangle
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    sizes = [float(np.linalg.norm(half)) for half in halves]
    units = [half / size for half, size in zip(halves, sizes, strict=True)]
    nearest = min(
        np.linalg.norm(
            place - centre
            - sum(
                np.clip((place - centre) @ unit, -size, size) * unit
                for unit, size in zip(units, sizes, strict=True)
            )
        )
        for place in (transmitter, receiver)
    )  # fmt: skip
    cell = np.sqrt(0.04 * np.pi / k * nearest)
    lines = []
    for size in sizes:
        count = int(np.ceil(2 * size / cell))
        lines.append(size * ((2 * np.arange(count) + 1) / count - 1))
    u, v = (line.ravel() for line in np.meshgrid(*lines, indexing="ij"))
    point = centre + u[:, None] * units[0] + v[:, None] * units[1]
    d, q = _unit(point - transmitter)[0], _unit(receiver - point)[0]
    weights = np.ones(len(point), dtype=np.complex128)
    for unit, size, line in zip(units, sizes, lines, strict=True):
        width = 2 * size / len(line)
        weights *= width * np.sinc(k * ((d - q) @ unit) * width / (2 * np.pi))
    normal, metal = np.cross(*units), known_materials()["metal"]
    there = _radiated(point, normal, weights, metal, transmitter, receiver, frequency)
    back = _radiated(point, normal, weights, metal, receiver, transmitter, frequency)
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
    way = _unit(centroid - transmitter)[0] + _unit(centroid - receiver)[0]
    p = wavenumber * np.einsum("fx,fcx->fc", way, corners - centroid[:, None])
    weights = 0.5 * double[:, 0] * _triangle_mean(p)
    n = cross / double
    return _radiated(centroid, n, weights, material, transmitter, receiver, frequency)


def _radiated(
    point: FloatArray,
    n: FloatArray,
    weights: ComplexArray,
    material: Material,
    transmitter: FloatArray,
    receiver: FloatArray,
    frequency: float,
) -> ComplexArray:
    """Sum over currents at points of normals n, ``(point, xyz)``, times areas ``weights``, m²."""
    wavenumber = 2 * np.pi * frequency / SPEED_OF_LIGHT
    n = np.broadcast_to(n, point.shape)
    d, r1 = _unit(point - transmitter)
    q, r2 = _unit(receiver - point)
    side = np.cross(d, n)
    size = np.linalg.norm(side, axis=-1, keepdims=True)
    spare = np.cross(n, np.eye(3)[np.argmin(np.abs(n[0]))])
    s = np.where(size > 1e-9, side / np.maximum(size, 1e-9), _unit(spare)[0])
    r = d - 2 * np.sum(n * d, axis=-1, keepdims=True) * n
    gamma_s, gamma_p = (g[:, None] for g in reflection(material, -np.sum(n * d, -1), frequency))
    sent, received = polarisation_basis(d), polarisation_basis(-q)
    common = -1j / (8 * np.pi) * np.exp(-1j * wavenumber * (r1 + r2)) / (r1 * r2)
    weight = common[:, 0] * weights
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
