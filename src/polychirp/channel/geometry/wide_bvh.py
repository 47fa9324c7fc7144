"""Closest hit of a ray in trees of boxes, eight boxes at a time, near boxes first.

`bvh.first_hit` walks a tree in the order in which it is stored. That needs no memory, and is best
if any hit is sufficient. For the closest hit, near boxes should come first: once a hit is found,
boxes beyond it need no test. Eight boxes are tested together, by vector instructions in single
precision; they are enlarged by more than the rounding errors. Triangles are tested in double
precision. The hits are therefore those of `bvh.first_hit`.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.geometry.bvh import NO_HIT, Tree, triangle_distance
from polychirp.channel.geometry.vectors import Vector
from polychirp.errors import InputError
from polychirp.jit import compiled, inlined, inner

NUM_BOXES: Final = 8
"""Boxes in a row, tested together: as many single-precision numbers as an AVX register holds."""

LINK_COLUMN: Final = 6 * NUM_BOXES
"""First of the columns that link each box of a row to another row, or to its first triangle."""

SIZE_COLUMN: Final = 7 * NUM_BOXES
"""First of the columns with the number of triangles of each box; 0 if its link is to a row."""

X_SIDES, Y_SIDES, Z_SIDES = (np.uint64(n * NUM_BOXES) for n in (3, 5, 7))
"""Along each axis, the first column of the low sides of the boxes plus that of the high sides.
They are unsigned, so that the compiled code need not test for negative column numbers."""

TRIANGLE_MEDIUM: Final = 9
"""Column of `Bundles.triangle` with the number of the triangle's medium."""

TRIANGLE_KIND: Final = 10
"""Column of `Bundles.triangle` with the triangle's kind, `OPAQUE_KIND` or `SHEET_KIND`."""

EITHER_KIND, OPAQUE_KIND, SHEET_KIND = 0, 1, 2
"""Kinds of triangles to search for: the closest hit of either kind, or any hit of one kind."""

GREATEST_LINK: Final = 1 << 24
"""Greatest link: single-precision numbers hold all whole numbers up to it."""

BOX_MARGIN: Final = 2e-6
"""Enlargement of boxes, as a share of the greatest magnitude of their coordinates. Chosen: it is 16
times the relative spacing of single-precision numbers."""

SPAN_MARGIN: Final = 1e-4
"""Extension of a ray at both ends, m, while boxes are tested. Chosen: about twice the rounding
error of single precision at 1 km from `SearchRay.middle`."""

GREATEST_INVERSE: Final = 1e18
"""Greatest inverse of a direction's component. Chosen: products stay finite in single precision."""


class Bundles(NamedTuple):
    """Trees of boxes in rows of `NUM_BOXES`.

    ``bundle`` ``(row, 64)``: the low x, y and z of the boxes, their high x, y and z, m, then their
    links (numbers of rows and triangles, from where the trees begin) and numbers of triangles;
    ``triangle`` ``(triangle, 11)``: a corner and two edges, m, `TRIANGLE_MEDIUM` and
    `TRIANGLE_KIND`; ``stack_size``: single-precision numbers of a search's working memory.
    """

    bundle: NDArray[np.float32]
    triangle: FloatArray
    stack_size: int


class SearchRay(NamedTuple):
    """A ray in the frame of a tree.

    ``direction`` is a unit vector; hits count strictly within ``span`` (m). At ``middle`` (m) the
    ray is about nearest to the tree's middle; single-precision distances are relative to it.
    """

    origin: Vector
    direction: Vector
    span: tuple[float, float]
    middle: float


class _BoxRay(NamedTuple):
    """A ray from `SearchRay.middle`: inverse direction, and columns of the sides it meets first."""

    origin: tuple[np.float32, np.float32, np.float32]
    inverse: tuple[np.float32, np.float32, np.float32]
    side: tuple[np.uint64, np.uint64, np.uint64]


@inner
def _half_area(box: FloatArray, node: int) -> float:
    x, y = box[node, 3] - box[node, 0], box[node, 4] - box[node, 1]
    z = box[node, 5] - box[node, 2]
    return float(x * y + y * z + z * x)


@inner
def _gather_children(
    box: FloatArray, skip: IntArray, size: IntArray, nodes: IntArray, count: int
) -> int:
    """Replace the largest nodes by their children while they fit; return the number of nodes."""
    while count < NUM_BOXES:
        best, largest = 0, -np.inf
        for i in range(count):
            area = _half_area(box, nodes[i])
            if size[nodes[i]] == 0 and area > largest:
                best, largest = i, area
        if largest == -np.inf:  # only leaves are left
            break
        node = nodes[best]
        nodes[best], nodes[count] = node + 1, skip[node + 1]
        count += 1
    return count


