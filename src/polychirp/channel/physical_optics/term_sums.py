"""Terms of paths over facets: their scattering matrices and moments, and sums of them in cells."""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, dot
from polychirp.channel.physical_optics.kernels import INCIDENCE, REFLECTION
from polychirp.jit import inlined, inner

TRANSFER, EXCESS, OUTWARD, RETURN, SQUARED_RATE = slice(0, 4), 4, slice(5, 8), slice(8, 11), 11
"""Columns of the moments of a cell. `TRANSFER` is the sum of the transfer matrices, four entries.
The other moments are sums of V–V transfers, each multiplied by a quantity of its path: `EXCESS` by
the length beyond the cell's centre, m; `OUTWARD` and `RETURN` by the unit vectors from the first
and from the second view; `SQUARED_RATE` by the squared rate of the length, m²/s²."""

NUM_MOMENTS: Final = 12

TERM_WIDTH: Final = 2 * NUM_MOMENTS
"""Real numbers of a term, and of a cell while terms are added: real parts (4) and imaginary parts
(4) of `TRANSFER`, then real parts (8) and imaginary parts (8) of the other moments."""


class FacetLegs(NamedTuple):
    """Two legs of a path over one facet, one from each view.

    ``directions`` are unit vectors from the views to the facet's centroid, ``lengths`` m are their
    distances from it, ``velocities`` m/s are those of the facet's body relative to the views.
    """

    directions: tuple[Vector, Vector]
    lengths: tuple[float, float]
    velocities: tuple[Vector, Vector]


@inlined
def coherent_share(roughness: float, facing: float) -> float:
    """Share of a facet's amplitude that roughness (rms height times wavenumber) leaves coherent.

    ``facing`` is the sum of the cosines of both angles of incidence.
    """
    phase = roughness * facing
    return math.exp(-0.5 * phase * phase) if phase != 0.0 else 1.0


@inlined
def scattering_matrix(
    first: NDArray[np.complex64],
    a: int,
    second: NDArray[np.complex64],
    b: int,
    scale: float,
    out: ComplexArray,
) -> None:
    r"""F ``(receiving, transmitting)`` of a facet, times ``scale``.

    ``first`` and ``second`` are two views' `LitFacets.wave`, a and b the facet's rows in them.
    F is the mean over both directions of propagation, which makes it reciprocal. If one plane of
    incidence is turned by φ from the other, F relates the fields' components normal to (s) and in
    (p) the planes of incidence by

    .. math::
        F = \frac12 \begin{pmatrix}
            -a\,(\Gamma_{s1} + \Gamma_{s2}) & b\,(\Gamma_{p2} - \Gamma_{s1}) \\
            b\,(\Gamma_{s2} - \Gamma_{p1}) & a\,(\Gamma_{p1} + \Gamma_{p2})
        \end{pmatrix}, \quad
        a = (\cos\theta_1 + \cos\theta_2) \cos\varphi, \quad
        b = (1 + \cos\theta_1 \cos\theta_2) \sin\varphi

    which are J and M of `paths` written out.
    """
    cosine1, cosine2 = first[a, INCIDENCE, 0].real, second[b, INCIDENCE, 0].real
    turn = first[a, INCIDENCE, 1].conjugate() * second[b, INCIDENCE, 1]
    alike = 0.5 * scale * (cosine1 + cosine2) * turn.real
    unlike = 0.5 * scale * (1.0 + cosine1 * cosine2) * turn.imag
    s1, p1 = first[a, REFLECTION, 0], first[a, REFLECTION, 1]
    s2, p2 = second[b, REFLECTION, 0], second[b, REFLECTION, 1]
    ss, pp = -alike * (s1 + s2), alike * (p1 + p2)
    sp, ps = unlike * (p2 - s1), unlike * (s2 - p1)
    for t in range(2):
        s = first[a, t, 0] * ss + first[a, t, 1] * ps
        p = first[a, t, 0] * sp + first[a, t, 1] * pp
        for r in range(2):
            out[2 * r + t] = s * second[b, r, 0] + p * second[b, r, 1]


@inlined
def queue_term(
    queue: FloatArray,
    number: int,
    amplitude: complex,
    matrix: ComplexArray,
    excess: float,
    legs: FacetLegs,
    offset: Vector,
) -> None:
    """Write one term's numbers to row ``number`` of a queue; ``offset`` m: from the centroid."""
    out = _direction_to(legs.directions[0], legs.lengths[0], offset)
    back = _direction_to(legs.directions[1], legs.lengths[1], offset)
    rate = dot(out, legs.velocities[0]) + dot(back, legs.velocities[1])
    o = number * TERM_WIDTH
    for j in range(4):
        part = amplitude * matrix[j]
        queue[o + j], queue[o + 4 + j] = part.real, part.imag
    weighed = excess, out[0], out[1], out[2], back[0], back[1], back[2], rate * rate
    real, imaginary = queue[o], queue[o + 4]
    for j in range(8):
        queue[o + 8 + j], queue[o + 16 + j] = real * weighed[j], imaginary * weighed[j]


@inner
def add_queue(
    count: int, into: IntArray, share: FloatArray, queue: FloatArray, width: int, cells: FloatArray
) -> None:
    """Add each term to the cell that starts at ``into`` and, with weight ``share``, to the next.

    ``width`` is `TERM_WIDTH`. It is an argument because the compiler unrolls a short loop of
    known length into scalar additions, and so does not add several numbers in one instruction.
    """
    for i in range(count):
        more, start = share[i], into[i]
        less = 1.0 - more
        low, high = cells[start : start + width], cells[start + width : start + 2 * width]
        term = queue[i * width : (i + 1) * width]
        for j in range(width):
            low[j] += less * term[j]
            high[j] += more * term[j]


@inlined
def _direction_to(direction: Vector, length: float, offset: Vector) -> Vector:
    """Unit vector, to first order, to a point that is ``offset`` (m) from the end of a leg."""
    scale = 1.0 / (length + dot(direction, offset))
    return (
        scale * (length * direction[0] + offset[0]),
        scale * (length * direction[1] + offset[1]),
        scale * (length * direction[2] + offset[2]),
    )
