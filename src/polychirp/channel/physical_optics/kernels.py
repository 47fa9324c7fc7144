"""Kernels of facet physical optics; `facets` says what they compute and why."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import cross, dot, row, vector, vector_at
from polychirp.channel.materials.reflection_table import ReflectionTable, tabulated_reflection
from polychirp.channel.physical_optics.views import NEAR_BODIES, NEAR_PLATES, ViewTable, near_view
from polychirp.channel.scene.blockers import (
    PLATE_CENTRE,
    PLATE_MEDIUM,
    PLATE_NORMAL,
    Blockers,
    is_beside,
)
from polychirp.channel.scene.occlusion import is_blocked
from polychirp.channel.scene.world import RADAR_CLEARANCE

LIFT = 3e-3
"""m by which a shadow ray starts above its facet, so as not to meet it or its neighbours."""

CELL = 0.04
"""m of total path length: width of the smooth cells in which contributions are gathered."""

TURN = 128
"""Facets that one thread looks at in a turn."""

AWAY, HIDDEN, LIT = 0, 1, 2
"""A facet that is turned from a view; that turns to it, and is in a shadow; and is seen."""

SideArray = NDArray[np.int8]

V, H, GAMMA, PLACE = 0, 1, 2, 3
"""Rows of one facet's `Rows.wave`."""

FACING, ALONG_FIRST, ALONG_SECOND, NEARNESS, NUM_ASPECTS = 3, 4, 5, 6, 7
"""Columns of `Rows.aspect`, behind the lengths to three corners."""

ONE_TERM, TWO_TERMS = 2.0, 0.5
"""rad: below the first, phases at a facet's corners are all near each other; below the second, two
of them are."""

Vector = tuple[float, float, float]
ComplexVector = tuple[complex, complex, complex]
Field = tuple[complex, complex]


class Faces(NamedTuple):
    """A `Surface`'s arrays as the kernels need them, ``(face, …)``.

    ``horizon`` is as `horizons` gives it of the facets' own body; 1 if that is not known.
    """

    centroid: FloatArray
    normal: FloatArray
    tangent: FloatArray
    corner: FloatArray
    area: FloatArray
    medium: IntArray
    horizon: FloatArray

    def of(self, number: IntArray) -> Faces:
        """The faces of these numbers."""
        return Faces(
            self.centroid[number],
            self.normal[number],
            self.tangent[number],
            self.corner[number],
            self.area[number],
            self.medium[number],
            self.horizon[number],
        )


