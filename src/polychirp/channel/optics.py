"""Kernels of facet physical optics; `facets` says what they compute and why."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.blockers import CENTRE, MEDIUM, NORMAL, Blockers, is_beside
from polychirp.channel.occlusion import is_blocked
from polychirp.channel.reflection_table import ReflectionTable, looked_up
from polychirp.channel.vectors import cross, dot, row, vector, vector_at
from polychirp.channel.views import NEAR_BODIES, NEAR_PLATES, ViewTable, near_view
from polychirp.channel.world import SKIN

LIFT = 3e-3
"""m by which a shadow ray starts above its facet, so as not to meet it or its neighbours."""

CELL = 0.04
"""m of total path length: width of the smooth cells in which contributions are gathered."""

AWAY, HIDDEN, LIT = 0, 1, 2
"""A facet that is turned from a view; that turns to it, and is in a shadow; and is seen."""

SideArray = NDArray[np.int8]

NUM_MOMENTS = 12
"""Of a cell: transfer (4); V–V-weighted excess length (1), two directions (3 + 3), rate² (1)."""

V, H, GAMMA, PLACE = 0, 1, 2, 3
"""Rows of one facet's `Rows.wave`."""

Vector = tuple[float, float, float]
ComplexVector = tuple[complex, complex, complex]
Field = tuple[complex, complex]


class Faces(NamedTuple):
    """A `Surface`'s arrays as the kernels need them, ``(face, …)``."""

    centroid: FloatArray
    normal: FloatArray
    tangent: FloatArray
    corner: FloatArray
    area: FloatArray
    medium: IntArray

    def of(self, number: IntArray) -> Faces:
        """The faces of these numbers."""
        return Faces(
            self.centroid[number],
            self.normal[number],
            self.tangent[number],
            self.corner[number],
            self.area[number],
            self.medium[number],
        )


class Rows(NamedTuple):
    """Lit facets of several views, one view behind the other, ``(row, …)``.

    ``start`` ``(view + 1,)`` says where each view's rows begin; ``face``; ``direction`` from the
    image to the centroid, unit; ``length`` m; and ``wave`` ``(row, 4, 2)`` complex: in rows `V`
    and `H` the fields of waves that left so polarised, across and in the plane of incidence; in
    `GAMMA` (Γs, Γp) of the facet; in `PLACE` the angle's cosine, and the vector across the plane
    of incidence as a complex number in the facet's two tangents.
    """

    start: IntArray
    face: IntArray
    direction: FloatArray
    length: FloatArray
    wave: NDArray[np.complex64]

    @property
    def view(self) -> IntArray:
        """Number of every row's view, ``(row,)``."""
        return np.repeat(np.arange(len(self.start) - 1), np.diff(self.start))

    def only(self, kept: BoolArray) -> Rows:
        """Some of the rows, ``kept`` ``(row,)``."""
        before = np.concatenate([[0], np.cumsum(kept)])
        return Rows(
            before[self.start],
            self.face[kept],
            self.direction[kept],
            self.length[kept],
            self.wave[kept] if len(self.wave) else self.wave,
        )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _across(direction: Vector, normal: Vector, spare: Vector) -> Vector:
    """Unit vector across the plane of incidence; ``spare`` where that is not defined."""
    c = cross(direction, normal)
    size = math.sqrt(dot(c, c))
    if size < 1e-9:
        return spare
    return c[0] / size, c[1] / size, c[2] / size


@njit(cache=True, nogil=True, error_model="numpy")
def meet_mirror(centre: Vector, normal: Vector, image: Vector, point: Vector) -> Vector:
    """Where the line from an image to a point meets the plate."""
    gx, gy, gz = point[0] - image[0], point[1] - image[1], point[2] - image[2]
    above = dot(normal, (centre[0] - image[0], centre[1] - image[1], centre[2] - image[2]))
    t = above / dot(normal, (gx, gy, gz))
    return image[0] + t * gx, image[1] + t * gy, image[2] + t * gz


