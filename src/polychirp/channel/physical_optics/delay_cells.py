"""Gathering what facets scatter from one view to another in smooth cells of path length."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import dot, row
from polychirp.channel.materials.reflection_table import ReflectionTable
from polychirp.channel.physical_optics.corner_terms import (
    PER_CELL,
    Batch,
    batch,
    expand,
    fill,
    next_shared,
    next_worthy,
    two_cells,
)
from polychirp.channel.physical_optics.kernels import (
    CELL,
    GAMMA,
    PLACE,
    Faces,
    Rows,
    Vector,
    facet_terms,
)

NUM_MOMENTS: Final = 12
"""Of a cell: transfer (4); V–V-weighted excess length (1), two directions (3 + 3), rate² (1)."""

WIDTH: Final = 2 * NUM_MOMENTS
"""Numbers of a term and of a cell, while they are gathered: the transfer's real and imaginary
parts (4 + 4), and the V–V part's times the eight that it weighs (8 + 8)."""

QUEUE: Final = 32
"""Terms that wait to be added to their cells: what was just written in parts is read as a whole
only with a delay."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _response(
    first: NDArray[np.complex64],
    a: int,
    second: NDArray[np.complex64],
    b: int,
    scale: float,
    out: ComplexArray,
) -> None:
    r"""F ``(receiving, transmitting)`` of a facet, times ``scale``, from rows of two `Rows.wave`.

    The mean of both ways round, so reciprocal. With φ by which one plane of incidence is turned
    from the other, it is between the fields' parts across (s) and in (p) their planes

    .. math::
        F = \frac12 \begin{pmatrix}
            -a\,(\Gamma_{s1} + \Gamma_{s2}) & b\,(\Gamma_{p2} - \Gamma_{s1}) \\
            b\,(\Gamma_{s2} - \Gamma_{p1}) & a\,(\Gamma_{p1} + \Gamma_{p2})
        \end{pmatrix}, \quad
        a = (\cos\theta_1 + \cos\theta_2) \cos\varphi, \quad
        b = (1 + \cos\theta_1 \cos\theta_2) \sin\varphi

    which are J and M of `facets` written out.
    """
    cosine1, cosine2 = first[a, PLACE, 0].real, second[b, PLACE, 0].real
    turn = first[a, PLACE, 1].conjugate() * second[b, PLACE, 1]
    alike = 0.5 * scale * (cosine1 + cosine2) * turn.real
    unlike = 0.5 * scale * (1.0 + cosine1 * cosine2) * turn.imag
    s1, p1, s2, p2 = (
        first[a, GAMMA, 0], first[a, GAMMA, 1], second[b, GAMMA, 0], second[b, GAMMA, 1],
    )  # fmt: skip
    ss, pp = -alike * (s1 + s2), alike * (p1 + p2)
    sp, ps = unlike * (p2 - s1), unlike * (s2 - p1)
    for t in range(2):
        s = first[a, t, 0] * ss + first[a, t, 1] * ps
        p = first[a, t, 0] * sp + first[a, t, 1] * pp
        for r in range(2):
            out[2 * r + t] = s * second[b, r, 0] + p * second[b, r, 1]


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def gather_cells(
    faces: Faces,
    media: ReflectionTable,
    first: Rows,
    second: Rows,
    task: IntArray,
    first_cell: IntArray,
    worth: BoolArray,
    slide: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """Moments ``(task, cell, moment)`` of all facets that both views of a task see.

    ``task`` ``(task, 2)`` holds the views of transmitter and receiver, among those of ``first``
    and ``second``; cell j of a task is centred at a path length of ``(first_cell + j) · CELL``,
    and stays empty where it is not ``worth`` ``(task, cell)`` the work. ``slide`` ``(task, view,
    xyz)`` is how the body moves against both images, m/s.
    """
    out = np.zeros((worth.shape[0], worth.shape[1], NUM_MOMENTS), dtype=np.complex128)
    for k in prange(task.shape[0]):
        # a term on the last cell has its second part behind it
        cells = np.zeros((worth.shape[1] + 1) * WIDTH)
        starts = first.start[task[k, 0]], second.start[task[k, 1]]
        ends = first.start[task[k, 0] + 1], second.start[task[k, 1] + 1]
        worthy = next_worthy(worth[k])
        room = batch()
        place = next_shared(first.face, second.face, starts[0], starts[1], ends)
        while place[0] < ends[0]:
            count, a, b = fill(room, faces.area, first, second, place, ends, worthy, first_cell[k])
            place = a, b
            expand(room, count, wavenumber, first_cell[k])
            _gather_batch(
                room,
                count,
                faces,
                media,
                (first, second),
                first_cell[k],
                worthy,
                slide[k],
                wavenumber,
                cells,
            )
        _take_moments(cells, worth[k], out[k])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _gather_batch(
    room: Batch,
    count: int,
    faces: Faces,
    media: ReflectionTable,
    rows: tuple[Rows, Rows],
    first_cell: int,
    worthy: IntArray,
    slide: FloatArray,
    wavenumber: float,
    cells: FloatArray,
) -> None:
    """Add what a batch of facets scatters to ``cells``, of `WIDTH` numbers each."""
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    response = np.empty(4, dtype=np.complex128)
    into, share = np.empty(QUEUE + 3, dtype=np.int64), np.empty(QUEUE + 3)
    queue = np.empty((QUEUE + 3) * WIDTH)
    first, second = rows
    slides = row(slide, 0), row(slide, 1)
    waiting, nearest = 0, first_cell * CELL
    for i in range(count):
        a, b, is_plain = room.row[0, i], room.row[1, i], room.is_plain[i]
        f = first.face[a]
        phase = media.roughness[faces.medium[f]] * room.facing[i]
        scale = math.exp(-0.5 * phase * phase) if phase != 0.0 else 1.0
        _response(first.wave, a, second.wave, b, scale, response)
        ways = row(first.direction, a), row(second.direction, b)
        lengths = first.length[a], second.length[b]
        p, q, r = room.length[0, i], room.length[1, i], room.length[2, i]
        phases, terms = (wavenumber * p, wavenumber * q, wavenumber * r), 3
        if not is_plain:
            terms = facet_terms(phases, weight, place)
        for c in range(terms):
            if is_plain:
                offset = faces.corner[f, c, 0], faces.corner[f, c, 1], faces.corner[f, c, 2]
                excess = room.length[c, i] - nearest
                term = complex(room.term[0, c, i], room.term[1, c, i])
            else:
                offset = _blend(place[c], faces.corner[f])
                excess = place[c, 0] * p + place[c, 1] * q + place[c, 2] * r - nearest
                term = room.weight[i] * weight[c]
            cell, later = two_cells(excess * PER_CELL)
            if worthy[cell] > cell + 1:
                continue
            into[waiting], share[waiting] = cell * WIDTH, later
            amplitude = complex(term.imag, -term.real)
            _note(queue, waiting, amplitude, response, excess, ways, lengths, offset, slides)
            waiting += 1
        if waiting >= QUEUE:
            _add(waiting, into, share, queue, WIDTH, cells)
            waiting = 0
    _add(waiting, into, share, queue, WIDTH, cells)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _note(
    queue: FloatArray,
    number: int,
    amplitude: complex,
    response: ComplexArray,
    excess: float,
    ways: tuple[Vector, Vector],
    lengths: tuple[float, float],
    offset: Vector,
    slides: tuple[Vector, Vector],
) -> None:
    """Write one term's `WIDTH` numbers; ``offset`` m is where it sits from the centroid."""
    out = _direction_to(ways[0], lengths[0], offset)
    back = _direction_to(ways[1], lengths[1], offset)
    rate = dot(out, slides[0]) + dot(back, slides[1])
    o = number * WIDTH
    for j in range(4):
        part = amplitude * response[j]
        queue[o + j], queue[o + 4 + j] = part.real, part.imag
    weighed = excess, out[0], out[1], out[2], back[0], back[1], back[2], rate * rate
    real, imaginary = queue[o], queue[o + 4]
    for j in range(8):
        queue[o + 8 + j], queue[o + 16 + j] = real * weighed[j], imaginary * weighed[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _add(
    count: int, into: IntArray, share: FloatArray, queue: FloatArray, width: int, cells: FloatArray
) -> None:
    """Add terms to the two cells from ``into`` on; ``width`` is an argument to be no constant.

    Short loops of known length are written out, one number at a time.
    """
    for i in range(count):
        more, start = share[i], into[i]
        less = 1.0 - more
        low, high = cells[start : start + width], cells[start + width : start + 2 * width]
        term = queue[i * width : (i + 1) * width]
        for j in range(width):
            low[j] += less * term[j]
            high[j] += more * term[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _take_moments(cells: FloatArray, worth: BoolArray, out: ComplexArray) -> None:
    """Fill ``out`` ``(cell, moment)`` with what was gathered in cells that are worth it."""
    for cell in range(worth.size):
        if not worth[cell]:
            continue
        o = cell * WIDTH
        for j in range(4):
            out[cell, j] = complex(cells[o + j], cells[o + 4 + j])
            out[cell, 4 + j] = complex(cells[o + 8 + j], cells[o + 16 + j])
            out[cell, 8 + j] = complex(cells[o + 12 + j], cells[o + 20 + j])
        out[cell, 4] -= cell * CELL * out[cell, 0]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _blend(place: FloatArray, corner: FloatArray) -> Vector:
    """A point of a triangle, m from its centroid, from its barycentric coordinates."""
    p, q, r = place[0], place[1], place[2]
    return (
        p * corner[0, 0] + q * corner[1, 0] + r * corner[2, 0],
        p * corner[0, 1] + q * corner[1, 1] + r * corner[2, 1],
        p * corner[0, 2] + q * corner[1, 2] + r * corner[2, 2],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _direction_to(direction: Vector, length: float, offset: Vector) -> Vector:
    """Unit direction to a point a little off the end of a leg."""
    scale = 1.0 / (length + dot(direction, offset))
    return (
        scale * (length * direction[0] + offset[0]),
        scale * (length * direction[1] + offset[1]),
        scale * (length * direction[2] + offset[2]),
    )
