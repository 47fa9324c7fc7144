"""Paths over the edges about one line of sight, made from the moments of their waves.

As in `physical_optics.paths`, the edge waves of every actor are summed in smooth cells of excess
length, with complex moments that are exact to first order in frequency, aperture and time. An actor
and its image in a mirror have cells of their own.
"""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.diffraction.edge_waves import (
    EXCESS_CELL_LENGTH,
    FIELD,
    MEAN_EXCESS,
    OUTWARD,
    PLACE,
    RATE,
    RETURN,
    SQUARED_RATE,
    WEIGHT,
    EdgeWaves,
    LinkFrame,
    edge_waves,
)
from polychirp.channel.diffraction.sight_lines import (
    Line,
    Obstructing,
    obstacles_on,
    rotation_to,
)
from polychirp.channel.geometry.retarded_delay import range_acceleration, turning
from polychirp.channel.scene.world import World

LEAST_OFFSET: Final = 0.5
"""Least distance of a mean edge point from the line, over that of an edge of its excess, for a
single edge. Chosen: it is 1 for one edge, and 0 for two that are alike on both sides."""


class EdgePaths(NamedTuple):
    """Paths from a line's first end to its second.

    ``field`` complex, relative to the unobstructed one; ``excess`` m; ``rate`` m/s and
    ``acceleration`` m/s² of the path's length; ``coherence_time`` s; ``drift`` 1/s, relative rate
    of the field; ``actor`` number of the edge's actor; ``is_image`` if the edge is the image of the
    actor's in the line's mirror; all ``(path,)``. ``out`` and ``back`` are mean directions from the
    first and from the second end, which turn by ``out_rate`` and ``back_rate``, 1/s; ``point`` m is
    a mean edge point; these are in the line's unfolded space, ``(path, xyz)``.
    """

    field: ComplexArray
    excess: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    coherence_time: FloatArray
    drift: ComplexArray
    out: FloatArray
    back: FloatArray
    out_rate: FloatArray
    back_rate: FloatArray
    point: FloatArray
    actor: IntArray
    is_image: BoolArray

    def select(self, which: BoolArray) -> "EdgePaths":
        """The paths marked in ``which`` ``(path,)``."""
        return EdgePaths._make(column[which] for column in self)


class _Owners(NamedTuple):
    """Actors whose edges are summed apart: their ``actor`` numbers, and whether it is the image.

    ``slot`` is the row of these of every obstacle, in the order of `obstacles_on`.
    """

    actor: IntArray
    is_image: BoolArray
    slot: IntArray


def edge_paths(world: World, line: Line, some: tuple[Obstructing, ...]) -> EdgePaths:
    """Paths from a line's first end to its second over edges of ``some`` obstacles."""
    rotation = rotation_to((line.place[1] - line.place[0]) / line.length)
    owners = _owners_of(world, some)
    seen = [
        (_motion(world, line, owners.actor, owners.is_image, place)[0] - velocity) @ rotation.T
        for place, velocity in zip(line.place, line.velocity, strict=True)
    ]
    frame = LinkFrame(
        length=line.length,
        farthest=line.max_excess(world.wavenumber),
        wavenumber=world.wavenumber,
        from_sender=np.ascontiguousarray(seen[0]),
        from_receiver=np.ascontiguousarray(seen[1]),
    )
    obstacles = obstacles_on(world, line, rotation, some)
    waves = edge_waves(obstacles, owners.slot, line.is_clear, frame)
    return _from_moments(world, line, waves, frame, rotation, owners)


def _owners_of(world: World, some: tuple[Obstructing, ...]) -> _Owners:
    """The actors of ``some`` obstacles, of which the second ones are there by their images."""
    rows = [world.body[one.bodies] for one in some]
    # a plate is two triangles
    rows += [np.repeat(world.plates.actor[one.plates], 2) for one in some]
    is_image = [*range(len(some)), *range(len(some))]
    images = np.repeat(is_image, [len(row) for row in rows])
    pairs = np.stack([np.concatenate(rows), images], axis=-1)
    kinds, slot = np.unique(pairs, axis=0, return_inverse=True)
    return _Owners(kinds[:, 0], kinds[:, 1] > 0, slot.reshape(-1).astype(np.int64))


