"""Closest hit of a ray in trees of boxes, eight boxes at a time, near ones first.

`caster.first_hit` walks a tree in the order in which it is stored, which needs no room and is
best where any hit will do. For the closest hit, what is near ought to come first: it shortens the
ray, and leaves the rest out of its reach. Eight boxes are tried at once, as processors do sums, in
single precision: they are larger by more than that may be wrong, while triangles are met in double
precision. So the hits are those of any other way.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.geometry.bvh import NOTHING, Tree, Vector, struck

WIDTH: Final = 8
"""Boxes that are tried at once."""

LINK: Final = 6 * WIDTH
"""Columns of a row that say where its boxes lead: to another row, or to a first triangle."""

SIZE: Final = 7 * WIDTH
"""Columns of a row that say how many triangles its boxes have: 0 for a row, −1 for no box."""

X_SIDES, Y_SIDES, Z_SIDES = (np.uint64(n * WIDTH) for n in (3, 5, 7))
"""Sums of the columns of both sides; unsigned, as no column is counted from the end."""

MEDIUM: Final = 9
"""Column of a triangle: the number of its medium; −1 − that number if it is a thin sheet."""

CLOSEST, OPAQUE, SHEET = 0, 1, -1
"""What is asked for: the closest hit, or any hit of one kind, by the sign of `MEDIUM`."""

SWELL: Final = 2e-6
"""By how much of the greatest distance from the origin boxes are larger: 16 roundings."""

SLACK: Final = 1e-4
"""m by which a ray is taken for longer at both ends, as single precision may be wrong:
it is, by half of that, 1 km from the middle of a tree."""

STEEP: Final = 1e18
"""Greatest inverse of a direction that is reckoned with: finite in single precision."""


class Bundles(NamedTuple):
    """Trees of boxes in bundles of `WIDTH`.

    ``bundle`` ``(row, 64)``: the low x, y and z of the boxes, their high x, y and z, m, and columns
    `LINK` and `SIZE`, which count from the table's begin; ``triangle`` ``(triangle, 10)``: a corner
    and two edges, m, and column `MEDIUM`; ``room``: of how many numbers a ray
    has to make notes on its way.
    """

    bundle: NDArray[np.float32]
    triangle: FloatArray
    room: int


@njit(cache=True, nogil=True)
def _half_area(box: FloatArray, node: int) -> float:
    x, y = box[node, 3] - box[node, 0], box[node, 4] - box[node, 1]
    z = box[node, 5] - box[node, 2]
    return float(x * y + y * z + z * x)


@njit(cache=True, nogil=True)
def _gather_children(
    box: FloatArray, skip: IntArray, size: IntArray, nodes: IntArray, count: int
) -> int:
    """Put children in the place of the largest of ``count`` nodes, while there is room."""
    while count < WIDTH:
        best, largest = -1, -1.0
        for i in range(count):
            area = _half_area(box, nodes[i])
            if size[nodes[i]] == 0 and area > largest:
                best, largest = i, area
        if best < 0:
            break
        node = nodes[best]
        nodes[best], nodes[count] = node + 1, skip[node + 1]
        count += 1
    return count


@njit(cache=True, nogil=True)
def _bundle(
    box: FloatArray, skip: IntArray, first: IntArray, size: IntArray, roots: IntArray,
    swell: float,
) -> tuple[NDArray[np.float32], int]:  # fmt: skip
    """Bundles of the trees at ``roots``, all below row 0, and the room that walking them takes."""
    out = np.zeros((1 + skip.size, 8 * WIDTH), dtype=np.float32)
    out[:, SIZE:] = -1.0
    nodes, rows, room = np.empty(WIDTH, dtype=np.int64), 1, 1
    # what is still to be written: the node, its row, and how many may wait then
    whose, where, waits = [-1], [0], [1]
    while len(whose) > 0:
        node, row, others = whose.pop(), where.pop(), waits.pop()
        count = roots.size if node < 0 else 1
        for i in range(count):
            nodes[i] = roots[i] if node < 0 else node
        count = _gather_children(box, skip, size, nodes, count)
        room = max(room, others + count)
        for i in range(count):
            child = nodes[i]
            for x in range(3):
                out[row, WIDTH * x + i] = box[child, x] - swell
                out[row, WIDTH * (3 + x) + i] = box[child, 3 + x] + swell
            out[row, SIZE + i] = size[child]
            if size[child] > 0:
                out[row, LINK + i] = first[child]
                continue
            out[row, LINK + i] = rows
            whose.append(child)
            where.append(rows)
            waits.append(others + count)
            rows += 1
    return out[:rows].copy(), room


def bundles_of(trees: tuple[Tree, ...], media: tuple[IntArray, ...]) -> Bundles:
    """Several trees as one.

    ``media``: what is in the column `MEDIUM` of the triangles of each.
    """
    nodes = np.cumsum([0] + [len(tree.skip) for tree in trees])
    triangles = np.cumsum([0] + [len(tree.face) for tree in trees])
    box = np.concatenate([tree.box for tree in trees])
    roots = [begin for begin, tree in zip(nodes, trees, strict=False) if len(tree.face)]
    farthest = np.max(np.abs(box[roots]), initial=0.0)
    bundle, room = _bundle(
        box,
        np.concatenate([t.skip + n for t, n in zip(trees, nodes, strict=False)]),
        np.concatenate([t.first + n for t, n in zip(trees, triangles, strict=False)]),
        np.concatenate([tree.size for tree in trees]),
        np.array(roots, dtype=np.int64),
        SWELL * float(farthest),
    )
    rows = [
        np.column_stack([tree.triangle, medium]) for tree, medium in zip(trees, media, strict=True)
    ]
    return Bundles(bundle, np.concatenate(rows), WIDTH + 3 * room)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _steepness(x: float) -> float:
    """1/x, but finite in single precision."""
    return 1.0 / x if abs(x) > 1.0 / STEEP else STEEP


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _first_sides(x: float, y: float, z: float) -> tuple[np.uint64, np.uint64, np.uint64]:
    """Columns of the sides of boxes that a ray along x, y, z meets first."""
    return (
        np.uint64(0 if x > 0.0 else 3 * WIDTH),
        np.uint64(WIDTH if y > 0.0 else 4 * WIDTH),
        np.uint64(2 * WIDTH if z > 0.0 else 5 * WIDTH),
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _enter_all(
    bundle: NDArray[np.float32],
    row: int,
    side: tuple[np.uint64, np.uint64, np.uint64],
    origin: tuple[np.float32, np.float32, np.float32],
    inverse: tuple[np.float32, np.float32, np.float32],
    span: tuple[np.float32, np.float32],
    found: NDArray[np.float32],
) -> None:
    """Where a ray enters the boxes of a row; infinite if not within its span.

    ``side``: columns of the sides that it meets first.
    """
    never = np.float32(np.inf)
    ax, ay, az = side
    bx, by, bz = X_SIDES - ax, Y_SIDES - ay, Z_SIDES - az
    # not WIDTH: a loop whose length is known is written out, and then not done at once
    for c in range(np.uint64(bundle.shape[1] // 8)):
        x = (bundle[row, ax + c] - origin[0]) * inverse[0]
        y = (bundle[row, ay + c] - origin[1]) * inverse[1]
        z = (bundle[row, az + c] - origin[2]) * inverse[2]
        enter = max(x, y, z, span[0])
        x = (bundle[row, bx + c] - origin[0]) * inverse[0]
        y = (bundle[row, by + c] - origin[1]) * inverse[1]
        z = (bundle[row, bz + c] - origin[2]) * inverse[2]
        leave = min(x, y, z, span[1])
        found[c] = enter if enter <= leave else never


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _note(bundle: NDArray[np.float32], row: int, waiting: NDArray[np.float32], waits: int) -> int:
    """Note which boxes of a row a ray enters, far ones first; where the notes end then."""
    never, none, first = np.float32(np.inf), np.float32(0.0), waits
    for c in range(WIDTH):
        here = waiting[c]
        if here < never and bundle[row, SIZE + c] >= none:
            k = waits
            while k > first and waiting[k - 3] < here:
                for x in range(3):
                    waiting[k + x] = waiting[k - 3 + x]
                k -= 3
            waiting[k] = here
            waiting[k + 1], waiting[k + 2] = bundle[row, LINK + c], bundle[row, SIZE + c]
            waits += 3
    return waits


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_hit(
    bundle: NDArray[np.float32],
    triangle: FloatArray,
    begin: tuple[int, int],
    origin: Vector,
    direction: Vector,
    span: tuple[float, float],
    middle: float,
    wanted: int,
    waiting: NDArray[np.float32],
) -> tuple[float, int]:
    """Distance and triangle of the closest hit strictly within ``span``, m.

    Parameters
    ----------
    begin : row and triangle where the table of the tree begins
    direction : a unit vector
    middle : m, about where the ray is nearest to the middle of the tree
    wanted : `CLOSEST` of all, or any that is `OPAQUE`, or a `SHEET`
    waiting : `Bundles.room` numbers

    Returns
    -------
    distance : infinite without a hit
    triangle : counted from ``begin[1]``
    """
    single = np.float32
    ix, iy, iz = _steepness(direction[0]), _steepness(direction[1]), _steepness(direction[2])
    inverse = single(ix), single(iy), single(iz)
    side = _first_sides(ix, iy, iz)
    place = (
        single(origin[0] + middle * direction[0]),
        single(origin[1] + middle * direction[1]),
        single(origin[2] + middle * direction[2]),
    )
    farthest, start = span[1], single(span[0] - middle - SLACK)
    best, found, waits, link, size = NOTHING, 0, WIDTH, 0, 0
    while True:
        if size > 0:
            for t in range(begin[1] + link, begin[1] + link + size):
                if wanted * (triangle[t, MEDIUM] + 0.5) < 0.0:
                    continue
                distance = struck(triangle, t, origin, direction)
                if span[0] < distance < farthest:
                    farthest, best, found = distance, distance, t - begin[1]
                    if wanted != CLOSEST:
                        return best, found
        else:
            row = begin[0] + link
            stop = single(farthest - middle + SLACK)
            _enter_all(bundle, row, side, place, inverse, (start, stop), waiting)
            waits = _note(bundle, row, waiting, waits)
        # what has been found may be nearer than what waits
        stop = single(farthest - middle + SLACK)
        while waits > WIDTH and waiting[waits - 3] > stop:
            waits -= 3
        if waits == WIDTH:
            return best, found
        waits -= 3
        link, size = int(waiting[waits + 1]), int(waiting[waits + 2])
