"""Flat parts of a body: groups of coplanar facets, and which facets are neighbours in them.

`flat_terms` integrates such a part along its border in place of facet by facet.
"""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray

FEWEST_PER_BORDER: Final = 2.0
"""Least number of facets of a flat part per edge of its border. Chosen: with fewer, the facets one
by one take no longer than the border."""

POSITION_STEP: Final = 1e-6 * np.pi
"""Step, m, to which corners and planes are rounded before they are compared. Chosen: far below the
wavelength, and above the rounding of positions in double precision. The irrational factor keeps
the decimal fractions of which bodies are made off the limits between two steps."""

NORMAL_STEP: Final = 1e-5 * np.pi
"""Step to which normals are rounded before they are compared. Chosen: over a facet of 5 cm, normals
that differ by this much differ by less than 2 µm of height."""

NO_NEIGHBOUR: Final = -1
"""Entry of `Flats.neighbour` for an edge on the border of its flat part."""


class Flats(NamedTuple):
    """Flat parts of a surface.

    ``has_any`` is true if there is one. ``is_flat`` ``(face,)`` marks the facets of flat parts;
    ``neighbour`` ``(face, edge)`` is the number of the coplanar facet of the same medium across an
    edge, or `NO_NEIGHBOUR`. Edge e joins the corners e and e + 1 (modulo 3).
    """

    has_any: bool
    is_flat: BoolArray
    neighbour: IntArray


def flats_of(
    centroid: FloatArray, normal: FloatArray, corner: FloatArray, medium: IntArray
) -> Flats:
    """Flat parts of a surface; parameters as in `Surface`.

    Coplanar facets are a flat part if they have at least `FEWEST_PER_BORDER` facets per edge of
    their border. Four cells by four:

    >>> from polychirp.testing.shapes import plate
    >>> face = plate(0.4, 0.1)
    >>> middle = face.mean(axis=1)
    >>> upright = np.tile([1.0, 0.0, 0.0], (len(face), 1))
    >>> found = flats_of(middle, upright, face - middle[:, None], np.zeros(len(face), dtype=int))
    >>> int(found.is_flat.sum()), int((found.neighbour == NO_NEIGHBOUR).sum())
    (32, 16)
    """
    size = len(centroid)
    neighbour = np.full((size, 3), NO_NEIGHBOUR, dtype=np.int64)
    height = np.sum(centroid * normal, axis=1, keepdims=True)
    where = np.concatenate([normal / NORMAL_STEP, height / POSITION_STEP], axis=1)
    plane = row_codes(where, medium)
    count = np.bincount(plane, minlength=1)
    some = np.flatnonzero(count[plane] >= FEWEST_PER_BORDER * 3)
    if not len(some):
        return Flats(False, np.zeros(size, dtype=np.bool_), neighbour)
    vertex = (centroid[some, None] + corner[some]).reshape(-1, 3)
    point = row_codes(vertex / POSITION_STEP, np.zeros(len(vertex), dtype=np.int64)).reshape(-1, 3)
    start, end = point, np.roll(point, -1, axis=1)
    ends = np.stack([np.repeat(plane[some], 3), np.minimum(start, end).ravel(),
                     np.maximum(start, end).ravel()], axis=-1)  # fmt: skip
    edge = row_codes(ends.astype(np.float64), np.zeros(len(ends), dtype=np.int64))
    order = np.argsort(edge, kind="stable")
    alike = np.bincount(edge)[edge[order]]
    # an edge of two facets that run along it in opposite directions lies within the flat part
    pair = order[alike == 2].reshape(-1, 2)
    is_up = (start < end).ravel()
    pair = pair[is_up[pair[:, 0]] != is_up[pair[:, 1]]]
    flat = np.full(len(ends), NO_NEIGHBOUR, dtype=np.int64)
    flat[pair[:, 0]], flat[pair[:, 1]] = some[pair[:, 1] // 3], some[pair[:, 0] // 3]
    neighbour[some] = flat.reshape(-1, 3)
    border = np.bincount(plane, np.sum(neighbour == NO_NEIGHBOUR, axis=1), len(count))
    is_flat = (count >= FEWEST_PER_BORDER * border)[plane] & (count[plane] >= FEWEST_PER_BORDER * 3)
    inside = np.where(is_flat[:, None], neighbour, NO_NEIGHBOUR)
    return Flats(bool(np.any(is_flat)), is_flat, inside)


def row_codes(values: FloatArray, kind: IntArray) -> IntArray:
    """A number for every row of ``values``, rounded, and ``kind``; equal rows share it."""
    whole = np.concatenate([np.round(values).astype(np.int64), kind[:, None]], axis=1)
    # sorting one number per row takes a tenth of the time of sorting rows; the factors are odd, and
    # products are modulo 2⁶⁴, so that two unlike rows hardly ever have the same number
    factor = np.array(
        [0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0xD6E8FEB86659FD93,
         0xA0761D6478BD642F], dtype=np.uint64,
    )  # fmt: skip
    mixed = whole.astype(np.uint64) * factor[: whole.shape[1]]
    mixed ^= mixed >> np.uint64(29)
    return np.asarray(np.unique(np.sum(mixed, axis=1), return_inverse=True)[1].reshape(-1))
