"""Paths over one body: one for each cell of path length whose moments `delay_cells` sums."""

from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import gather, no_paths, path_table
from polychirp.channel.geometry.retarded_delay import range_acceleration, turning
from polychirp.channel.physical_optics.kernels import CELL_LENGTH
from polychirp.channel.physical_optics.term_sums import (
    EXCESS,
    OUTWARD,
    RETURN,
    SQUARED_RATE,
    TRANSFER,
)
from polychirp.channel.physical_optics.views import Unfolded, View
from polychirp.channel.scene.world import World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import turned_at_rate
from polychirp.model.paths import Bounce, PropagationPaths


class PathEnds(NamedTuple):
    """Radars at one end of paths over a body, ``(path, …)``.

    ``radar`` is its number. ``plate`` is the number of the plate that mirrors it; None if the paths
    have no mirror at this end. ``image`` is the position of the radar's mirror image, or of the
    radar itself without a plate, m; ``acceleration`` is that of ``image``, m/s². ``velocity`` is
    the body's relative to ``image``, m/s, first as in `velocity_in_views`, later at the paths'
    points. ``towards`` is the unit vector from ``image`` to the body's centre. ``views`` are the
    views of all combinations, and ``view`` ``(path,)`` is the number of every path's.
    """

    radar: IntArray
    plate: IntArray | None
    image: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    towards: FloatArray
    views: list[View]
    view: IntArray

    def select(self, number: IntArray) -> "PathEnds":
        """The ends of the paths with these numbers; a number may occur more than once."""
        return PathEnds(
            self.radar[number],
            None if self.plate is None else self.plate[number],
            self.image[number],
            self.velocity[number],
            self.acceleration[number],
            self.towards[number],
            self.views,
            self.view[number],
        )


def path_ends(views: list[View], world: World, body: int) -> PathEnds:
    """Ends of paths, one for each view; the views are all direct, or all mirrored by plates."""
    image = np.array([view.image for view in views]).reshape(-1, 3)
    way = world.centre[body] - image
    plates = [view.plate for view in views if view.plate is not None]
    return PathEnds(
        radar=np.array([view.radar for view in views], dtype=np.int64),
        plate=np.array(plates, dtype=np.int64) if plates else None,
        image=image,
        velocity=velocity_in_views(views, world, body),
        acceleration=np.array([view.image_acceleration for view in views]).reshape(-1, 3),
        towards=way / np.linalg.norm(way, axis=-1, keepdims=True),
        views=views,
        view=np.arange(len(views)),
    )


def velocity_in_views(views: list[View], world: World, body: int) -> FloatArray:
    """Velocity of a body relative to the views' images, m/s in the world, ``(view, xyz)``.

    It is that of the body's matter as if this reached to the image. Along each ray from there it
    has the same component as the matter that the ray meets, for turning bodies too (see
    `World.velocity_at`), so that one vector gives the rates of all facets.
    """
    image = np.array([view.image for view in views]).reshape(-1, 3)
    image_velocity = np.array([view.image_velocity for view in views]).reshape(-1, 3)
    return np.asarray(world.velocity_at(body, image) - image_velocity)