@njit(cache=True, nogil=True, error_model="numpy")
def _sees(
    views: ViewTable, blockers: Blockers, view: int, centroid: Vector, normal: Vector
) -> bool:
    """Whether nothing hides a facet that faces the view's image."""
    bodies, plates = near_view(views, view, NEAR_BODIES), near_view(views, view, NEAR_PLATES)
    source = row(views.source, view)
    lifted = (
        centroid[0] + LIFT * normal[0],
        centroid[1] + LIFT * normal[1],
        centroid[2] + LIFT * normal[2],
    )
    number, plate = views.plate[view], blockers.plate
    if number < 0:
        return not is_blocked(blockers, bodies, plates, source, lifted, SKIN)
    centre, upright = vector_at(plate, number, CENTRE), vector_at(plate, number, NORMAL)
    above = (lifted[0] - centre[0], lifted[1] - centre[1], lifted[2] - centre[2])
    if dot(above, upright) <= 0.0:
        return False
    meet = meet_mirror(centre, upright, row(views.image, view), lifted)
    gap = (meet[0] - centre[0], meet[1] - centre[1], meet[2] - centre[2])
    if is_beside(plate, number, gap) or is_blocked(blockers, bodies, plates, source, meet, SKIN):
        return False
    return not is_blocked(blockers, bodies, plates, lifted, meet, 0.0)


def look(faces: Faces, views: ViewTable, blockers: Blockers) -> SideArray:
    """How each view finds a facet: `AWAY`, `HIDDEN` or `LIT`, ``(view, face)``."""
    nothing = np.full((len(views.plate), 1), AWAY, dtype=np.int8)
    return look_closer(faces, views, blockers, np.zeros(len(faces.area), dtype=np.int64), nothing)


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def look_closer(
    faces: Faces,
    views: ViewTable,
    blockers: Blockers,
    part: IntArray,
    agreed: SideArray,
) -> SideArray:
    """What `look` gives, with rays only where the facets' parts are not agreed.

    Parameters
    ----------
    part : that a facet belongs to, ``(face,)``
    agreed : of each part, as `agree` gives it, ``(view, part)``
    """
    num_views, num_faces = views.plate.size, faces.area.size
    out = np.full((num_views, num_faces), AWAY, dtype=np.int8)
    for number in prange(num_views * num_faces):
        view, f = number // num_faces, number % num_faces
        c, n, s = row(faces.centroid, f), row(faces.normal, f), row(views.image, view)
        if dot(n, (s[0] - c[0], s[1] - c[1], s[2] - c[2])) <= 0.0:
            continue
        known = agreed[view, part[f]]
        if known == AWAY:
            known = LIT if _sees(views, blockers, view, c, n) else HIDDEN
        out[view, f] = known
    return out


@njit(cache=True, nogil=True)
def agree(found: SideArray, near: IntArray) -> SideArray:
    """What all parts around a part that turn to a view say, ``(view, part)``.

    Of what `look` found, ``(view, part)``; `AWAY` where they differ, or none turns to the view.
    """
    out = np.empty_like(found)
    for part in range(found.shape[1]):
        for view in range(found.shape[0]):
            both = 0
            for other in near[part]:
                both |= found[view, other]
            out[view, part] = both if both != HIDDEN | LIT else AWAY
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def spread(faces: Faces, views: ViewTable, patch: IntArray, lit_patch: BoolArray) -> BoolArray:
    """Where a view's facets turn to it and lie in a lit patch, ``(view, face)``."""
    num_views, num_faces = views.image.shape[0], faces.area.size
    out = np.zeros((num_views, num_faces), dtype=np.bool_)
    for f in range(num_faces):
        c, n = vector(faces.centroid[f]), vector(faces.normal[f])
        for view in range(num_views):
            if lit_patch[view, patch[f]]:
                s = views.image[view]
                out[view, f] = dot(n, (s[0] - c[0], s[1] - c[1], s[2] - c[2])) > 0.0
    return out


