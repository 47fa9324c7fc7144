"""Closest hit and occlusion of rays among triangles: a tree of boxes, in double precision.

The tree is stored depth first. Every node holds the number of the node to continue with if its
box is missed (`Tree.skip`); otherwise the search continues with the next node. A traversal is
therefore a loop without a stack.
"""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, row
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

LEAF_SIZE: Final = 4
"""Greatest number of triangles in a leaf. Chosen: with larger leaves a ray tests fewer boxes and
more triangles."""

NUM_BINS: Final = 16
"""Number of bins along each axis; a node is split between two of them. Chosen: more bins find
better splits and take longer."""

BOX_MARGIN: Final = 1e-9
"""Enlargement of boxes on all sides, m, so that a ray along a side of a box is in it. Chosen: far
above rounding errors, and far below a wavelength."""

EDGE_TOLERANCE: Final = 1e-11
"""Share of an edge by which a hit may be outside of a triangle, so that no ray slips through
between two. Chosen: rounding errors are 1e-13 for edges of 5 cm, met upright 20 m away, and grow
with the inverse cosine."""

NO_HIT: Final = np.inf
"""Distance of a ray that hits nothing."""


class Tree(NamedTuple):
    """Boxes over triangles.

    ``box`` m ``(node, 6)``: low, then high corner; ``skip`` ``(node,)``: node to continue with
    if a ray misses the box; ``first``, ``size`` ``(node,)``: first triangle and number of triangles
    of a leaf (size 0: not a leaf); ``triangle`` m ``(triangle, 9)``: a corner and the edges from it
    to the others; ``face`` ``(triangle,)``: the triangle's number in the input of `grow_tree`.
    """

    box: FloatArray
    skip: IntArray
    first: IntArray
    size: IntArray
    triangle: FloatArray
    face: IntArray


class Boxes(NamedTuple):
    """The tables of a `Tree` that a search needs; several trees may follow one another in them."""

    box: FloatArray
    skip: IntArray
    first: IntArray
    size: IntArray
    triangle: FloatArray


@inner
def _bounds(low: FloatArray, high: FloatArray, order: IntArray, box: FloatArray) -> None:
    """Fill ``box`` with the box around the triangles whose numbers are in ``order``."""
    box[:3], box[3:] = np.inf, -np.inf
    for t in order:
        for a in range(3):
            box[a] = min(box[a], low[t, a])
            box[3 + a] = max(box[3 + a], high[t, a])


@inner
def _half_area(box: FloatArray) -> float:
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x if x >= 0.0 else 0.0


@inner
def _fill_bins(
    low: FloatArray,
    high: FloatArray,
    order: IntArray,
    axis: int,
    boxes: FloatArray,
    counts: IntArray,
) -> tuple[float, float]:
    """Sort triangles by their middles into bins along an axis; return the bins' start and width."""
    least, most = np.inf, -np.inf
    for t in order:
        middle = 0.5 * (low[t, axis] + high[t, axis])
        least, most = min(least, middle), max(most, middle)
    width = (most - least) / NUM_BINS
    boxes[:, :3], boxes[:, 3:], counts[:] = np.inf, -np.inf, 0
    if width <= 1e-12:
        return least, 0.0
    for t in order:
        b = _bin(low, high, t, axis, least, width)
        counts[b] += 1
        for a in range(3):
            boxes[b, a] = min(boxes[b, a], low[t, a])
            boxes[b, 3 + a] = max(boxes[b, 3 + a], high[t, a])
    return least, width


@inner
def _bin(low: FloatArray, high: FloatArray, t: int, axis: int, least: float, width: float) -> int:
    middle = 0.5 * (low[t, axis] + high[t, axis])
    return min(NUM_BINS - 1, int((middle - least) / width))


@inner
def _costs(boxes: FloatArray, counts: IntArray, out: FloatArray) -> None:
    """Cost of the first 1, 2, … bins: half the area of their box times the number of triangles."""
    grow = np.empty(6)
    grow[:3], grow[3:], total = np.inf, -np.inf, 0
    for b in range(NUM_BINS):
        for a in range(3):
            grow[a] = min(grow[a], boxes[b, a])
            grow[3 + a] = max(grow[3 + a], boxes[b, 3 + a])
        total += counts[b]
        out[b] = total * _half_area(grow)


