"""Straight lines of sight, also by way of a mirror, and what may obstruct them.

A wave that a mirror reflects on its way arrives as if it came straight from the image of its
source. We follow it in that unfolded space: the source is its image, and in front of the mirror's
plane stand the obstacles of the way behind the reflection, behind the plane the images of the same
obstacles, which are those of the way before it.
"""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.diffraction.silhouette import Obstacles
from polychirp.channel.scene.world import RADAR_CLEARANCE, ROLES, World
from polychirp.channel.specular.images import mirrored

MAX_ZONES_CLEAR: Final = 100.0
"""Number of Fresnel zones about a clear line of sight within which edges are sought. Chosen: from
half of it on, a straight edge makes less than −33 dB of the unobstructed field."""

MAX_ZONES_BLOCKED: Final = 300.0
"""The same number for a blocked line of sight. Chosen likewise, for −38 dB."""

LEAST_SLANT: Final = 1e-6
"""Sine of the angle to the vertical below which a line of sight counts as vertical. Chosen: far
above the rounding of positions."""


class Mirror(NamedTuple):
    """A plane that reflects: the ``number`` of its plate, ``centre`` m, ``normal``, ``velocity``.

    The vectors are ``(xyz,)``, in the world.
    """

    number: int
    centre: FloatArray
    normal: FloatArray
    velocity: FloatArray

    def turned(self, vector: FloatArray) -> FloatArray:
        """Images of directions, or of differences of vectors, ``(…, xyz)``."""
        return mirrored(vector, self.normal)

    def image_of(self, point: FloatArray) -> FloatArray:
        """Images of points, m ``(…, xyz)``."""
        return self.turned(point - self.centre) + self.centre

    def image_velocity(self, velocity: FloatArray) -> FloatArray:
        """Velocities of the images of what moves with ``velocity``, m/s ``(…, xyz)``."""
        return self.turned(velocity - self.velocity) + self.velocity


def mirror_of(world: World, number: int) -> Mirror:
    """The plate of this number as a mirror."""
    plates = world.plates
    carrier = world.scene.actors[plates.actor[number]]
    return Mirror(number, plates.centre[number], plates.normal[number], carrier.velocity)


class Line(NamedTuple):
    """Line of sight from one radar to another, or by way of a ``mirror`` in its unfolded space.

    ``place`` m, ``velocity`` m/s and ``acceleration`` m/s² are those of both ends, ``(2, xyz)``;
    with a mirror, those of the image of the first radar. ``is_clear`` if nothing opaque is on it.
    """

    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    is_clear: bool
    mirror: Mirror | None = None

    @property
    def length(self) -> float:
        """Distance between the ends, m."""
        return float(np.linalg.norm(self.place[1] - self.place[0]))

    @property
    def opening(self) -> float:
        """Rate of ``length``, m/s."""
        way, speed = self.place[1] - self.place[0], self.velocity[1] - self.velocity[0]
        return float(way @ speed) / self.length

    def max_excess(self, wavenumber: float) -> float:
        """Excess up to which edges are sought, m; ``wavenumber`` in 1/m."""
        zones = MAX_ZONES_CLEAR if self.is_clear else MAX_ZONES_BLOCKED
        return zones * float(np.pi / wavenumber)


def line_between(world: World, first: int, second: int, is_clear: bool) -> Line:
    """Line of sight from one radar to another."""
    scene, ends = world.scene, [first, second]
    place, speed, swerve = scene.radar_position, scene.radar_velocity, scene.radar_acceleration
    return Line(place[ends], speed[ends], swerve[ends], is_clear)


def line_by_mirror(world: World, first: int, second: int, mirror: Mirror, is_clear: bool) -> Line:
    """Line of sight from the image of one radar in a mirror to another radar."""
    line = line_between(world, first, second, is_clear)
    place, speed, swerve = line.place.copy(), line.velocity.copy(), line.acceleration.copy()
    place[0], swerve[0] = mirror.image_of(place[0]), mirror.turned(swerve[0])
    speed[0] = mirror.image_velocity(speed[0])
    return Line(place, speed, swerve, is_clear, mirror)


class Obstructing(NamedTuple):
    """Numbers of the bodies and plates that may obstruct a line, themselves or by their images."""

    bodies: IntArray
    plates: IntArray

    @property
    def is_empty(self) -> bool:
        """True if nothing may obstruct the line."""
        return not (len(self.bodies) or len(self.plates))


