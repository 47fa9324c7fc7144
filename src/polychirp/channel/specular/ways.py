"""Shortest ways from radar to radar over a finite plate, for waves that it reflects once.

The length of the way from a point S over a point of a plane to a point X is a convex function of
the point on the plane, so that one point of a rectangle has the shortest way. It is the mirror
point if that lies on the plate, and otherwise a point of a side or a corner. It moves without jumps
while S, X and the plate move, and so do the way's delay, range rate and directions.
"""

from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.retarded_delay import (
    range_acceleration,
    retarded_leg,
    turning,
)
from polychirp.channel.scene.world import Plates, World
from polychirp.channel.specular.images import image_of, image_velocity, mirrored
from polychirp.constants import SPEED_OF_LIGHT


class Ways(NamedTuple):
    """Shortest ways over ``plates``, one per path.

    ``pair`` (transmitter, receiver) ``(path, 2)``; ``point`` of the plate, m ``(path, xyz)``;
    ``leaving`` and ``flight``, the unit directions before and after it; ``legs``, their lengths, m
    ``(path, 2)``; ``detour`` m of the ways that touch the plate's `Sides`; ``delay`` s with its
    rate and acceleration; ``turns`` 1/s, the rates of both directions, ``(path, 2, xyz)``.
    """

    pair: IntArray
    plates: Plates
    point: FloatArray
    leaving: FloatArray
    flight: FloatArray
    legs: FloatArray
    detour: FloatArray
    delay: FloatArray
    delay_rate: FloatArray
    delay_acceleration: FloatArray
    turns: FloatArray

    @property
    def cosine(self) -> FloatArray:
        """Cosines of the angles of both legs to the plates' normals, ``(path, 2)``."""
        ways = np.stack([self.leaving, self.flight], axis=1)
        return np.asarray(np.abs(np.sum(ways * self.plates.normal[:, None], axis=-1)))


def joined(first: Ways, second: Ways) -> Ways:
    """The ways of two tables."""
    plates = Plates._make(map(np.concatenate, zip(first.plates, second.plates, strict=True)))
    columns = (
        plates if isinstance(one, Plates) else np.concatenate([one, other])
        for one, other in zip(first, second, strict=True)
    )
    return Ways._make(columns)


class Sides(NamedTuple):
    """The shortest ways that touch a plate's sides, ``(path, axis, 2)``, the lower side first.

    The sides of an axis are those that limit it: ``across`` is the first axis, ``along`` the
    second. ``point`` m ``(path, axis, 2, xyz)`` is where a way touches, ``length`` m the way's.
    """

    point: FloatArray
    length: FloatArray


def mirror_points(plates: Plates, source: FloatArray, sink: FloatArray) -> FloatArray:
    """Points where the plates' planes mirror ``source`` to ``sink``, m ``(path, xyz)``."""
    image = image_of(source, plates)
    below = np.sum((plates.centre - image) * plates.normal, axis=-1)
    above = np.sum((sink - image) * plates.normal, axis=-1)
    return np.asarray(image + (below / above)[:, None] * (sink - image))


def is_on_plates(plates: Plates, point: FloatArray) -> BoolArray:
    """Mask ``(path,)`` of the points of the plates' planes that lie on the plates."""
    gap = point - plates.centre
    return np.asarray(
        (np.abs(np.sum(gap * plates.across, axis=-1)) <= plates.half_across)
        & (np.abs(np.sum(gap * plates.along, axis=-1)) <= plates.half_along)
    )


def mirrored_ways(world: World, pair: IntArray, plates: Plates) -> Ways:
    """Ways over the mirror points, which are taken to lie on the plates."""
    scene = world.scene
    place, speed, swerve = scene.radar_position, scene.radar_velocity, scene.radar_acceleration
    source, sink = place[pair[:, 0]], place[pair[:, 1]]
    image = image_of(source, plates)
    image_speed = image_velocity(world, plates, speed[pair[:, 0]])
    delay, delay_rate, flight = retarded_leg(
        source=image,
        source_velocity=image_speed,
        sink=sink,
        sink_velocity=speed[pair[:, 1]],
    )
    leaving = mirrored(flight, plates.normal)
    length, velocity = delay * SPEED_OF_LIGHT, speed[pair[:, 1]] - image_speed
    turn = turning(flight, length, velocity)
    bend = range_acceleration(sink - image, velocity)
    bend += np.sum(flight * swerve[pair[:, 1]] - leaving * swerve[pair[:, 0]], axis=-1)
    meet = mirror_points(plates, source, sink)
    shortest = np.linalg.norm(sink - image, axis=-1)
    before = np.linalg.norm(meet - image, axis=-1) / shortest
    return Ways(
        pair=pair,
        plates=plates,
        point=meet,
        leaving=leaving,
        flight=flight,
        legs=np.stack([before, 1 - before], axis=-1) * length[:, None],
        detour=sides_of(plates, source, sink).length - shortest[:, None, None],
        delay=delay,
        delay_rate=delay_rate,
        delay_acceleration=bend / SPEED_OF_LIGHT,
        turns=np.stack([mirrored(turn, plates.normal), turn], axis=1),
    )


