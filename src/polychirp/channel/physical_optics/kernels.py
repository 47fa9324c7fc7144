"""Facets that views illuminate: shadow tests and geometry. `paths` states the equations."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, row, vector_at
from polychirp.channel.physical_optics.views import NEAR_BODIES, NEAR_PLATES, ViewTable, near_view
from polychirp.channel.scene.blockers import PLATE_CENTRE, PLATE_NORMAL, Blockers, is_beside
from polychirp.channel.scene.occlusion import is_blocked
from polychirp.channel.scene.world import RADAR_CLEARANCE
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

SHADOW_RAY_LIFT: Final = 3e-3
"""Height above its facet of a shadow ray's end, m. Chosen: the ray must miss the facet and its
neighbours."""

CELL_LENGTH: Final = 0.04
"""Width of the cells of total path length into which facets' terms are summed, m; the cells overlap
smoothly. Chosen: wider cells make fewer paths, but a path is then a mean over more facets."""

FEWEST_FACETS: Final = 256
"""Least facets per parallel call of a kernel (chosen: fewer do not repay the call)."""

TURNED_AWAY, SHADOWED, ILLUMINATED = 0, 1, 2
"""State of a facet in a view: it faces away, it faces the view but is in a shadow, or it is lit."""

MIXED = SHADOWED | ILLUMINATED
"""State of a patch if some patches around it are in a shadow and others are illuminated."""

StateArray = NDArray[np.int8]

SENT_V, SENT_H, REFLECTION, INCIDENCE = 0, 1, 2, 3
"""Rows of `LitFacets.wave` of one facet."""

FACING, ALONG_FIRST, ALONG_SECOND, INVERSE_LENGTH, NUM_ASPECTS = 3, 4, 5, 6, 7
"""Columns of `LitFacets.aspect` after columns 0 to 2, the lengths to the corners; their number."""

ComplexVector = tuple[complex, complex, complex]


class Faces(NamedTuple):
    """A `Surface`'s arrays as the kernels need them, ``(face, …)``.

    ``horizon`` is the sine of the elevation above which the facet's own body hides nothing, by
    `horizons`; it is 1 if that is not known.
    """

    centroid: FloatArray
    normal: FloatArray
    tangent: FloatArray
    corner: FloatArray
    area: FloatArray
    medium: IntArray
    horizon: FloatArray

    def select(self, number: IntArray) -> Faces:
        """The faces of these numbers."""
        return Faces._make(column[number] for column in self)


class LitFacets(NamedTuple):
    """Illuminated facets of several views, one view behind the other, ``(row, …)``.

    The rows of view i are ``start[i]:start[i + 1]``. ``face`` is the facet's number,
    ``direction`` the unit vector from the view's image to its centroid, ``length`` m that
    distance. ``aspect`` ``(row, 7)`` holds the lengths to the facet's corners, m, to first order;
    the cosine of the angle of incidence; the direction's components along the facet's two
    tangents; 1/length. ``wave`` ``(row, 4, 2)`` complex holds, in rows `SENT_V` and `SENT_H`, the
    fields of waves sent with that polarisation, across and in the plane of incidence; in
    `REFLECTION` (Γs, Γp) of the facet; in `INCIDENCE` the cosine of the angle of incidence, and
    the vector across the plane of incidence as a complex number in the facet's two tangents.
    ``loss`` is 0 where no sheet or leaves weaken the wave on its way to the facet.
    """

    start: IntArray
    face: IntArray
    direction: FloatArray
    length: FloatArray
    aspect: FloatArray
    wave: NDArray[np.complex64]
    loss: IntArray

    @property
    def view(self) -> IntArray:
        """Number of every row's view, ``(row,)``."""
        return np.repeat(np.arange(len(self.start) - 1), np.diff(self.start))

    def select(self, is_kept: BoolArray) -> LitFacets:
        """Some of the rows; mask ``(row,)``."""
        number = np.flatnonzero(is_kept)
        return LitFacets(
            np.searchsorted(number, self.start),
            self.face[number],
            np.take(self.direction, number, axis=0),
            self.length[number],
            np.take(self.aspect, number, axis=0),
            np.take(self.wave, number, axis=0) if len(self.wave) else self.wave,
            self.loss[number] if len(self.loss) else self.loss,
        )


