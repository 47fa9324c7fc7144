"""Vectors of three numbers in compiled code: tuples, which need no memory allocation."""

from polychirp.axes import FloatArray
from polychirp.jit import inlined

Vector = tuple[float, float, float]


@inlined
def dot(a: Vector, b: Vector) -> float:
    """Scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product of two vectors."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined
def plus(a: Vector, b: Vector, factor: float) -> Vector:
    """The sum a + ``factor`` b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@inlined
def vector(a: FloatArray) -> Vector:
    """The vector in an array ``(xyz,)``."""
    return a[0], a[1], a[2]


@inlined
def row(a: FloatArray, i: int) -> Vector:
    """The vector in row i of an array ``(row, xyz)``."""
    return a[i, 0], a[i, 1], a[i, 2]


@inlined
def vector_at(a: FloatArray, i: int, k: int) -> Vector:
    """The vector in columns k, k + 1 and k + 2 of row i of a table."""
    return a[i, k], a[i, k + 1], a[i, k + 2]
