"""Edges of a vehicle between a radar and another body: where waves bend around it.

The edges are those of the vehicle's outline, seen from the radar and from the body's middle. In the
upright plane through both, the top has the highest point seen from the radar and the highest seen
from the body as its corners (`_two_corners`). The sides are found likewise in the plan.
Only parts of the vehicle count that rays from the radar to the body pass, and `BAND_MARGIN` beside
them.
"""

from functools import lru_cache
from itertools import product
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.bent_echoes.edge_waves import NUM_EDGES, Edges
from polychirp.channel.scene.world import Surface, World
from polychirp.jit import compiled, inlined

GRID: Final = 0.01
"""Step, m, of the grid on which only one point of a surface is kept. Chosen: an edge is then at
most this much off, which is a tenth of a Fresnel zone at 5 m."""

BAND_MARGIN: Final = 0.1
"""Margin, m, about the rays from a radar to a body within which parts of a vehicle count as its
edge. Chosen: about a Fresnel zone at 5 m."""

LEAST_GAP: Final = 0.3
"""Least distance, m, of a vehicle from the radar and from the body onwards. Chosen: nearer, it does
not stand between them but beside them."""


HULL_STEP: Final = 0.05
"""Step of depth, m, of which only the highest point is kept for the corners of an outline. Chosen:
a roof's end is then at most this much off."""

LEAST_ROOF: Final = 0.5
"""Least distance, m, between two corners of an edge. Chosen: on a curved roof, points that are
nearer to the first one are not edges of their own."""

BLOCK_SIZE: Final = 0.25
"""Side, m, of the blocks into which a surface is divided, each of which keeps its outermost points
in 26 directions. Chosen: at half of it there are three times as many points."""


@lru_cache(maxsize=64)
def _points(surface: Surface) -> FloatArray:
    """Points of the sides of a surface's facets that may be on its outline, m in its own frame."""
    corners = _along_sides(surface.centroid[:, None] + surface.corner)
    corners = corners[_first_of_each(corners, GRID)[1]]
    block, first = _first_of_each(corners, BLOCK_SIZE)
    kept = [np.zeros(0, dtype=np.int64)]
    for direction in product((-1.0, 0.0, 1.0), repeat=3):
        order = np.lexsort([corners @ direction, block])
        kept.append(order[np.cumsum(np.bincount(block, minlength=len(first))) - 1])
    return np.asarray(corners[np.unique(np.concatenate(kept))])


def _along_sides(corner: FloatArray) -> FloatArray:
    """Points of triangles' sides, m ``(point, xyz)``: corners, and more of them on long sides.

    A band about the rays may pass between the corners of large facets. Points are as near to each
    other as the band is wide to either side.

    >>> triangle = np.array([[[0.0, 0.0, 0.0], [0.15, 0.0, 0.0], [0.0, 0.05, 0.0]]])
    >>> _along_sides(triangle)[:, 0].round(3).tolist()
    [0.0, 0.075, 0.15, 0.075, 0.0]
    """
    way = (np.roll(corner, -1, axis=1) - corner).reshape(-1, 3)
    parts = np.maximum(np.ceil(np.linalg.norm(way, axis=-1) / BAND_MARGIN), 1).astype(np.int64)
    side = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(side)) - np.repeat(np.cumsum(parts) - parts, parts)
    share = number / parts[side]
    return np.asarray(corner.reshape(-1, 3)[side] + share[:, None] * way[side])


def _first_of_each(points: FloatArray, side: float) -> tuple[IntArray, IntArray]:
    """Number of every point's cube of this side (m), and the first point of every cube."""
    cube = np.floor(points / side).astype(np.int64)
    cube -= cube.min(axis=0)
    one = np.ravel_multi_index(tuple(cube.T), tuple(cube.max(axis=0) + 1))
    _, first, number = np.unique(one, return_index=True, return_inverse=True)
    return number, first


class Way(NamedTuple):
    """The way from a radar to a body, which is the same for all vehicles that may stand in it.

    ``radar`` m is the radar's place, ``(xyz,)``, and the rows of ``frame`` ``(3, xyz)`` point to
    the body, to the left, and up. ``low`` and ``high`` m are the least and the greatest coordinates
    of the body in the frame at the radar, ``(3,)``.
    """

    radar: FloatArray
    frame: FloatArray
    low: FloatArray
    high: FloatArray


def way_to(world: World, radar: FloatArray, body: int) -> Way | None:
    """The way from a radar at ``radar`` (m) to a body; None if the radar is within its sphere."""
    way = (world.centre[body] - radar) * (1.0, 1.0, 0.0)
    distance = float(np.linalg.norm(way))
    if distance <= world.radius[body]:
        return None
    ahead = way / distance
    frame = np.array([ahead, [-ahead[1], ahead[0], 0.0], [0.0, 0.0, 1.0]])
    # numpy takes the extremes of long rows several times as fast as those of short ones
    lit = np.ascontiguousarray(_in_frame(world, body, radar, frame).T)
    return Way(radar, frame, lit.min(axis=1), lit.max(axis=1))