@compiled
def _bundle(
    box: FloatArray, skip: IntArray, first: IntArray, size: IntArray, roots: IntArray,
    margin: float,
) -> tuple[NDArray[np.float32], int]:  # fmt: skip
    """Rows of the trees at ``roots``, from the common row 0, and the most boxes that ever wait."""
    out = np.zeros((1 + skip.size, 8 * NUM_BOXES), dtype=np.float32)
    # no ray enters a box whose low sides are above its high sides; unused columns keep such a box
    out[:, : 3 * NUM_BOXES], out[:, 3 * NUM_BOXES : LINK_COLUMN] = np.inf, -np.inf
    nodes, rows, most = np.empty(NUM_BOXES, dtype=np.int64), 1, 1
    # rows still to be written: node, number of the row, and boxes that may wait when it is searched
    whose, where, waits = [0], [0], [1]
    while len(whose) > 0:
        node, row, others = whose.pop(), where.pop(), waits.pop()
        count = roots.size if row == 0 else 1
        for i in range(count):
            nodes[i] = roots[i] if row == 0 else node
        count = _gather_children(box, skip, size, nodes, count)
        most = max(most, others + count)
        for i in range(count):
            child = nodes[i]
            for x in range(3):
                out[row, NUM_BOXES * x + i] = box[child, x] - margin
                out[row, NUM_BOXES * (3 + x) + i] = box[child, 3 + x] + margin
            out[row, SIZE_COLUMN + i] = size[child]
            if size[child] > 0:
                out[row, LINK_COLUMN + i] = first[child]
                continue
            out[row, LINK_COLUMN + i] = rows
            whose.append(child)
            where.append(rows)
            waits.append(others + count)
            rows += 1
    return out[:rows].copy(), most


def bundles_of(
    trees: tuple[Tree, ...], media: tuple[IntArray, ...], kinds: tuple[int, ...]
) -> Bundles:
    """Several trees as one, with the media ``(triangle,)`` and kind of each tree's triangles.

    `InputError` is raised if there are more than `NUM_BOXES` trees, or more than `GREATEST_LINK`
    rows or triangles.
    """
    nodes = np.cumsum([0] + [len(tree.skip) for tree in trees])
    triangles = np.cumsum([0] + [len(tree.face) for tree in trees])
    box = np.concatenate([tree.box for tree in trees])
    roots = [begin for begin, tree in zip(nodes, trees, strict=False) if len(tree.face)]
    if len(roots) > NUM_BOXES:
        raise InputError(
            f"{len(roots)} trees of triangles are searched together; use at most {NUM_BOXES}"
        )
    if max(triangles[-1], nodes[-1]) > GREATEST_LINK:
        raise InputError(
            f"trees of {triangles[-1]} triangles and {nodes[-1]} boxes are too large to be "
            f"searched together; use at most {GREATEST_LINK} of each, by longer edges"
        )
    farthest = np.max(np.abs(box[roots]), initial=0.0)
    bundle, most = _bundle(
        box,
        np.concatenate([t.skip + n for t, n in zip(trees, nodes, strict=False)]),
        np.concatenate([t.first + n for t, n in zip(trees, triangles, strict=False)]),
        np.concatenate([tree.size for tree in trees]),
        np.array(roots, dtype=np.int64),
        BOX_MARGIN * float(farthest),
    )
    rows = [
        np.column_stack([tree.triangle, medium, np.full(len(medium), kind)])
        for tree, medium, kind in zip(trees, media, kinds, strict=True)
    ]
    return Bundles(bundle, np.concatenate(rows), NUM_BOXES + 3 * most)


@inlined
def _finite_inverse(x: float) -> float:
    """1/x, but `GREATEST_INVERSE` near x = 0: finite in single precision."""
    return 1.0 / x if abs(x) > 1.0 / GREATEST_INVERSE else GREATEST_INVERSE


@inlined
def _box_ray(ray: SearchRay) -> _BoxRay:
    single, o, d = np.float32, ray.origin, ray.direction
    x, y, z = _finite_inverse(d[0]), _finite_inverse(d[1]), _finite_inverse(d[2])
    return _BoxRay(
        (
            single(o[0] + ray.middle * d[0]),
            single(o[1] + ray.middle * d[1]),
            single(o[2] + ray.middle * d[2]),
        ),
        (single(x), single(y), single(z)),
        (
            np.uint64(0 if x > 0.0 else 3 * NUM_BOXES),
            np.uint64(NUM_BOXES if y > 0.0 else 4 * NUM_BOXES),
            np.uint64(2 * NUM_BOXES if z > 0.0 else 5 * NUM_BOXES),
        ),
    )


