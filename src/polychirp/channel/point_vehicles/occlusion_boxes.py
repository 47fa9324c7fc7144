"""Occlusion of points by plates and by vehicles, which are represented by boxes.

Boxes are opaque: there is no line of sight through windows, over bonnets or below the floor.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.scene.world import RADAR_CLEARANCE, Plates
from polychirp.jit import compiled, inner
from polychirp.model.mesh import Mesh
from polychirp.model.scene import Scene
from polychirp.threads import in_ranges

OWN_BOX_SETBACK: Final = 1e-3
"""Distance behind a radar, m, to which a face of its own vehicle's box is moved. Chosen: it is more
than the rounding errors of positions, and less than the size of any part of a vehicle."""

OWN_CORNER: Final = 0.5
"""Greatest depth of a radar behind a second face of its own vehicle's box, m, that does not hide
what the radar looks at. Chosen: boxes of the built-in bodies, which have round corners and mirrors,
are up to 0.31 m beside radars at the corners."""

LEAST_TOWARDS: Final = math.sin(math.radians(15.0))
"""Cosine of the greatest angle between a radar's axis and the normal of a second face that it looks
out of. Chosen: radars at corners are turned by some 30 to 60° from both faces."""

NO_BOX_PLACE: Final = 1e30
"""Coordinates, m, of the empty box that replaces a missing one. Chosen: no ray comes so far."""


class Boxes(NamedTuple):
    """Boxes, one per row, each in the frame of its actor.

    ``rotation`` ``(box, xyz, xyz)`` and ``position`` m ``(box, xyz)`` take a point of this frame to
    the world; ``low``, ``high`` m ``(box, xyz)`` are the box's corners in this frame; ``actor``
    ``(box,)`` is the actor's number.
    """

    rotation: FloatArray
    position: FloatArray
    low: FloatArray
    high: FloatArray
    actor: IntArray

    def select(self, number: IntArray) -> "Boxes":
        """The boxes of these numbers; a number that is repeated gives a repeated box."""
        return Boxes._make(column[number] for column in self)

    @property
    def centre(self) -> FloatArray:
        """Centres in the world, m ``(box, xyz)``."""
        middle = 0.5 * (self.low + self.high)
        return np.asarray(np.einsum("bij,bj->bi", self.rotation, middle) + self.position)

    @property
    def radius(self) -> FloatArray:
        """Radii of the spheres around the boxes, m ``(box,)``."""
        return np.asarray(0.5 * np.linalg.norm(self.high - self.low, axis=-1))


@lru_cache(maxsize=256)
def extent(mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """Low and high corner of the box around a mesh, m ``(xyz,)`` in its frame."""
    return mesh.corners.min(axis=(0, 1)), mesh.corners.max(axis=(0, 1))


def vehicle_boxes(scene: Scene) -> Boxes:
    """The boxes around the meshes of all vehicles."""
    rows = [
        (index, actor) for index, actor in enumerate(scene.actors)
        if actor.kind == "vehicle" and actor.mesh.num_faces
    ]  # fmt: skip
    corners = np.array([extent(actor.mesh) for _, actor in rows]).reshape(-1, 2, 3)
    return Boxes(
        rotation=np.array([actor.pose.rotation for _, actor in rows]).reshape(-1, 3, 3),
        position=np.array([actor.pose.position for _, actor in rows]).reshape(-1, 3),
        low=corners[:, 0],
        high=corners[:, 1],
        actor=np.array([index for index, _ in rows], dtype=np.int64),
    )


def own_boxes(scene: Scene, boxes: Boxes) -> Boxes:
    """Boxes of the radars' carriers; if a radar is inside, the nearest face moves behind it.

    A radar behind a bumper or a mirror is thus outside the box, which still hides what is on the
    vehicle's other side. A radar at a corner looks out of two faces, which both move. A carrier
    without a box has an empty one at `NO_BOX_PLACE`.
    """
    number = {int(actor): row for row, actor in enumerate(boxes.actor)}
    rows = []
    axes = scene.radar_rotation[..., 0]
    for place, axis, carrier in zip(scene.radar_position, axes, scene.carriers, strict=True):
        if carrier not in number:
            nowhere = np.full(3, NO_BOX_PLACE)
            rows.append((np.eye(3), np.zeros(3), nowhere, nowhere, carrier))
            continue
        turn, position, low, high, _ = (field[number[carrier]] for field in boxes)
        local = (place - position) @ turn
        depth = np.concatenate([local - low, high - local])
        if np.all(depth > -OWN_BOX_SETBACK):
            ahead = axis @ turn
            moves = (depth < OWN_CORNER) & (np.concatenate([-ahead, ahead]) > LEAST_TOWARDS)
            nearest = int(np.argmin(depth))
            moves[nearest], moves[(nearest + 3) % 6] = True, False
            low = np.where(moves[:3], local + OWN_BOX_SETBACK, low)
            high = np.where(moves[3:], local - OWN_BOX_SETBACK, high)
        rows.append((turn, position, low, high, carrier))
    return Boxes(
        rotation=np.array([row[0] for row in rows]).reshape(-1, 3, 3),
        position=np.array([row[1] for row in rows]).reshape(-1, 3),
        low=np.array([row[2] for row in rows]).reshape(-1, 3),
        high=np.array([row[3] for row in rows]).reshape(-1, 3),
        actor=np.array([row[4] for row in rows], dtype=np.int64),
    )


def crosses(boxes: Boxes, start: FloatArray, end: FloatArray) -> BoolArray:
    """Mask of the straight ways from ``start`` to ``end`` that enter their box, ``(box,)``.

    ``start`` and ``end`` are in the world, m ``(box, xyz)``. The method is that of slabs between
    opposite faces (Kay and Kajiya, 1986).
    """
    origin = np.einsum("bij,bi->bj", boxes.rotation, start - boxes.position)
    way = np.einsum("bij,bi->bj", boxes.rotation, end - start)
    way = np.where(np.abs(way) < 1e-12, 1e-12, way)
    first, second = (boxes.low - origin) / way, (boxes.high - origin) / way
    enter = np.max(np.minimum(first, second), axis=-1)
    leave = np.min(np.maximum(first, second), axis=-1)
    return np.asarray(np.maximum(enter, 0.0) < np.minimum(leave, 1.0))


class NearRadars(NamedTuple):
    """Numbers of obstacles within reach of each radar r: ``number[first[r]:first[r+1]]``."""

    first: IntArray
    number: IntArray


def _near_radars(place: FloatArray, centre: FloatArray, reach: FloatArray) -> NearRadars:
    gap = np.linalg.norm(place[:, None] - centre[None], axis=-1)
    radar, number = np.nonzero(gap <= reach)
    return NearRadars(np.searchsorted(radar, np.arange(len(place) + 1)), number)


@inner
def _slab(low: float, high: float, origin: float, way: float) -> tuple[float, float]:
    if abs(way) < 1e-12:
        way = 1e-12
    first, second = (low - origin) / way, (high - origin) / way
    return (first, second) if first < second else (second, first)


@inner
def _enters_box(boxes: Boxes, b: int, start: FloatArray, end: FloatArray) -> bool:
    enter, leave = 0.0, 1.0
    for axis in range(3):
        origin, way = 0.0, 0.0
        for i in range(3):
            m = boxes.rotation[b, i, axis]
            origin += m * (start[i] - boxes.position[b, i])
            way += m * (end[i] - start[i])
        a, z = _slab(boxes.low[b, axis], boxes.high[b, axis], origin, way)
        enter, leave = max(enter, a), min(leave, z)
        if not enter < leave:
            return False
    return True


@inner
def _meets_plate(
    plates: Plates, p: int, start: FloatArray, end: FloatArray, nearest: float
) -> bool:
    slope, height = 0.0, 0.0
    for i in range(3):
        slope += plates.normal[p, i] * (end[i] - start[i])
        height += plates.normal[p, i] * (start[i] - plates.centre[p, i])
    if slope == 0.0:
        return False
    t = -height / slope
    if not nearest < t < 1.0:
        return False
    u, v = 0.0, 0.0
    for i in range(3):
        gap = start[i] + t * (end[i] - start[i]) - plates.centre[p, i]
        u += plates.across[p, i] * gap
        v += plates.along[p, i] * gap
    return bool(abs(u) <= plates.half_across[p] and abs(v) <= plates.half_along[p])


class _Rays(NamedTuple):
    """Straight ways from radars to points.

    ``start`` and ``end`` m ``(ray, xyz)``; ``radar`` ``(ray,)``: number of the radar; ``spared``
    ``(ray, 2)``: numbers of the actors whose boxes do not block the ray.
    """

    start: FloatArray
    end: FloatArray
    radar: IntArray
    spared: IntArray


@compiled
def _find_blocked(
    begin: int,
    end: int,
    rays: _Rays,
    boxes: Boxes,
    ball: FloatArray,
    near_box: NearRadars,
    plates: Plates,
    near_plate: NearRadars,
    out: BoolArray,
) -> None:
    """Set ``out`` ``(ray,)`` for rays that boxes or plates within reach of their radar block.

    ``ball`` m ``(box, 4)`` holds centres and radii of the spheres around the boxes.
    """
    for row in range(begin, end):
        start, stop, r = rays.start[row], rays.end[row], rays.radar[row]
        dx, dy, dz = stop[0] - start[0], stop[1] - start[1], stop[2] - start[2]
        square = max(dx * dx + dy * dy + dz * dz, 1e-30)
        for k in range(near_plate.first[r], near_plate.first[r + 1]):
            if _meets_plate(
                plates, near_plate.number[k], start, stop, RADAR_CLEARANCE / math.sqrt(square)
            ):
                out[row] = True
                break
        if out[row]:
            continue
        for k in range(near_box.first[r], near_box.first[r + 1]):
            b = near_box.number[k]
            if boxes.actor[b] == rays.spared[row, 0] or boxes.actor[b] == rays.spared[row, 1]:
                continue
            # vector from the ray's nearest point to the sphere's centre
            gx, gy, gz = ball[b, 0] - start[0], ball[b, 1] - start[1], ball[b, 2] - start[2]
            t = min(max((gx * dx + gy * dy + gz * dz) / square, 0.0), 1.0)
            gx, gy, gz = gx - t * dx, gy - t * dy, gz - t * dz
            if gx * gx + gy * gy + gz * gz > ball[b, 3] ** 2:
                continue
            if _enters_box(boxes, b, start, stop):
                out[row] = True
                break


@dataclass(frozen=True, kw_only=True, eq=False)
class Obstacles:
    """Boxes and plates that hide points from radars.

    Parameters
    ----------
    place : positions of the radars, m ``(radar, xyz)``
    carrier : numbers of the actors that carry the radars, ``(radar,)``
    boxes : boxes of the vehicles; own : boxes of the radars' carriers, by `own_boxes`
    plates : plates in the frame of the world
    near_box, near_plate : numbers of the boxes and plates within reach of every radar
    """

    place: FloatArray
    carrier: IntArray
    boxes: Boxes
    own: Boxes
    plates: Plates
    near_box: NearRadars
    near_plate: NearRadars

    def without_plates(self) -> "Obstacles":
        """The same boxes without plates."""
        none = NearRadars(
            np.zeros(len(self.place) + 1, dtype=np.int64), np.zeros(0, dtype=np.int64)
        )
        return replace(self, near_plate=none)

    def hide(self, radar: IntArray, end: FloatArray, spared: IntArray) -> BoolArray:
        """Mask of the points ``end`` m ``(ray, xyz)`` that are hidden from ``radar`` ``(ray,)``.

        ``spared`` ``(ray,)`` are the numbers of the actors that the points are on; their boxes do
        not block.
        """
        if not len(radar):
            return np.zeros(0, dtype=np.bool_)
        start = self.place[radar]
        spheres = np.column_stack([self.boxes.centre, self.boxes.radius])
        spares = np.stack([self.carrier[radar], spared], axis=-1)
        # copies that can be written: for read-only or sliced arrays numba would compile again
        rays = _Rays(start, np.array(end, order="C"), np.array(radar), spares)
        hidden = np.zeros(len(rays.radar), dtype=np.bool_)
        near = self.near_box, self.plates, self.near_plate
        in_ranges(_find_blocked, len(hidden), rays, self.boxes, spheres, *near, hidden, least=200)
        return np.asarray(hidden | crosses(self.own.select(radar), start, end))


def obstacles_of(scene: Scene, plates: Plates, reach: float) -> Obstacles:
    """Vehicles of a scene and ``plates``, as obstacles within ``reach`` (m) of its radars."""
    boxes, place = vehicle_boxes(scene), scene.radar_position
    size = np.hypot(plates.half_across, plates.half_along)
    return Obstacles(
        place=place,
        carrier=np.array(scene.carriers, dtype=np.int64),
        boxes=boxes,
        own=own_boxes(scene, boxes),
        plates=plates,
        near_box=_near_radars(place, boxes.centre, reach + boxes.radius),
        near_plate=_near_radars(place, plates.centre, reach + size),
    )