def edges_between(world: World, way: Way, blocker: int) -> Edges | None:
    """Edges of the body ``blocker`` on the way from a radar to another body.

    None if the blocker does not stand between them, or is far off the way.
    """
    frame, low, high = way.frame, way.low, way.high
    part = _in_frame(world, blocker, way.radar, frame)
    if part[:, 0].min() < LEAST_GAP or part[:, 0].max() > low[0] - LEAST_GAP:
        return None
    middle = 0.5 * (low + high)
    share = part[:, 0] / middle[0]
    beside = part - share[:, None] * middle
    reach = share[:, None] * (0.5 * (high - low)) + BAND_MARGIN
    is_near = np.abs(beside) <= reach
    over = part[_any_or_all(is_near[:, 1])][:, (0, 2)]
    flank = part[_any_or_all(is_near[:, 2])][:, :2]
    corner = np.empty((NUM_EDGES, 2, 2))
    for edge, (outline, sign, height) in enumerate(
        [(over, 1.0, middle[2]), (flank, 1.0, middle[1]), (flank, -1.0, -middle[1])]
    ):
        points = outline * (1.0, sign)
        corner[edge] = _two_corners(points, np.array([middle[0], height]))
    outwards = np.stack([frame[2], frame[1], -frame[1]])
    onwards = np.tile(frame[0], (NUM_EDGES, 1))
    return Edges(onwards, outwards, np.cross(onwards, outwards), corner)


def _two_corners(points: FloatArray, end: FloatArray) -> FloatArray:
    """The two points ``(2, 2)`` of an outline that shade a place ``end`` from the origin most.

    Columns are a depth and the height there, m ``(point, 2)``. The first is the highest as seen
    from the origin, and the second the highest as seen from ``end``. If these are near each other,
    that of the outline's other corners takes the place of the second which is nearest to the
    shortest path over the first, in Fresnel zones: the far end of a roof halves a wave that grazes
    it.
    """
    depth, height = points.T
    first = points[np.argmax(height / depth)]
    second = points[np.argmax((height - end[1]) / (end[0] - depth))]
    if second[0] - first[0] > LEAST_ROOF:
        return np.stack([first, second])
    # of a straight side, only its ends are corners
    depth, height = (points := _upper_hull(points)).T
    highest = second if second[1] * first[0] > first[1] * second[0] else first
    start = np.where((depth < highest[0])[:, None], 0.0, highest)
    stop = np.where((depth < highest[0])[:, None], highest, end)
    near, far = depth - start[:, 0], stop[:, 0] - depth
    slope = (stop[:, 1] - start[:, 1]) / (stop[:, 0] - start[:, 0])
    is_apart = np.abs(depth - highest[0]) > LEAST_ROOF
    if not np.any(is_apart):
        return np.stack([highest, highest])
    over = height - start[:, 1] - slope * near
    with np.errstate(divide="ignore", invalid="ignore"):
        zones = np.where(is_apart, over / np.sqrt(near * far / (near + far)), -np.inf)
    other = points[np.argmax(zones)]
    return np.stack([highest, other] if highest[0] < other[0] else [other, highest])


def _upper_hull(points: FloatArray) -> FloatArray:
    """Corners of the upper convex hull of points (depth, height) ``(point, 2)``, by depth.

    >>> _upper_hull(np.array([[1.0, 2.0], [2.0, 2.0], [3.0, 2.0], [2.5, 0.0]])).tolist()
    [[1.0, 2.0], [3.0, 2.0]]
    """
    step = np.floor(points[:, 0] / HULL_STEP).astype(np.int64)
    return points[_on_hull(points, step - np.min(step, initial=0))]


@compiled
def _on_hull(points: FloatArray, step: IntArray) -> IntArray:
    """Numbers of the corners of the upper convex hull of the highest points of all steps.

    ``step`` ``(point,)`` is the number of the step of depth that a point lies in, from 0 on.
    """
    highest = np.full(step.max() + 1, -1, dtype=np.int64)
    for number in range(len(points)):
        best = highest[step[number]]
        if best < 0 or points[number, 1] >= points[best, 1]:
            highest[step[number]] = number
    hull = np.empty(len(highest), dtype=np.int64)
    size = 0
    for number in highest:
        if number < 0:
            continue
        while size > 1 and _is_below(points, hull[size - 1], hull[size - 2], number):
            size -= 1
        hull[size] = number
        size += 1
    return hull[:size]


@inlined
def _is_below(points: FloatArray, point: int, start: int, end: int) -> bool:
    """True if a point is on the line from ``start`` to ``end`` or below it."""
    depth, height = points[start, 0], points[start, 1]
    rise = (points[point, 1] - height) * (points[end, 0] - depth)
    return bool(rise <= (points[end, 1] - height) * (points[point, 0] - depth) + 1e-9)


def _in_frame(world: World, body: int, origin: FloatArray, frame: FloatArray) -> FloatArray:
    points = _points(world.surfaces[body]) @ world.rotation[body].T + world.position[body]
    return np.asarray((points - origin) @ frame.T)


def _any_or_all(mask: BoolArray) -> BoolArray:
    return mask if np.any(mask) else np.ones_like(mask)