@inner
def _split(low: FloatArray, high: FloatArray, order: IntArray) -> int:
    """Sort ``order`` into two parts of least surface-area cost; return the first part's size."""
    best_cost, best_axis, best_edge, best_least, best_width = np.inf, 0, 0, 0.0, 0.0
    boxes = np.empty((NUM_BINS, 6))
    counts = np.empty(NUM_BINS, dtype=np.int64)
    left, right = np.empty(NUM_BINS), np.empty(NUM_BINS)
    for axis in range(3):
        least, width = _fill_bins(low, high, order, axis, boxes, counts)
        if width == 0.0:
            continue
        _costs(boxes, counts, left)
        _costs(boxes[::-1], counts[::-1], right)
        # neither part is empty: the first and the last bin hold at least one triangle each
        for edge in range(NUM_BINS - 1):
            cost = left[edge] + right[NUM_BINS - 2 - edge]
            if cost < best_cost:
                best_cost, best_axis, best_edge = cost, axis, edge
                best_least, best_width = least, width
    if best_cost == np.inf:
        return int(order.size // 2)
    kept = np.empty(order.size, dtype=np.int64)
    front, back = 0, order.size
    for t in order:
        if _bin(low, high, t, best_axis, best_least, best_width) <= best_edge:
            kept[front] = t
            front += 1
        else:
            back -= 1
            kept[back] = t
    # not order[:] = kept: compiling its error message for unlike shapes takes 2 s
    for i in range(order.size):
        order[i] = kept[i]
    return front


@compiled
def _grow_tree(
    low: FloatArray, high: FloatArray
) -> tuple[FloatArray, IntArray, IntArray, IntArray, IntArray]:
    """`Tree.box`, ``skip``, ``first`` and ``size``, and the numbers of the sorted triangles."""
    size = low.shape[0]
    most = 2 * size + 1
    box = np.empty((most, 6))
    skip = np.empty(most, dtype=np.int64)
    first = np.zeros(most, dtype=np.int64)
    count = np.zeros(most, dtype=np.int64)
    order = np.arange(size)
    # subtrees still to be built: their ranges in ``order``, and their parent nodes
    begin, end, parent = [0], [size], [0]
    num = 0
    owner = np.zeros(most, dtype=np.int64)
    while len(begin) > 0:
        a, b, p = begin.pop(), end.pop(), parent.pop()
        node = num
        num += 1
        owner[node] = p
        _bounds(low, high, order[a:b], box[node])
        if b - a <= LEAF_SIZE:
            first[node], count[node] = a, b - a
            continue
        middle = a + _split(low, high, order[a:b])
        for start, stop in ((middle, b), (a, middle)):
            begin.append(start)
            end.append(stop)
            parent.append(node)
    # a node's ``skip`` is the number after its last descendant
    for node in range(num):
        skip[node] = node + 1
    for node in range(num - 1, 0, -1):
        skip[owner[node]] = max(skip[owner[node]], skip[node])
    return box[:num], skip[:num], first[:num], count[:num], order


def grow_tree(triangles: FloatArray) -> Tree:
    """Tree of triangles, m ``(triangle, corner, xyz)``; without triangles it is one empty box."""
    corners = np.ascontiguousarray(triangles, dtype=np.float64).reshape(-1, 3, 3)
    # corner by corner: NumPy's minimum along an axis of length three takes ten times as long
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    low = np.minimum(np.minimum(a, b), c) - BOX_MARGIN
    high = np.maximum(np.maximum(a, b), c) + BOX_MARGIN
    box, skip, first, count, order = _grow_tree(low, high)
    ordered = corners[order]
    edges = ordered[:, 1:] - ordered[:, :1]
    # copies, since the tables were made for twice as many nodes as triangles
    return Tree(
        box=box.copy(),
        skip=skip.copy(),
        first=first.copy(),
        size=count.copy(),
        triangle=np.concatenate([ordered[:, 0], edges[:, 0], edges[:, 1]], axis=1),
        face=order,
    )


@inlined
def finite_inverse(x: float) -> float:
    """1/x, but 1e300 near x = 0: a ray along a side of a box must not give 0·∞."""
    return 1.0 / x if abs(x) > 1e-300 else 1e300


@inlined
def box_entry(
    box: FloatArray, node: int, origin: Vector, inverse: Vector, span: tuple[float, float]
) -> float:
    """Distance at which a ray enters a box, in lengths of its direction; ∞ if not in ``span``."""
    a, b = (box[node, 0] - origin[0]) * inverse[0], (box[node, 3] - origin[0]) * inverse[0]
    enter, leave = min(a, b), max(a, b)
    a, b = (box[node, 1] - origin[1]) * inverse[1], (box[node, 4] - origin[1]) * inverse[1]
    enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    a, b = (box[node, 2] - origin[2]) * inverse[2], (box[node, 5] - origin[2]) * inverse[2]
    enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    # the slack exceeds rounding errors, which could make a ray miss a flat box
    slack = 1e-12 * (abs(enter) + abs(leave))
    if enter > leave + slack or leave + slack < span[0] or enter - slack > span[1]:
        return np.inf
    return float(enter - slack)


@inlined
def triangle_distance(triangle: FloatArray, t: int, origin: Vector, direction: Vector) -> float:
    """Distance at which a ray meets a triangle, in lengths of its direction; `NO_HIT` for a miss.

    The method is that of Möller and Trumbore (1997). Distances behind the origin are negative. A
    ray through an edge that two triangles share meets both of them.
    """
    dx, dy, dz = direction
    ux, uy, uz = triangle[t, 3], triangle[t, 4], triangle[t, 5]
    vx, vy, vz = triangle[t, 6], triangle[t, 7], triangle[t, 8]
    px, py, pz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
    volume = ux * px + uy * py + uz * pz
    if volume == 0.0:
        return NO_HIT
    scale = 1.0 / volume
    sx, sy = origin[0] - triangle[t, 0], origin[1] - triangle[t, 1]
    sz = origin[2] - triangle[t, 2]
    alpha = (sx * px + sy * py + sz * pz) * scale
    if alpha < -EDGE_TOLERANCE or alpha > 1.0 + EDGE_TOLERANCE:
        return NO_HIT
    qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
    beta = (dx * qx + dy * qy + dz * qz) * scale
    if beta < -EDGE_TOLERANCE or alpha + beta > 1.0 + EDGE_TOLERANCE:
        return NO_HIT
    return float((vx * qx + vy * qy + vz * qz) * scale)


@inlined
def first_hit(
    boxes: Boxes,
    nodes: tuple[int, int],
    origin: Vector,
    direction: Vector,
    span: tuple[float, float],
    any_hit: bool,
) -> tuple[float, int]:
    """Distance (in lengths of ``direction``) and triangle of the first hit strictly in ``span``.

    Nodes from ``nodes[0]`` up to, not including, ``nodes[1]`` are searched. Without a hit the
    distance is `NO_HIT`. If ``any_hit`` is true, the search returns the first hit that it finds.
    """
    box, skip, first, size, triangle = boxes
    dx, dy, dz = direction
    inverse = (finite_inverse(dx), finite_inverse(dy), finite_inverse(dz))
    nearest, farthest = span
    node, stop = nodes
    found, best = 0, NO_HIT
    while node < stop:
        if box_entry(box, node, origin, inverse, (nearest, farthest)) == np.inf:
            node = skip[node]
            continue
        for t in range(first[node], first[node] + size[node]):
            distance = triangle_distance(triangle, t, origin, direction)
            if nearest < distance < farthest:
                if any_hit:
                    return distance, t
                farthest, best, found = distance, distance, t
        node += 1
    return best, found


@compiled
def _cast(
    begin: int,
    end: int,
    tree: Tree,
    rays: tuple[FloatArray, FloatArray],
    farthest: float,
    any_hit: bool,
    distance: FloatArray,
    face: IntArray,
) -> None:
    origins, directions = rays
    boxes = Boxes(tree.box, tree.skip, tree.first, tree.size, tree.triangle)
    nodes, span = (0, tree.skip.size), (0.0, farthest)
    for i in range(begin, end):
        distance[i], t = first_hit(boxes, nodes, row(origins, i), row(directions, i), span, any_hit)
        face[i] = tree.face[t]


class Caster:
    """Search tree of triangles, m ``(triangle, corner, xyz)``, that finds what rays hit.

    >>> caster = Caster(np.array([[[1.0, -1, -1], [1.0, 1, -1], [1.0, 0, 1]]]))
    >>> distance, face = caster.closest(np.zeros((1, 3)), np.array([[1.0, 0, 0]]))
    >>> float(distance[0]), int(face[0])
    (1.0, 0)
    >>> caster.occluded(np.zeros((1, 3)), np.array([[0.5, 0, 0]]))
    array([False])
    """

    def __init__(self, triangles: FloatArray) -> None:
        self._tree = grow_tree(triangles)

    def closest(self, origins: FloatArray, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance, m ``(ray,)``, infinite for a miss, and triangle ``(ray,)`` of the first hit.

        The triangle of a miss has no meaning. Directions ``(ray, xyz)`` may have any length.
        """
        start, way = paired_rays(origins, directions)
        if not self._tree.face.size:
            return np.full(len(start), NO_HIT), np.zeros(len(start), dtype=np.int64)
        distance, face = self._cast((start, way), NO_HIT, any_hit=False)
        return distance * np.linalg.norm(way, axis=-1), face

    def occluded(self, origins: FloatArray, ends: FloatArray) -> BoolArray:
        """Mask of the rays with a triangle strictly between origin and end, m ``(ray, xyz)``."""
        start, stop = paired_rays(origins, ends)
        if not self._tree.face.size:
            return np.zeros(len(start), dtype=np.bool_)
        return np.asarray(np.isfinite(self._cast((start, stop - start), 1.0, any_hit=True)[0]))

    def _cast(
        self, rays: tuple[FloatArray, FloatArray], farthest: float, *, any_hit: bool
    ) -> tuple[FloatArray, IntArray]:
        """Distances, in lengths of the directions, and triangles that the rays hit."""
        count = len(rays[0])
        distance, face = np.empty(count), np.empty(count, dtype=np.int64)
        in_ranges(_cast, count, self._tree, rays, farthest, any_hit, distance, face, least=100)
        return distance, face


def paired_rays(origins: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Origins and ends (or directions) of rays, broadcast to a common ``(ray, xyz)`` in float64."""
    both = np.broadcast_arrays(
        np.asarray(origins, dtype=np.float64), np.asarray(others, dtype=np.float64)
    )
    return np.ascontiguousarray(both[0]), np.ascontiguousarray(both[1])