def side_ways(world: World, pair: IntArray, plates: Plates) -> Ways:
    r"""Ways over the plates' sides, of plates beside which the mirror points lie.

    A point of a side that is no corner moves along the side while the radars move. The way is
    shortest, so that this changes its length to second order only:

    .. math:: \ddot L = \ddot L_{\text{fixed point}} - \dot s^2 / c

    with the slope s and the curvature c of the length over the position along the side.
    """
    scene = world.scene
    place, speed, swerve = scene.radar_position, scene.radar_velocity, scene.radar_acceleration
    source, sink = place[pair[:, 0]], place[pair[:, 1]]
    carried = np.array([actor.velocity for actor in scene.actors])[plates.actor]
    sides = sides_of(plates, source, sink)
    point, line = _nearest_of_sides(plates, sides, mirror_points(plates, source, sink))
    shortest = np.linalg.norm(point - source, axis=-1) + np.linalg.norm(sink - point, axis=-1)
    late, late_rate, flight = retarded_leg(
        source=point, source_velocity=carried, sink=sink, sink_velocity=speed[pair[:, 1]]
    )
    early, early_rate, leaving = retarded_leg(
        source=source,
        source_velocity=speed[pair[:, 0]],
        sink=point,
        sink_velocity=carried,
        later_delay=late,
        later_delay_rate=late_rate,
    )
    legs = np.stack([early, late], axis=-1) * SPEED_OF_LIGHT
    out, back = carried - speed[pair[:, 0]], speed[pair[:, 1]] - carried
    bend = range_acceleration(point - source, out) + range_acceleration(sink - point, back)
    bend += np.sum(flight * swerve[pair[:, 1]] - leaving * swerve[pair[:, 0]], axis=-1)
    # at a corner the line is zero: the point stays
    turn = turning(leaving, legs[:, 0], out) - turning(flight, legs[:, 1], back)
    slope_rate = np.sum(line * turn, axis=-1)
    cross = [np.sum(np.cross(way, line) ** 2, axis=-1) for way in (leaving, flight)]
    curvature = cross[0] / legs[:, 0] + cross[1] / legs[:, 1]
    slide = -slope_rate / np.where(curvature > 0, curvature, np.inf)
    bend += slope_rate * slide
    moved = slide[:, None] * line
    turns = turning(leaving, legs[:, 0], out + moved), turning(flight, legs[:, 1], back - moved)
    return Ways(
        pair=pair,
        plates=plates,
        point=point,
        leaving=leaving,
        flight=flight,
        legs=legs,
        detour=sides.length - shortest[:, None, None],
        delay=early + late,
        delay_rate=early_rate + late_rate,
        delay_acceleration=bend / SPEED_OF_LIGHT,
        turns=np.stack(turns, axis=1),
    )


def sides_of(plates: Plates, source: FloatArray, sink: FloatArray) -> Sides:
    """Shortest ways from ``source`` to ``sink``, m ``(path, xyz)``, that touch the plates' sides.

    A way that touches an endless line is shortest where both of its legs make the same angle with
    the line. If that point is beyond an end of the side, the end is nearest.
    """
    axes = np.stack([plates.across, plates.along], axis=1)
    halves = np.stack([plates.half_across, plates.half_along], axis=1)
    step = (halves[..., None] * axes)[:, :, None] * np.array([-1.0, 1.0])[:, None]
    middle = plates.centre[:, None, None] + step
    line, reach = axes[:, ::-1, None], halves[:, ::-1, None]
    gaps = [end[:, None, None] - middle for end in (source, sink)]
    rise = [np.sum(gap * line, axis=-1) for gap in gaps]
    off = [
        np.linalg.norm(gap - up[..., None] * line, axis=-1)
        for gap, up in zip(gaps, rise, strict=True)
    ]
    place = (rise[0] * off[1] + rise[1] * off[0]) / (off[0] + off[1])
    place = np.clip(place, -reach, reach)
    length = [np.hypot(up - place, far) for up, far in zip(rise, off, strict=True)]
    return Sides(middle + place[..., None] * line, length[0] + length[1])


def at_sides(plates: Plates, point: FloatArray) -> BoolArray:
    """Mask ``(path, axis, 2)`` of the sides on which points of the plates lie."""
    gap = point - plates.centre
    place = np.stack([np.sum(gap * axis, axis=-1) for axis in (plates.across, plates.along)], -1)
    half = np.stack([plates.half_across, plates.half_along], axis=-1) * (1 - 1e-9)
    return np.stack([place <= -half, place >= half], axis=-1)


def _nearest_of_sides(
    plates: Plates, sides: Sides, meet: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points of the plates with the shortest way, if the mirror points ``meet`` are beside them.

    Returns
    -------
    point : m, ``(path, xyz)``
    line : direction of the side on which the point lies, ``(path, xyz)``; zero at a corner
    """
    beyond = at_sides(plates, meet)
    # the nearest point lies on a side that is passed on the way to the mirror point
    best = np.argmin(np.where(beyond, sides.length, np.inf).reshape(len(meet), 4), axis=-1)
    point = sides.point.reshape(-1, 4, 3)[np.arange(len(meet)), best]
    is_corner = np.all(np.any(at_sides(plates, point), axis=-1), axis=-1)
    line = np.where((best < 2)[:, None], plates.along, plates.across)
    return point, np.where(is_corner[:, None], 0.0, line)