@inlined
def _enter_all(
    bundle: NDArray[np.float32],
    row: int,
    ray: _BoxRay,
    span: tuple[np.float32, np.float32],
    found: NDArray[np.float32],
) -> None:
    """Fill ``found`` with where a ray enters a row's boxes, m from `SearchRay.middle`; ∞: miss."""
    miss = np.float32(np.inf)
    origin, inverse = ray.origin, ray.inverse
    ax, ay, az = ray.side
    bx, by, bz = X_SIDES - ax, Y_SIDES - ay, Z_SIDES - az
    # not NUM_BOXES: a loop of known length is unrolled, and then not vectorised
    for c in range(np.uint64(bundle.shape[1] // 8)):
        x = (bundle[row, ax + c] - origin[0]) * inverse[0]
        y = (bundle[row, ay + c] - origin[1]) * inverse[1]
        z = (bundle[row, az + c] - origin[2]) * inverse[2]
        enter = max(x, y, z, span[0])
        x = (bundle[row, bx + c] - origin[0]) * inverse[0]
        y = (bundle[row, by + c] - origin[1]) * inverse[1]
        z = (bundle[row, bz + c] - origin[2]) * inverse[2]
        leave = min(x, y, z, span[1])
        found[c] = enter if enter <= leave else miss


@inlined
def _push_entered(
    bundle: NDArray[np.float32], row: int, stack: NDArray[np.float32], top: int
) -> int:
    """Push the boxes of a row that a ray enters, far ones first; return the stack's new top."""
    miss, first = np.float32(np.inf), top
    for c in range(NUM_BOXES):
        here = stack[c]
        if here < miss:
            k = top
            while k > first and stack[k - 3] < here:
                for x in range(3):
                    stack[k + x] = stack[k - 3 + x]
                k -= 3
            stack[k] = here
            stack[k + 1], stack[k + 2] = bundle[row, LINK_COLUMN + c], bundle[row, SIZE_COLUMN + c]
            top += 3
    return top


@inlined
def nearest_hit(
    bundles: Bundles,
    begin: tuple[int, int],
    ray: SearchRay,
    wanted: int,
    stack: NDArray[np.float32],
) -> tuple[float, int]:
    """Distance and triangle of the closest hit of `EITHER_KIND`, or of any hit of one kind.

    Parameters
    ----------
    begin : first row and first triangle of the trees to be searched, in the tables of ``bundles``
    wanted : `EITHER_KIND`, `OPAQUE_KIND` or `SHEET_KIND`
    stack : working memory of `Bundles.stack_size` numbers: first the distances at which the ray
        enters the boxes of the present row, then three numbers for every box that waits: the
        distance at which the ray enters it, its link and its number of triangles

    Returns
    -------
    distance : m, `NO_HIT` without a hit
    triangle : counted from ``begin[1]``
    """
    single, bundle, triangle = np.float32, bundles.bundle, bundles.triangle
    box_ray, kind = _box_ray(ray), float(wanted)
    farthest, start = ray.span[1], single(ray.span[0] - ray.middle - SPAN_MARGIN)
    best, found, top, link, size = NO_HIT, 0, NUM_BOXES, 0, 0
    while True:
        if size > 0:
            for t in range(begin[1] + link, begin[1] + link + size):
                if wanted != EITHER_KIND and triangle[t, TRIANGLE_KIND] != kind:
                    continue
                distance = triangle_distance(triangle, t, ray.origin, ray.direction)
                if ray.span[0] < distance < farthest:
                    farthest, best, found = distance, distance, t - begin[1]
                    if wanted != EITHER_KIND:
                        return best, found
        else:
            row = begin[0] + link
            stop = single(farthest - ray.middle + SPAN_MARGIN)
            _enter_all(bundle, row, box_ray, (start, stop), stack)
            top = _push_entered(bundle, row, stack, top)
        # boxes that begin behind the nearest hit so far are dropped
        stop = single(farthest - ray.middle + SPAN_MARGIN)
        while top > NUM_BOXES and stack[top - 3] > stop:
            top -= 3
        if top == NUM_BOXES:
            return best, found
        top -= 3
        link, size = int(stack[top + 1]), int(stack[top + 2])
