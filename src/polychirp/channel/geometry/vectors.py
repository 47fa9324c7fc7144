"""Vectors of three numbers in the kernels: tuples, which cost no memory."""

from __future__ import annotations

from numba import njit

from polychirp.axes import FloatArray
from polychirp.channel.geometry.bvh import Vector


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def vector(a: FloatArray) -> Vector:
    """The vector in an array ``(xyz,)``."""
    return a[0], a[1], a[2]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def row(a: FloatArray, i: int) -> Vector:
    """The vector in row i of an array ``(row, xyz)``."""
    return a[i, 0], a[i, 1], a[i, 2]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def vector_at(a: FloatArray, i: int, k: int) -> Vector:
    """The vector in row i of a table, from its column k on."""
    return a[i, k], a[i, k + 1], a[i, k + 2]