def _motion(
    world: World, line: Line, actor: IntArray, is_image: BoolArray, point: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Velocities and accelerations of actors' matter, or of its images, ``(row, xyz)``.

    ``point`` m, ``(row, xyz)`` or one for all, is in the line's unfolded space.
    """
    there = np.broadcast_to(point, (len(actor), 3))
    if line.mirror is None:
        return world.scene.motion_at(actor, there)
    flip = is_image[:, None]
    place = np.where(flip, line.mirror.image_of(there), there)
    moving, moved = world.scene.motion_at(actor, place)
    return (
        np.where(flip, line.mirror.image_velocity(moving), moving),
        np.where(flip, line.mirror.turned(moved), moved),
    )


def _from_moments(
    world: World,
    line: Line,
    waves: EdgeWaves,
    frame: LinkFrame,
    rotation: FloatArray,
    owners: _Owners,
) -> EdgePaths:
    """Paths from cells' moments, without those weaker than the strongest by the dynamic range."""
    power = np.abs(waves.moments[..., FIELD]) ** 2
    strongest = max(float(np.max(power, initial=0.0)), float(line.is_clear))
    slot, cell = np.nonzero((power > 0) & (power * world.dynamic_range >= strongest))
    moments, spreads = waves.moments[slot, cell], waves.spreads[slot, cell]
    field = moments[:, FIELD]
    ratios = moments / field[:, None]
    means = ratios.real
    # where a cell's waves nearly cancel, ratios of moments have no meaning
    excess = np.clip(
        means[:, MEAN_EXCESS],
        np.maximum(cell - 1.0, 0.0) * EXCESS_CELL_LENGTH,
        (cell + 1.0) * EXCESS_CELL_LENGTH,
    )
    weight, end = spreads[:, WEIGHT], np.array([frame.length, 0.0, 0.0])
    point = spreads[:, PLACE : PLACE + 3] / weight[:, None]
    out = _or_towards(means[:, OUTWARD : OUTWARD + 3], point)
    back = _or_towards(means[:, RETURN : RETURN + 3], point - end)
    velocity = frame.from_sender[slot], frame.from_receiver[slot]
    rate = np.sum(out * velocity[0] + back * velocity[1], axis=-1)
    mean_rate = np.sum(
        ratios[:, OUTWARD : OUTWARD + 3] * velocity[0]
        + ratios[:, RETURN : RETURN + 3] * velocity[1],
        axis=-1,
    )
    typical, square = spreads[:, RATE] / weight, spreads[:, SQUARED_RATE] / weight
    spread = np.sqrt(np.maximum(square - typical**2, 0.0))
    # by rounding, even a single edge point has a spread of some µm/s
    coherence = 1.0 / (world.wavenumber * np.maximum(spread, 1e-12))
    way = out @ rotation
    found = EdgePaths(
        field=field * np.exp(1j * world.wavenumber * excess),
        excess=excess,
        rate=rate,
        acceleration=np.zeros(len(field)),
        coherence_time=np.where(spread > 1e-5, coherence, np.inf),
        drift=-1j * world.wavenumber * (mean_rate - rate),
        out=way,
        back=back @ rotation,
        out_rate=np.zeros_like(way),
        back_rate=np.zeros_like(way),
        point=point @ rotation + line.place[0],
        actor=owners.actor[slot],
        is_image=owners.is_image[slot],
    )
    return _moved(world, line, found)


def _moved(world: World, line: Line, edges: EdgePaths) -> EdgePaths:
    """The paths with second derivatives of their lengths and rates of their directions."""
    matter, moved = _motion(world, line, edges.actor, edges.is_image, edges.point)
    moving = _along_edge(line, edges, matter)
    acceleration, turns = np.zeros(len(edges.actor)), []
    for end, way in enumerate((edges.out, edges.back)):
        gap, speed = edges.point - line.place[end], moving - line.velocity[end]
        acceleration += range_acceleration(gap, speed)
        acceleration += np.sum(way * (moved - line.acceleration[end]), axis=-1)
        length = np.linalg.norm(gap, axis=-1)
        turns.append(turning(gap / length[:, None], length, speed))
    return edges._replace(acceleration=acceleration, out_rate=turns[0], back_rate=turns[1])


def _along_edge(line: Line, edges: EdgePaths, matter: FloatArray) -> FloatArray:
    r"""Velocities of edge points, m/s ``(path, xyz)``, where the edge's matter has ``matter``.

    A path goes over the place where the edge is nearest to the line, so that the edge is across
    both the line and the distance from it. A movement of the matter along the edge does not carry
    this place with it: along the edge, it stays between both ends of the line. Where edges on
    several sides of the line are in one cell, their mean is nearer to the line than its excess e
    says, :math:`\varrho \approx \sqrt{2 e d_1 d_2 / (d_1 + d_2)}`; it then moves with the matter.
    """
    straight = (line.place[1] - line.place[0]) / line.length
    gap = edges.point - line.place[0]
    ahead = gap @ straight
    aside = gap - ahead[:, None] * straight
    distance = np.linalg.norm(aside, axis=-1)
    share = np.clip(ahead / line.length, 0.0, 1.0)
    expected = np.sqrt(2.0 * edges.excess * share * (1.0 - share) * line.length)
    is_edge = distance > np.maximum(LEAST_OFFSET * expected, 1e-9)
    edge = np.cross(straight, aside) * (is_edge / np.maximum(distance, 1e-9))[:, None]
    between = line.velocity[0] + share[:, None] * (line.velocity[1] - line.velocity[0])
    return np.asarray(matter + np.sum((between - matter) * edge, axis=-1, keepdims=True) * edge)


def _or_towards(mean: FloatArray, way: FloatArray) -> FloatArray:
    """Mean directions; that of ``way`` where a mean's length differs from 1 by 0.2 or more."""
    straight = way / np.linalg.norm(way, axis=-1, keepdims=True)
    is_direction = np.abs(np.linalg.norm(mean, axis=-1, keepdims=True) - 1.0) < 0.2
    return np.where(is_direction, mean, straight)