class Rows(NamedTuple):
    """Lit facets of several views, one view behind the other, ``(row, …)``.

    ``start`` ``(view + 1,)`` says where each view's rows begin; ``face``; ``direction`` from the
    image to the centroid, unit; ``length`` m; ``aspect`` ``(row, 7)``: the lengths to the facet's
    corners, m, to first order; the angle's cosine; the direction's parts along the facet's two
    tangents; 1/m; and ``wave`` ``(row, 4, 2)`` complex: in rows `V` and `H` the fields of waves
    that left so polarised, across and in the plane of incidence; in `GAMMA` (Γs, Γp) of the facet;
    in `PLACE` the angle's cosine, and the vector across the plane of incidence as a complex number
    in the facet's two tangents.
    """

    start: IntArray
    face: IntArray
    direction: FloatArray
    length: FloatArray
    aspect: FloatArray
    wave: NDArray[np.complex64]

    @property
    def view(self) -> IntArray:
        """Number of every row's view, ``(row,)``."""
        return np.repeat(np.arange(len(self.start) - 1), np.diff(self.start))

    def only(self, kept: BoolArray) -> Rows:
        """Some of the rows, ``kept`` ``(row,)``."""
        number = np.flatnonzero(kept)
        return Rows(
            np.searchsorted(number, self.start),
            self.face[number],
            np.take(self.direction, number, axis=0),
            self.length[number],
            np.take(self.aspect, number, axis=0),
            np.take(self.wave, number, axis=0) if len(self.wave) else self.wave,
        )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _across(direction: Vector, normal: Vector, spare: Vector) -> Vector:
    """Unit vector across the plane of incidence; ``spare`` where that is not defined."""
    c = cross(direction, normal)
    size = math.sqrt(dot(c, c))
    if size < 1e-9:
        return spare
    return c[0] / size, c[1] / size, c[2] / size


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def meet_mirror(centre: Vector, normal: Vector, image: Vector, point: Vector) -> Vector:
    """Where the line from an image to a point meets the plate."""
    gx, gy, gz = point[0] - image[0], point[1] - image[1], point[2] - image[2]
    above = dot(normal, (centre[0] - image[0], centre[1] - image[1], centre[2] - image[2]))
    t = above / dot(normal, (gx, gy, gz))
    return image[0] + t * gx, image[1] + t * gy, image[2] + t * gz


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _sees(
    views: ViewTable,
    blockers: Blockers,
    view: int,
    faces: Faces,
    f: int,
) -> bool:
    """Whether nothing hides a facet that faces the view's image."""
    centroid, normal = row(faces.centroid, f), row(faces.normal, f)
    bodies, plates = near_view(views, view, NEAR_BODIES), near_view(views, view, NEAR_PLATES)
    source = row(views.source, view)
    lifted = (
        centroid[0] + LIFT * normal[0],
        centroid[1] + LIFT * normal[1],
        centroid[2] + LIFT * normal[2],
    )
    number, plate = views.plate[view], blockers.plate
    if number < 0:
        if _is_open(faces, f, lifted, source):
            bodies = bodies[:-1]  # all but its own
        return not is_blocked(blockers, bodies, plates, source, lifted, RADAR_CLEARANCE)
    centre, upright = vector_at(plate, number, PLATE_CENTRE), vector_at(plate, number, PLATE_NORMAL)
    above = (lifted[0] - centre[0], lifted[1] - centre[1], lifted[2] - centre[2])
    if dot(above, upright) <= 0.0:
        return False
    meet = meet_mirror(centre, upright, row(views.image, view), lifted)
    gap = (meet[0] - centre[0], meet[1] - centre[1], meet[2] - centre[2])
    if is_beside(plate, number, gap) or is_blocked(
        blockers, bodies, plates, source, meet, RADAR_CLEARANCE
    ):
        return False
    if _is_open(faces, f, lifted, meet):
        bodies = bodies[:-1]
    return not is_blocked(blockers, bodies, plates, lifted, meet, 0.0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _is_open(faces: Faces, f: int, start: Vector, end: Vector) -> bool:
    """Whether a way from a facet is above its horizon."""
    way, sine = (end[0] - start[0], end[1] - start[1], end[2] - start[2]), faces.horizon[f]
    height = dot(way, row(faces.normal, f))
    return bool(height > 0.0 and height * height > sine * sine * dot(way, way))


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
    num_turns = (num_faces + TURN - 1) // TURN
    for number in prange(num_views * num_turns):
        view, begin = number // num_turns, (number % num_turns) * TURN
        s = row(views.image, view)
        for f in range(begin, min(begin + TURN, num_faces)):
            c, n = row(faces.centroid, f), row(faces.normal, f)
            if dot(n, (s[0] - c[0], s[1] - c[1], s[2] - c[2])) <= 0.0:
                continue
            known = agreed[view, part[f]]
            if known == AWAY:
                known = LIT if _sees(views, blockers, view, faces, f) else HIDDEN
            out[view, f] = known
    return out


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def sees_any(faces: Faces, views: ViewTable, blockers: Blockers) -> BoolArray:
    """Whether a view finds any of the faces `LIT`, ``(view,)``."""
    out = np.zeros(views.plate.size, dtype=np.bool_)
    for view in prange(views.plate.size):
        s = row(views.image, view)
        for f in range(faces.area.size):
            c, n = row(faces.centroid, f), row(faces.normal, f)
            if dot(n, (s[0] - c[0], s[1] - c[1], s[2] - c[2])) <= 0.0:
                continue
            if _sees(views, blockers, view, faces, f):
                out[view] = True
                break
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
    start = np.concatenate([[0], np.cumsum(np.count_nonzero(seen, axis=1))])
    count = int(start[-1])
    face, direction, length = np.empty(count, dtype=np.int64), np.empty((count, 3)), np.empty(count)
    aspect = np.empty((count, NUM_ASPECTS))
    rows = Rows(start, face, direction, length, aspect, np.empty((0, 4, 2), dtype=np.complex64))
    _aim(faces, views, seen, rows)
    return rows


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def _aim(faces: Faces, views: ViewTable, seen: BoolArray, rows: Rows) -> None:
    """Fill rows whose ``start`` alone is known."""
    for view in prange(seen.shape[0]):
        _aim_one(faces, row(views.image, view), seen[view], rows.start[view], rows)


@njit(cache=True, nogil=True, error_model="numpy")
def _aim_one(faces: Faces, s: Vector, seen: BoolArray, first: int, rows: Rows) -> None:
    """Fill the rows of one view's image, from ``first`` on."""
    i = first
    for f in range(seen.size):
        if not seen[f]:
            continue
        c = row(faces.centroid, f)
        way = (c[0] - s[0], c[1] - s[1], c[2] - s[2])
        size = math.sqrt(dot(way, way))
        near = 1.0 / size
        d = (way[0] * near, way[1] * near, way[2] * near)
        n, t = row(faces.normal, f), row(faces.tangent, f)
        rows.face[i], rows.length[i] = f, size
        rows.direction[i, 0], rows.direction[i, 1], rows.direction[i, 2] = d
        for corner in range(3):
            offset = (
                faces.corner[f, corner, 0],
                faces.corner[f, corner, 1],
                faces.corner[f, corner, 2],
            )
            rows.aspect[i, corner] = size + dot(d, offset)
        rows.aspect[i, FACING], rows.aspect[i, NEARNESS] = -dot(n, d), near
        rows.aspect[i, ALONG_FIRST] = dot(d, t)
        rows.aspect[i, ALONG_SECOND] = dot(d, cross(n, t))
        i += 1


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True, parallel=True)
def fields(
    faces: Faces,
    media: ReflectionTable,
    plate: FloatArray,
    plate_media: ReflectionTable,
    upwards: FloatArray,
    mirror: IntArray,
    patch: IntArray,
    losses: tuple[IntArray, ComplexArray],
    rows: Rows,
    view: IntArray,
) -> NDArray[np.complex64]:
    """Fields, and how their facets take them, of all rows, as `Rows` has them.

    ``plate`` as `Blockers` has it; ``upwards`` are the world's z and y, ``(2, xyz)``; ``mirror``
    ``(view,)`` says which plate a view looks into, or −1; ``patch`` ``(face,)`` where a facet
    belongs to; ``losses`` are `view_losses.Losses`; ``view`` ``(row,)`` says whose row it is.
    """
    # single precision: a field's error of 1e-7 is no phase error
    wave = np.empty((view.size, 4, 2), dtype=np.complex64)
    for i in prange(view.size):
        d, f = row(rows.direction, i), rows.face[i]
        number, lost = mirror[view[i]], losses[0][view[i], patch[f]]
        across, sent_v, sent_h = _incident(
            number, plate, plate_media, upwards, d, lost > 0, losses[1][lost]
        )
        n, t1 = row(faces.normal, f), row(faces.tangent, f)
        side, cosine = _across(d, n, t1), -dot(n, d)
        out = wave[i]
        out[V, 0], out[V, 1] = _turned(sent_v, across, side, d)
        out[H, 0], out[H, 1] = _turned(sent_h, across, side, d)
        out[GAMMA, 0], out[GAMMA, 1] = tabulated_reflection(media, faces.medium[f], cosine)
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
        normal = vector_at(plate, number, PLATE_NORMAL)
        turn = 2.0 * dot(d, normal)
        leaving = (d[0] - turn * normal[0], d[1] - turn * normal[1], d[2] - turn * normal[2])
    # H of frames.polarisation_basis; V is d×H
    across = _across(row(upwards, 0), leaving, row(upwards, 1))
    v, h = (complex(0.0), complex(1.0)), (complex(1.0), complex(0.0))
    if is_weakened:
        first = loss[0]
        v, h = (first[1, 0], first[0, 0]), (first[1, 1], first[0, 1])
    if number >= 0:
        cosine, medium = -dot(leaving, normal), int(plate[number, PLATE_MEDIUM])
        gamma_s, gamma_p = tabulated_reflection(plate_media, medium, cosine)
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
    """e^{−jφ} to 1e-11 for |φ| up to 1e6, three times as fast as the library's sine and cosine.

    Without branches or divisions, so that several can be worked out at a time.
    """
    turns = math.floor(phase * (2.0 / math.pi) + 0.5)
    # π/2 in two parts, of which the first has 21 trailing zeros
    x = (phase - turns * 1.5707963267341256) - turns * 6.077100506506192e-11
    y = x * x
    sine = 1.0 - y * (1 / 72) * (1.0 - y * (1 / 110))
    sine = x * (1.0 - y * (1 / 6) * (1.0 - y * (1 / 20) * (1.0 - y * (1 / 42) * sine)))
    cosine = 1.0 - y * (1 / 56) * (1.0 - y * (1 / 90) * (1.0 - y * (1 / 132)))
    cosine = 1.0 - y * (1 / 2) * (1.0 - y * (1 / 12) * (1.0 - y * (1 / 30) * cosine))
    quadrant = int(turns)
    is_odd, is_back = (quadrant & 1) != 0, (quadrant & 2) != 0
    real, imaginary = (-sine, -cosine) if is_odd else (cosine, -sine)
    return complex(-real, -imaginary) if is_back else complex(real, imaginary)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _chord(a: float, b: float) -> complex:
    """Divided difference of e^{−jp} between two phases, without cancellation."""
    half = 0.5 * (a - b)
    ratio = -_phasor(half).imag / half if abs(half) > 1e-8 else 1.0
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
    if hi - lo < ONE_TERM:
        weight[0] = facet_integral(lo, mid, hi)
        place[0] = 1.0 / 3.0
        return 1
    if min(mid - lo, hi - mid) >= TWO_TERMS:
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