def cell_paths(
    world: World,
    body: int,
    combinations: list[tuple[View, View]],
    first_cell: IntArray,
    moments: ComplexArray,
) -> PropagationPaths:
    """Paths over a body from the first view of every combination to the second, and back.

    The first views are all mirrored or all direct, and so are the second ones. A combination of a
    view with itself has no separate path back. Cells that are weaker than the strongest of their
    combination by more than the dynamic range are left out. ``first_cell`` is the number of the
    first cell, ``(combination,)``; ``moments`` ``(combination, cell, moment)`` are as
    `sum_in_cells` gives them.
    """
    number, cell = _strong_cells(moments, world.dynamic_range)
    if not len(number):
        return no_paths(world.scene, world.frequency)
    sums = moments[number, cell]
    views = zip(*combinations, strict=True)
    ends = [path_ends(list(side), world, body).select(number) for side in views]
    middle = np.asarray((first_cell[number] + cell) * CELL_LENGTH, dtype=np.float64)
    length, ways = _means(sums, middle, ends, world.rotation[body])
    velocity = [end.velocity for end in ends]
    rate = _dot(ways[0], velocity[0]) + _dot(ways[1], velocity[1])
    phasor = np.exp(1j * world.wavenumber * length)[:, None, None]
    transfer = sums[:, TRANSFER].reshape(-1, 2, 2) * phasor
    in_body = [one @ world.rotation[body] for one in velocity]
    coherence, drift = _coherence_and_drift(sums, in_body, rate, world.wavenumber)
    bends = [_bends(end, way) for end, way in zip(ends, ways, strict=True)]
    ends = [_at_edges(end, bend, world, body) for end, bend in zip(ends, bends, strict=True)]
    rate = _dot(ways[0], ends[0].velocity) + _dot(ways[1], ends[1].velocity)
    point = _ellipse_point(ends[0].image, ends[1].image, ways[0], length)
    legs = [point - end.image for end in ends]
    ends = [_at_point(end, leg, world, body) for end, leg in zip(ends, legs, strict=True)]
    acceleration = _acceleration(ends, ways, legs, world.acceleration_at(body, point))
    lengths = [np.linalg.norm(leg, axis=-1) for leg in legs]
    for end, way, far in zip(ends, ways, lengths, strict=True):
        drift -= _dot(way, end.velocity) / far
    at_radar = [_at_radar(world, *one) for one in zip(ends, bends, ways, lengths, strict=True)]
    actor = np.full(len(number), world.body[body])

    def table(order: tuple[int, int], matrix: ComplexArray) -> PropagationPaths:
        sender, receiver = ends[order[0]], ends[order[1]]
        return path_table(
            scene=world.scene,
            frequency=world.frequency,
            pair=np.stack([sender.radar, receiver.radar], axis=-1),
            delay=length / SPEED_OF_LIGHT,
            delay_rate=rate / SPEED_OF_LIGHT,
            transfer=matrix,
            departure=at_radar[order[0]][0],
            arrival=at_radar[order[1]][0],
            transfer_drift=drift,
            departure_rate=at_radar[order[0]][1],
            arrival_rate=at_radar[order[1]][1],
            bounces=[
                *_end_bounce(world, sender, bends[order[0]], point),
                (Bounce.SCATTERING, actor, point),
                *_end_bounce(world, receiver, bends[order[1]], point),
            ],
            coherence_time=coherence,
            delay_acceleration=acceleration / SPEED_OF_LIGHT,
        )

    is_two_way = np.array([a is not b for a, b in combinations])[number]
    back = table((1, 0), np.swapaxes(transfer, 1, 2)).select(is_two_way)
    return gather([table((0, 1), transfer), back])


def _strong_cells(moments: ComplexArray, dynamic_range: float) -> tuple[IntArray, IntArray]:
    """Numbers of the combinations and of the cells of the paths that are not left out."""
    power = np.max(np.abs(moments[:, :, TRANSFER]), axis=-1, initial=0.0) ** 2
    strongest = np.max(power, axis=1, keepdims=True, initial=0.0)
    number, cell = np.nonzero((power > 0) & (power * dynamic_range >= strongest))
    return number, cell


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(np.sum(one * other, axis=-1))


def _at_edges(end: PathEnds, bend: Unfolded | None, world: World, body: int) -> PathEnds:
    """The ends of paths with the images that the body sees over edges, if they bend."""
    if bend is None:
        return end
    return end._replace(
        image=bend.image,
        velocity=world.velocity_at(body, bend.image) - bend.velocity,
        acceleration=bend.acceleration,
    )


def _at_point(end: PathEnds, leg: FloatArray, world: World, body: int) -> PathEnds:
    """The ends of paths with the velocities of the body's matter at the ends of ``leg``, m."""
    return end._replace(velocity=end.velocity + turned_at_rate(world.yaw_rate[body], leg))


def _acceleration(
    ends: list[PathEnds], ways: list[FloatArray], legs: list[FloatArray], swerve: FloatArray
) -> FloatArray:
    """Second derivatives of the paths' lengths, m/s² ``(path,)``.

    ``swerve`` m/s² ``(path, xyz)`` is the acceleration of the body's matter at the paths' points,
    to which ``legs`` m go from the images, in the directions ``ways``.
    """
    total = np.zeros(len(swerve))
    for end, way, leg in zip(ends, ways, legs, strict=True):
        total += range_acceleration(leg, end.velocity) + _dot(way, swerve - end.acceleration)
    return total