def obstructing(world: World, line: Line) -> tuple[Obstructing, ...]:
    """Obstacles of a line; of a line by a mirror, also those that obstruct it by their images."""
    if line.mirror is None:
        return (_within_zones(world, line, line.place),)
    here = _within_zones(world, line, line.place, line.mirror)
    # to the ends, an image is what the thing itself is to the ends' images
    return here, _within_zones(world, line, line.mirror.image_of(line.place), line.mirror)


def _within_zones(
    world: World, line: Line, ends: FloatArray, mirror: Mirror | None = None
) -> Obstructing:
    """Bodies and plates in the zones that are searched about the line from end to end."""
    plates = world.plates
    reach = line.length + line.max_excess(world.wavenumber)

    def meets(centre: FloatArray, radius: FloatArray) -> BoolArray:
        way = sum(np.linalg.norm(end - centre, axis=-1) for end in ends)
        return np.asarray((way - 2 * radius <= reach) & (line.length > 2 * RADAR_CLEARANCE))

    heights = [np.sum((end - plates.centre) * plates.normal, axis=-1) for end in ends]
    is_between = (heights[0] * heights[1] < 0) & ~world.plate_is_pane
    size = np.hypot(plates.half_across, plates.half_along)
    bodies = meets(world.centre, world.radius)
    is_between &= meets(plates.centre, size)
    if mirror is not None:
        bodies &= (world.centre - mirror.centre) @ mirror.normal > 0
        bodies &= world.body != plates.actor[mirror.number]
        is_between &= (plates.centre - mirror.centre) @ mirror.normal > 0
        is_between[mirror.number] = False
    return Obstructing(_hiding_most_first(world, ends, bodies), np.flatnonzero(is_between))


def _hiding_most_first(world: World, ends: FloatArray, chosen: BoolArray) -> IntArray:
    """Numbers of the chosen bodies: on the line of sight first, then nearest to an end first."""
    centre = world.centre[chosen]
    legs = [np.linalg.norm(centre - place, axis=-1) for place in ends]
    is_on = legs[0] + legs[1] < np.linalg.norm(ends[1] - ends[0]) + world.radius[chosen]
    return np.flatnonzero(chosen)[np.lexsort([np.minimum(*legs), ~is_on])]


def rotation_to(axis: FloatArray) -> FloatArray:
    """Rotation matrix into a frame whose first axis is ``axis``; its rows are the axes.

    Its second axis is horizontal, so that half-planes about lines of sight are the same in streets
    of every direction, and mirrored in mirrored streets.
    """
    is_upright = np.hypot(axis[0], axis[1]) < LEAST_SLANT
    spare = np.array([1.0, 0.0, 0.0] if is_upright else [0.0, 0.0, 1.0])
    side = np.cross(axis, spare)
    side = side / np.linalg.norm(side)
    return np.stack([axis, side, np.cross(axis, side)])


def obstacles_on(
    world: World, line: Line, rotation: FloatArray, some: tuple[Obstructing, ...]
) -> Obstacles:
    """The bodies and plates of `obstructing` in the frame at the line's first end.

    ``rotation`` holds its axes. Bodies come first and then plates, in either case images last.
    """
    origin = line.place[0]
    tables = [obstacles_of(world, rotation, origin, *some[0])]
    if line.mirror is not None:
        # an image in this frame is the thing itself in the image of the frame
        turn, place = line.mirror.turned(rotation), line.mirror.image_of(origin)
        tables.append(obstacles_of(world, turn, place, *some[1]))
    joined = {
        name: np.concatenate([getattr(table, name) for table in tables])
        for name in ("nodes", "turn", "shift", "sheet")
    }
    return tables[0]._replace(**joined)


def obstacles_of(
    world: World, rotation: FloatArray, origin: FloatArray, bodies: IntArray, plates: IntArray
) -> Obstacles:
    """Bodies and plates of these numbers in the frame at ``origin`` (m) with axes ``rotation``."""
    forest = world.forest
    opaque = forest.root[ROLES.index("opaque")]
    some = world.plates.of(plates)
    across = some.half_across[:, None] * some.across
    along = some.half_along[:, None] * some.along
    corner = [
        (some.centre + u * across + v * along - origin) @ rotation.T
        for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    halves = [
        np.concatenate([corner[i] for i in three], axis=-1) for three in ((0, 1, 2), (0, 2, 3))
    ]
    return Obstacles(
        box=forest.tree.box,
        skip=forest.tree.skip,
        first=forest.tree.first,
        size=forest.tree.size,
        triangle=forest.tree.triangle,
        nodes=opaque[bodies],
        turn=np.ascontiguousarray(rotation @ world.rotation[bodies]),
        shift=np.ascontiguousarray((world.position[bodies] - origin) @ rotation.T),
        sheet=np.stack(halves, axis=1).reshape(-1, 9),
    )