def rows_of(faces: Faces, views: ViewTable, seen: BoolArray) -> Rows:
    """The facets that views see, ``seen`` ``(view, face)``, as yet without waves."""
    view, face = np.nonzero(seen)
    # both are columns of one table, and kernels are compiled for every layout of their arrays
    view, face = np.ascontiguousarray(view), np.ascontiguousarray(face)
    start = np.concatenate([[0], np.cumsum(np.bincount(view, minlength=len(seen)))])
    direction, length = np.empty((len(face), 3)), np.empty(len(face))
    _aim(faces, views, view, face, direction, length)
    return Rows(start, face, direction, length, np.empty((0, 4, 2), dtype=np.complex64))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _aim(
    faces: Faces,
    views: ViewTable,
    view_of_row: IntArray,
    face: IntArray,
    direction: FloatArray,
    length: FloatArray,
) -> None:
    for i in range(face.size):
        c, s = faces.centroid[face[i]], views.image[view_of_row[i]]
        d = (c[0] - s[0], c[1] - s[1], c[2] - s[2])
        size = math.sqrt(dot(d, d))
        length[i] = size
        direction[i, 0], direction[i, 1], direction[i, 2] = (
            d[0] / size, d[1] / size, d[2] / size,
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True, parallel=True)
def fields(
    faces: Faces,
    media: ReflectionTable,
    plate: FloatArray,
    plate_media: ReflectionTable,
    upwards: FloatArray,
    mirror: IntArray,
    loss: IntArray,
    losses: ComplexArray,
    rows: Rows,
) -> NDArray[np.complex64]:
    """Fields, and how their facets take them, of all rows, as `Rows` has them.

    ``plate`` as `Blockers` has it; ``upwards`` are the world's z and y, ``(2, xyz)``; ``mirror``
    ``(row,)`` says which plate a row's view looks into, or −1; ``loss`` ``(row,)`` which of the
    matrices ``losses`` of `view_losses.Losses` it has.
    """
    # single precision: a field's error of 1e-7 is no phase error
    wave = np.empty((mirror.size, 4, 2), dtype=np.complex64)
    for i in prange(mirror.size):
        d, f = row(rows.direction, i), rows.face[i]
        across, sent_v, sent_h = _incident(
            mirror[i], plate, plate_media, upwards, d, loss[i] > 0, losses[loss[i]]
        )
        n, t1 = row(faces.normal, f), row(faces.tangent, f)
        side, cosine = _across(d, n, t1), -dot(n, d)
        out = wave[i]
        out[V, 0], out[V, 1] = _turned(sent_v, across, side, d)
        out[H, 0], out[H, 1] = _turned(sent_h, across, side, d)
        out[GAMMA, 0], out[GAMMA, 1] = looked_up(media, faces.medium[f], cosine)
        out[PLACE, 0] = cosine
        out[PLACE, 1] = complex(dot(side, t1), dot(side, cross(n, t1)))
    return wave


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True, inline="always")
def _incident(
    number: int,
    plate: FloatArray,
    plate_media: ReflectionTable,
    upwards: FloatArray,
    d: Vector,
    is_weakened: bool,
    loss: ComplexArray,
) -> tuple[Vector, Field, Field]:
    """Waves that left V- and H-polarised, as they arrive along d from a plate or −1.

    Both are along a unit vector a, the first, and along d×a. ``loss`` ``(leg, 2, 2)`` are the
    losses before and behind the mirror.
    """
    leaving, normal = d, d
    if number >= 0:
        normal = vector_at(plate, number, NORMAL)
        turn = 2.0 * dot(d, normal)
        leaving = (d[0] - turn * normal[0], d[1] - turn * normal[1], d[2] - turn * normal[2])
    # H of frames.polarisation_basis; V is d×H
    across = _across(row(upwards, 0), leaving, row(upwards, 1))
    v, h = (complex(0.0), complex(1.0)), (complex(1.0), complex(0.0))
    if is_weakened:
        first = loss[0]
        v, h = (first[1, 0], first[0, 0]), (first[1, 1], first[0, 1])
    if number >= 0:
        cosine, medium = -dot(leaving, normal), int(plate[number, MEDIUM])
        gamma_s, gamma_p = looked_up(plate_media, medium, cosine)
        phase = plate_media.roughness[medium] * cosine
        left = math.exp(-2.0 * phase * phase)
        side = _across(leaving, normal, _any_across(normal))
        v, h = _turned(v, across, side, leaving), _turned(h, across, side, leaving)
        v = (left * gamma_s * v[0], left * gamma_p * v[1])
        h = (left * gamma_s * h[0], left * gamma_p * h[1])
        across = side
    if is_weakened:
        side = _across(row(upwards, 0), d, row(upwards, 1))
        v, h = _turned(v, across, side, d), _turned(h, across, side, d)
        v, h = _lost(v, loss[1]), _lost(h, loss[1])
        across = side
    return across, v, h


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True, inline="always")
def _turned(field: Field, old: Vector, new: Vector, d: Vector) -> Field:
    """A field's parts along ``new`` and d×new, from those along ``old`` and d×old."""
    a, b = dot(old, new), dot(old, cross(d, new))
    return a * field[0] - b * field[1], b * field[0] + a * field[1]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True, inline="always")