@inlined
def across_plane_of_incidence(direction: Vector, normal: Vector, spare: Vector) -> Vector:
    """Unit vector normal to the plane of incidence; ``spare`` at normal incidence."""
    c = cross(direction, normal)
    size = math.sqrt(dot(c, c))
    if size < 1e-9:
        return spare
    return c[0] / size, c[1] / size, c[2] / size


@inner
def any_normal_to(n: Vector) -> Vector:
    """Some unit vector at right angles to a unit vector."""
    if abs(n[0]) < 0.6:
        size = math.sqrt(n[1] * n[1] + n[2] * n[2])
        return 0.0, -n[2] / size, n[1] / size
    size = math.sqrt(n[0] * n[0] + n[1] * n[1])
    return -n[1] / size, n[0] / size, 0.0


@inlined
def mirror_point(centre: Vector, normal: Vector, image: Vector, point: Vector) -> Vector:
    """Point where the line from an image to a point meets the plate at ``centre``."""
    gx, gy, gz = point[0] - image[0], point[1] - image[1], point[2] - image[2]
    above = dot(normal, (centre[0] - image[0], centre[1] - image[1], centre[2] - image[2]))
    t = above / dot(normal, (gx, gy, gz))
    return image[0] + t * gx, image[1] + t * gy, image[2] + t * gz


@inlined
def _is_facing(faces: Faces, f: int, point: Vector) -> bool:
    """True if a point is in front of a facet."""
    c, n = row(faces.centroid, f), row(faces.normal, f)
    return bool(dot(n, (point[0] - c[0], point[1] - c[1], point[2] - c[2])) > 0.0)


@inlined
def _is_lit(
    views: ViewTable,
    blockers: Blockers,
    view: int,
    faces: Faces,
    f: int,
) -> bool:
    """True if nothing hides a facet that faces the view's image."""
    centroid, normal = row(faces.centroid, f), row(faces.normal, f)
    bodies, plates = near_view(views, view, NEAR_BODIES), near_view(views, view, NEAR_PLATES)
    source = row(views.source, view)
    lifted = (
        centroid[0] + SHADOW_RAY_LIFT * normal[0],
        centroid[1] + SHADOW_RAY_LIFT * normal[1],
        centroid[2] + SHADOW_RAY_LIFT * normal[2],
    )
    if not views.is_mirrored[view]:
        if _is_above_horizon(faces, f, lifted, source):
            bodies = bodies[:-1]  # the last is the facet's own body
        return not is_blocked(blockers, bodies, plates, source, lifted, RADAR_CLEARANCE)
    number, plate = views.plate[view], blockers.plate
    centre, upright = vector_at(plate, number, PLATE_CENTRE), vector_at(plate, number, PLATE_NORMAL)
    above = (lifted[0] - centre[0], lifted[1] - centre[1], lifted[2] - centre[2])
    if dot(above, upright) <= 0.0:
        return False
    # two shadow rays, from the radar and from the facet to the mirror point
    meet = mirror_point(centre, upright, row(views.image, view), lifted)
    gap = (meet[0] - centre[0], meet[1] - centre[1], meet[2] - centre[2])
    if is_beside(plate, number, gap) or is_blocked(
        blockers, bodies, plates, source, meet, RADAR_CLEARANCE
    ):
        return False
    if _is_above_horizon(faces, f, lifted, meet):
        bodies = bodies[:-1]
    return not is_blocked(blockers, bodies, plates, lifted, meet, 0.0)


@inlined
def _is_above_horizon(faces: Faces, f: int, start: Vector, end: Vector) -> bool:
    """True if a ray from a facet is above the horizon that the facet's own body makes."""
    way, sine = (end[0] - start[0], end[1] - start[1], end[2] - start[2]), faces.horizon[f]
    height = dot(way, row(faces.normal, f))
    return bool(height > 0.0 and height * height > sine * sine * dot(way, way))


def illumination_states(faces: Faces, views: ViewTable, blockers: Blockers) -> StateArray:
    """State of every facet in every view, by one shadow ray each, ``(view, face)``."""
    unknown = np.full((len(views.plate), 1), MIXED, dtype=np.int8)
    one_patch = np.zeros(len(faces.area), dtype=np.int64)
    return refine_shadow_edge(faces, views, blockers, one_patch, unknown)