def _at_radar(
    world: World, end: PathEnds, bend: Unfolded | None, way: FloatArray, length: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Directions of paths at the radar, and their rates, 1/s: both ``(path, xyz)``."""
    if bend is not None:
        return bend.departure, bend.departure_rate
    turn = turning(way, length, end.velocity)
    return _departure(world, end, way), _departure(world, end, turn)


def _departure(world: World, end: PathEnds, direction: FloatArray) -> FloatArray:
    """Vectors at the radar, given ``direction``, those at its image."""
    if end.plate is None:
        return direction
    normal = world.plates.normal[end.plate]
    return np.asarray(direction - 2 * _dot(direction, normal)[:, None] * normal)


def _bends(end: PathEnds, direction: FloatArray) -> Unfolded | None:
    """Images of paths that arrive along ``direction`` over edges; None if they are straight."""
    found: Unfolded | None = None
    for number in np.unique(end.view):
        mine = np.flatnonzero(end.view == number)
        some = end.views[number].unfolded(direction[mine])
        if some is None:
            return None
        if found is None:
            found = Unfolded._make(np.empty_like(direction) for _ in some)
        for column, values in zip(found, some, strict=True):
            column[mine] = values
    return found


def _end_bounce(
    world: World, end: PathEnds, bends: Unfolded | None, point: FloatArray
) -> list[tuple[Bounce, IntArray, FloatArray]]:
    """The bounce between radar and ``point``, at an edge or a plate; an empty list without one."""
    if bends is not None:
        actor = np.array([view.bending_actor for view in end.views], dtype=np.int64)
        return [(Bounce.DIFFRACTION, actor[end.view], bends.bend)]
    if end.plate is None:
        return []
    plates = world.plates
    normal, way = plates.normal[end.plate], point - end.image
    below, along = _dot(plates.centre[end.plate] - end.image, normal), _dot(way, normal)
    share = below / np.where(along == 0, np.inf, along)
    return [(Bounce.REFLECTION, plates.actor[end.plate], end.image + share[:, None] * way)]


def _means(
    moments: ComplexArray, middle: FloatArray, ends: list[PathEnds], rotation: FloatArray
) -> tuple[FloatArray, list[FloatArray]]:
    """Lengths of paths (m), and directions from both ends in the world, from the cells' moments.

    Where the contributions to a cell nearly cancel, ratios of moments are no means. So a length is
    kept within `CELL_LENGTH` of the middle of its cell, and a direction whose magnitude is not near
    1 is replaced by that to the body's centre. The transfer at the centre frequency stays right.
    """
    total = moments[:, 0]
    divisor = np.where(total == 0, 1.0, total)
    excess = (moments[:, EXCESS] / divisor).real
    length = middle + np.clip(excess, -CELL_LENGTH, CELL_LENGTH)
    directions = []
    for columns, end in zip((OUTWARD, RETURN), ends, strict=True):
        mean = (moments[:, columns] / divisor[:, None]).real @ rotation.T
        directions.append(np.where(_is_direction(mean)[:, None], mean, end.towards))
    return length, directions


def _is_direction(vectors: FloatArray) -> BoolArray:
    return np.asarray(np.abs(np.linalg.norm(vectors, axis=-1) - 1.0) < 0.2)


def _coherence_and_drift(
    moments: ComplexArray, velocity: list[FloatArray], rate: FloatArray, wavenumber: float
) -> tuple[FloatArray, ComplexArray]:
    r"""Time for which one rate describes the contributions c to a cell well, s, ``(path,)``.

    Each c has its own rate ν of the path length, m/s. If their sum is extrapolated over the time t
    with the path's rate :math:`\nu_0`, its relative error is

    .. math:: \frac{\sum c\,e^{-jk(\nu-\nu_0)t}}{\sum c} - 1 \approx
        -jkt\,\overline{(\nu-\nu_0)} - \tfrac12 k^2t^2\,\overline{(\nu-\nu_0)^2}

    with means weighted by c, which are complex. The coherence time is the t at which the magnitudes
    of both terms add up to one half (chosen): without the first term, phases spread by 1 rad rms.
    The factor of t in the first term is the second result, the sum's relative rate, 1/s.
    """
    divisor = np.where(moments[:, 0] == 0, 1.0, moments[:, 0])
    out = np.sum(moments[:, OUTWARD] * velocity[0], -1)
    back = np.sum(moments[:, RETURN] * velocity[1], -1)
    mean = (out + back) / divisor
    square = moments[:, SQUARED_RATE] / divisor - 2 * rate * mean + rate**2
    drift = -1j * wavenumber * (mean - rate)
    first, second = np.abs(drift), 0.5 * wavenumber**2 * np.abs(square)
    # the root t of ½ = first·t + second·t², in the form without a difference of near numbers
    below = first + np.sqrt(first**2 + 2 * second)
    return np.asarray(1.0 / np.maximum(below, 1e-12)), np.asarray(drift)


def _ellipse_point(
    start: FloatArray, end: FloatArray, direction: FloatArray, length: FloatArray
) -> FloatArray:
    """Bounce points, m ``(path, xyz)``; ``length`` is a path's, m, ``direction`` that at start."""
    unit = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    base = end - start
    divisor = 2 * np.maximum(length - _dot(unit, base), 1e-9)
    share = (length**2 - _dot(base, base)) / divisor
    return np.asarray(start + share[:, None] * unit)