def _lost(field: Field, matrix: ComplexArray) -> Field:
    """A field (H, V) after a matrix whose order is (V, H)."""
    h, v = field
    return matrix[1, 0] * v + matrix[1, 1] * h, matrix[0, 0] * v + matrix[0, 1] * h


@njit(cache=True, nogil=True, error_model="numpy")
def _any_across(n: Vector) -> Vector:
    """Some unit vector at right angles to a unit vector."""
    if abs(n[0]) < 0.6:
        size = math.sqrt(n[1] * n[1] + n[2] * n[2])
        return 0.0, -n[2] / size, n[1] / size
    size = math.sqrt(n[0] * n[0] + n[1] * n[1])
    return -n[1] / size, n[0] / size, 0.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _phasor(phase: float) -> complex:
    """e^{−jφ} to 1e-11 for |φ| up to 1e6, three times as fast as the library's sine and cosine."""
    turns = math.floor(phase * (2.0 / math.pi) + 0.5)
    # π/2 in two parts, of which the first has 21 trailing zeros
    x = (phase - turns * 1.5707963267341256) - turns * 6.077100506506192e-11
    y = x * x
    sine = x * (
        1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (1.0 - y / 110.0))))
    )
    cosine = 1.0 - y / 2.0 * (
        1.0 - y / 12.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0 * (1.0 - y / 90.0 * (1.0 - y / 132.0))))
    )
    quadrant = int(turns) & 3
    if quadrant & 1:
        sine, cosine = cosine, -sine
    if quadrant & 2:
        sine, cosine = -sine, -cosine
    return complex(cosine, -sine)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _chord(a: float, b: float) -> complex:
    """Divided difference of e^{−jp} between two phases, without cancellation."""
    half = 0.5 * (a - b)
    ratio = math.sin(half) / half if abs(half) > 1e-8 else 1.0
    turned = _phasor(0.5 * (a + b))
    return complex(ratio * turned.imag, -ratio * turned.real)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def facet_integral(low: float, middle: float, high: float) -> complex:
    r"""Mean of e^{−jp} over a triangle on which p is linear, from its corners in rising order.

    :math:`-2` times the second divided difference of e^{−jp}: Gordon's sum
    :math:`-2\sum_i e^{-jp_i}/\prod_{m\ne i}(p_i-p_m)`, which would cancel for equal phases.
    """
    spread = high - low
    if spread < 1e-3:
        x, y = middle - low, spread
        return _phasor(low) * complex(1.0 - (x * x + y * y + x * y) / 12.0, -(x + y) / 3.0)
    return (_chord(low, middle) - _chord(middle, high)) * (2.0 / spread)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def facet_terms(phases: tuple[float, float, float], weight: ComplexArray, place: FloatArray) -> int:
    """The integral as one to three terms at places in barycentric coordinates; how many.

    ``phases`` of the corners; ``weight`` ``(3,)`` and ``place`` ``(3, corner)`` are filled. The
    corners' terms sit at their corners, unless two phases are so near that their terms would
    all but cancel: then both are one term half-way, and all three one at the centroid.
    """
    p, q, r = phases
    lo, hi = min(p, q, r), max(p, q, r)
    mid = p + q + r - lo - hi
    if hi - lo < 2.0:
        weight[0] = facet_integral(lo, mid, hi)
        place[0] = 1.0 / 3.0
        return 1
    if min(mid - lo, hi - mid) >= 0.5:
        # one division for all: dividing complex numbers is slow
        scale = 2.0 / ((p - q) * (q - r) * (r - p))
        weight[0] = _phasor(p) * (scale * (q - r))
        weight[1] = _phasor(q) * (scale * (r - p))
        weight[2] = _phasor(r) * (scale * (p - q))
        for i in range(3):
            for j in range(3):
                place[i, j] = 1.0 if i == j else 0.0
        return 3
    lone = hi if mid - lo < hi - mid else lo
    for i in range(3):
        alone = phases[i] == lone
        place[0, i] = 1.0 if alone else 0.0
        place[1, i] = 0.0 if alone else 0.5
    near, far = (lo, mid) if lone == hi else (mid, hi)
    weight[0] = _phasor(lone) * (-2.0 / ((lone - near) * (lone - far)))
    weight[1] = facet_integral(lo, mid, hi) - weight[0]
    return 2


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True, inline="always")
def _response(
    one: NDArray[np.complex64],
    other: NDArray[np.complex64],
    scale: float,
    out: ComplexArray,
) -> None:
    r"""F ``(receiving, transmitting)`` of a facet, times ``scale``, from two of `Rows.wave`.

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
    cosine1, cosine2 = one[PLACE, 0].real, other[PLACE, 0].real
    turn = one[PLACE, 1].conjugate() * other[PLACE, 1]
    a = 0.5 * scale * (cosine1 + cosine2) * turn.real
    b = 0.5 * scale * (1.0 + cosine1 * cosine2) * turn.imag
    ss, pp = -a * (one[GAMMA, 0] + other[GAMMA, 0]), a * (one[GAMMA, 1] + other[GAMMA, 1])
    sp, ps = b * (other[GAMMA, 1] - one[GAMMA, 0]), b * (other[GAMMA, 0] - one[GAMMA, 1])
    for t in range(2):
        s, p = one[t, 0] * ss + one[t, 1] * ps, one[t, 0] * sp + one[t, 1] * pp
        for r in range(2):
            out[2 * r + t] = s * other[r, 0] + p * other[r, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def next_shared(
    first: IntArray, second: IntArray, a: int, b: int, ends: tuple[int, int]
) -> tuple[int, int]:
    """From rows a and b on, the next two of one facet; the first is ``ends[0]`` if there are none.

    ``first`` and ``second`` are the rows' facets ``(row,)``; ``ends`` those of both views' rows.
    """
    while a < ends[0] and b < ends[1]:
        if first[a] < second[b]:
            a += 1
        elif second[b] < first[a]:
            b += 1
        else:
            return a, b
    return ends[0], ends[1]


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
        spans = first.start[task[k, 0] :][:2], second.start[task[k, 1] :][:2]
        _gather_task(
            faces,
            media,
            first,
            second,
            spans,
            first_cell[k],
            worth[k],
            slide[k],
            wavenumber,
            out[k],
        )
    return out


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _gather_task(
    faces: Faces,
    media: ReflectionTable,
    first: Rows,
    second: Rows,
    spans: tuple[IntArray, IntArray],
    first_cell: int,
    worth: BoolArray,
    slide: FloatArray,
    wavenumber: float,
    cells: ComplexArray,
) -> None:
    """Add what all facets scatter from one view to another; ``spans`` are their rows' ends.

    One long loop, because a call that hands on all arrays takes as long as a facet.
    """
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    response = np.empty(4, dtype=np.complex128)
    slide1, slide2 = vector(slide[0]), vector(slide[1])
    ends = spans[0][1], spans[1][1]
    a, b = next_shared(first.face, second.face, spans[0][0], spans[1][0], ends)
    while a < ends[0]:
        f = first.face[a]
        corner, medium = faces.corner[f], faces.medium[f]
        d1, d2 = row(first.direction, a), row(second.direction, b)
        r1, r2 = first.length[a], second.length[b]
        g = (d1[0] + d2[0], d1[1] + d2[1], d1[2] + d2[2])
        e0, e1, e2 = dot(g, row(corner, 0)), dot(g, row(corner, 1)), dot(g, row(corner, 2))
        total = r1 + r2
        if is_worth(worth, total + min(e0, e1, e2), total + max(e0, e1, e2), first_cell):
            # of the whole path, which saves the centroid's phasor
            phases = wavenumber * (total + e0), wavenumber * (total + e1), wavenumber * (total + e2)
            count = facet_terms(phases, weight, place)
            scale = faces.area[f] / (8.0 * math.pi * r1 * r2)
            phase = media.roughness[medium] * dot(g, row(faces.normal, f))
            if phase != 0.0:
                scale *= math.exp(-0.5 * phase * phase)
            _response(first.wave[a], second.wave[b], scale, response)
            for i in range(count):
                offset = _blend(place[i], corner)
                out, back = _direction_to(d1, r1, offset), _direction_to(d2, r2, offset)
                rate = dot(out, slide1) + dot(back, slide2)
                position = (total + dot(g, offset)) / CELL - first_cell
                _deposit(cells, worth, position, -1j * weight[i], response, out, back, rate)
        a, b = next_shared(first.face, second.face, a + 1, b + 1, ends)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _blend(place: FloatArray, corner: FloatArray) -> Vector:
    """A point of a triangle, m from its centroid, from its barycentric coordinates."""
    p, q, r = place[0], place[1], place[2]
    return (
        p * corner[0, 0] + q * corner[1, 0] + r * corner[2, 0],
        p * corner[0, 1] + q * corner[1, 1] + r * corner[2, 1],
        p * corner[0, 2] + q * corner[1, 2] + r * corner[2, 2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def is_worth(worth: BoolArray, shortest: float, longest: float, first_cell: int) -> bool:
    """Whether one of the cells that lengths of a facet, m, fall into is worth the work."""
    cell = max(int(shortest / CELL) - first_cell, 0)
    last = min(int(longest / CELL) - first_cell + 1, worth.size - 1)
    while cell <= last and not worth[cell]:
        cell += 1
    return cell <= last


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _direction_to(direction: Vector, length: float, offset: Vector) -> Vector:
    """Unit direction to a point a little off the end of a leg."""
    scale = 1.0 / (length + dot(direction, offset))
    return (
        scale * (length * direction[0] + offset[0]),
        scale * (length * direction[1] + offset[1]),
        scale * (length * direction[2] + offset[2]),
    )


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True, inline="always")
def _deposit(
    cells: ComplexArray,
    worth: BoolArray,
    position: float,
    amplitude: complex,
    response: ComplexArray,
    out: Vector,
    back: Vector,
    rate: float,
) -> None:
    """Add one term to the two cells beside its position, given in cells."""
    cell = int(position)
    x = position - cell
    # smooth, and both shares add to one
    share = x * x * (3.0 - 2.0 * x)
    vv, vh = amplitude * response[0], amplitude * response[1]
    hv, hh = amplitude * response[2], amplitude * response[3]
    for side in range(2):
        if not worth[cell + side]:
            continue
        part = share if side == 1 else 1.0 - share
        into, whole = cells[cell + side], part * vv
        into[0] += whole
        into[1] += part * vh
        into[2] += part * hv
        into[3] += part * hh
        into[4] += whole * ((x - side) * CELL)
        into[5] += whole * out[0]
        into[6] += whole * out[1]
        into[7] += whole * out[2]
        into[8] += whole * back[0]
        into[9] += whole * back[1]
        into[10] += whole * back[2]
        into[11] += whole * (rate * rate)