def refine_shadow_edge(
    faces: Faces,
    views: ViewTable,
    blockers: Blockers,
    patch: IntArray,
    patch_state: StateArray,
) -> StateArray:
    """State of every facet in every view, with rays only where its patch's state is no answer.

    Parameters
    ----------
    patch : to which a facet belongs, ``(face,)``
    patch_state : of each patch with those around it, as `common_state` gives it, ``(view, patch)``
    """
    out = np.full((len(views.plate), len(faces.area)), TURNED_AWAY, dtype=np.int8)
    where = faces, views, blockers, patch, patch_state
    in_ranges(_fill_states, out.size, *where, out, least=FEWEST_FACETS)
    return out


@compiled
def _fill_states(
    begin: int,
    end: int,
    faces: Faces,
    views: ViewTable,
    blockers: Blockers,
    patch: IntArray,
    patch_state: StateArray,
    out: StateArray,
) -> None:
    """Fill places of ``out`` ``(view, face)``, counted row by row."""
    num_faces = faces.area.size
    for place in range(begin, end):
        view, f = place // num_faces, place % num_faces
        if not _is_facing(faces, f, row(views.image, view)):
            continue
        state = patch_state[view, patch[f]]
        if not SHADOWED <= state <= ILLUMINATED:  # MIXED, or all turned away
            state = ILLUMINATED if _is_lit(views, blockers, view, faces, f) else SHADOWED
        out[view, f] = state


@compiled
def common_state(state: StateArray, near: IntArray) -> StateArray:
    """State shared by the patches around each patch that face a view, or `MIXED`.

    ``state`` ``(view, patch)`` as `illumination_states` gives it; ``near`` ``(patch, near)`` are
    the patches around each patch. The result is `TURNED_AWAY` if none of them faces the view.
    """
    out = np.empty_like(state)
    for patch in range(state.shape[1]):
        for view in range(state.shape[0]):
            found = TURNED_AWAY
            for other in near[patch]:
                found |= state[view, other]
            out[view, patch] = found
    return out


def lit_facets(faces: Faces, views: ViewTable, is_lit: BoolArray) -> LitFacets:
    """Illuminated facets, mask ``(view, face)``, without waves."""
    start = np.concatenate([[0], np.cumsum(np.count_nonzero(is_lit, axis=1))])
    count = int(start[-1])
    face, direction, length = np.empty(count, dtype=np.int64), np.empty((count, 3)), np.empty(count)
    aspect = np.empty((count, NUM_ASPECTS))
    no_waves = np.empty((0, 4, 2), dtype=np.complex64)
    no_losses = np.empty(0, dtype=np.int64)
    lit = LitFacets(start, face, direction, length, aspect, no_waves, no_losses)
    in_ranges(_fill_geometry, len(is_lit), faces, views, is_lit, lit)
    return lit


@compiled
def _fill_geometry(
    begin: int, end: int, faces: Faces, views: ViewTable, is_lit: BoolArray, lit: LitFacets
) -> None:
    """Fill the rows of views ``begin`` to ``end``; only ``lit.start`` is filled before."""
    for view in range(begin, end):
        _fill_view(faces, row(views.image, view), is_lit[view], lit.start[view], lit)


@inner
def _fill_view(faces: Faces, s: Vector, is_lit: BoolArray, first: int, lit: LitFacets) -> None:
    """Fill the rows of the view whose image is at ``s``, from row ``first`` on."""
    i = first
    for f in range(is_lit.size):
        if not is_lit[f]:
            continue
        c = row(faces.centroid, f)
        way = (c[0] - s[0], c[1] - s[1], c[2] - s[2])
        size = math.sqrt(dot(way, way))
        inverse = 1.0 / size
        d = (way[0] * inverse, way[1] * inverse, way[2] * inverse)
        n, t = row(faces.normal, f), row(faces.tangent, f)
        lit.face[i], lit.length[i] = f, size
        lit.direction[i, 0], lit.direction[i, 1], lit.direction[i, 2] = d
        for corner in range(3):
            offset = (
                faces.corner[f, corner, 0],
                faces.corner[f, corner, 1],
                faces.corner[f, corner, 2],
            )
            lit.aspect[i, corner] = size + dot(d, offset)
        lit.aspect[i, FACING], lit.aspect[i, INVERSE_LENGTH] = -dot(n, d), inverse
        lit.aspect[i, ALONG_FIRST] = dot(d, t)
        lit.aspect[i, ALONG_SECOND] = dot(d, cross(n, t))
        i += 1
