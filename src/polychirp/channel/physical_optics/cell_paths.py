"""Paths from the moments of cells: what `gathering` gathered of one body."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import gather, no_paths, path_table
from polychirp.channel.geometry.retarded_delay import range_acceleration
from polychirp.channel.physical_optics.kernels import CELL
from polychirp.channel.physical_optics.views import View
from polychirp.channel.scene.world import World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths


class End(NamedTuple):
    """One end of paths over a body, ``(path, …)``.

    ``radar``; ``plate`` that mirrors it, or −1; ``image`` m, where it seems to be; ``slide`` m/s,
    how the body moves against that; ``towards``, unit, to the body's middle.
    """

    radar: IntArray
    plate: IntArray
    image: FloatArray
    slide: FloatArray
    towards: FloatArray

    def of(self, number: IntArray) -> End:
        """The ends of these paths, with repetitions."""
        return End(
            self.radar[number],
            self.plate[number],
            self.image[number],
            self.slide[number],
            self.towards[number],
        )


def end_of(views: list[View], world: World, body: int) -> End:
    """One end of as many paths."""
    image = np.array([view.image for view in views]).reshape(-1, 3)
    way = world.centre[body] - image
    return End(
        radar=np.array([view.radar for view in views], dtype=np.int64),
        plate=np.array(
            [-1 if view.plate is None else view.plate for view in views], dtype=np.int64
        ),
        image=image,
        slide=slide_of(views, world, body),
        towards=way / np.linalg.norm(way, axis=-1, keepdims=True),
    )


def slide_of(views: list[View], world: World, body: int) -> FloatArray:
    """How a body moves against the images of views, m/s ``(view, xyz)`` in the world."""
    image_velocity = np.array([view.image_velocity for view in views]).reshape(-1, 3)
    return np.asarray(world.velocity[body] - image_velocity)


def cell_paths(
    world: World,
    body: int,
    combinations: list[tuple[View, View]],
    first_cell: IntArray,
    moments: ComplexArray,
) -> PropagationPaths:
    """Paths over a body from the first view of every combination to the second, and back.

    Of all first views or of none there is a plate, and so of all second ones. The ways back are
    those between unlike views. Left out are cells weaker than the dynamic range allows beside the
    strongest of their combination; ``moments`` ``(combination, cell, moment)`` are as
    `gather_cells` gives them.
    """
    power = np.max(np.abs(moments[:, :, :4]), axis=-1, initial=0.0) ** 2
    strongest = np.max(power, axis=1, keepdims=True, initial=0.0)
    task, cell = np.nonzero((power > 0) & (power * world.dynamic_range >= strongest))
    if not len(task):
        return no_paths(world.scene, world.frequency)
    sums = moments[task, cell]
    ends = [end_of([pair[side] for pair in combinations], world, body).of(task) for side in (0, 1)]
    middle = np.asarray((first_cell[task] + cell) * CELL, dtype=np.float64)
    length, ways = _means(sums, middle, ends, world.rotation[body])
    slides = [end.slide for end in ends]
    rate = _along(ways[0], slides[0]) + _along(ways[1], slides[1])
    transfer = sums[:, :4].reshape(-1, 2, 2) * np.exp(1j * world.wavenumber * length)[:, None, None]
    local = [slide @ world.rotation[body] for slide in slides]
    coherence = _coherence_time(sums, local, rate, world.wavenumber)
    point = _ellipse_point(ends[0].image, ends[1].image, ways[0], length)
    bend = range_acceleration(point - ends[0].image, slides[0]) + range_acceleration(
        point - ends[1].image, slides[1]
    )
    actor = np.full(len(task), world.body[body])

    def table(order: tuple[int, int], matrix: ComplexArray) -> PropagationPaths:
        sender, receiver = ends[order[0]], ends[order[1]]
        return path_table(
            scene=world.scene,
            frequency=world.frequency,
            pair=np.stack([sender.radar, receiver.radar], axis=-1),
            delay=length / SPEED_OF_LIGHT,
            delay_rate=rate / SPEED_OF_LIGHT,
            transfer=matrix,
            departure=_departure(world, sender, ways[order[0]]),
            arrival=_departure(world, receiver, ways[order[1]]),
            bounces=[
                *_mirror_bounce(world, sender, point),
                (Bounce.SCATTERING, actor, point),
                *_mirror_bounce(world, receiver, point),
            ],
            coherence_time=coherence,
            delay_acceleration=bend / SPEED_OF_LIGHT,
        )

    there = table((0, 1), transfer)
    back = table((1, 0), np.swapaxes(transfer, 1, 2))
    unlike = np.array([a is not b for a, b in combinations])[task]
    return gather([there, back.select(unlike)])


def _along(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(np.sum(one * other, axis=-1))


def _departure(world: World, end: End, direction: FloatArray) -> FloatArray:
    """Directions as they leave the radar, of those that reach the body."""
    if np.all(end.plate < 0):
        return direction
    normal = world.plates.normal[end.plate]
    return np.asarray(direction - 2 * _along(direction, normal)[:, None] * normal)


def _mirror_bounce(
    world: World, end: End, point: FloatArray
) -> list[tuple[Bounce, IntArray, FloatArray]]:
    """Where ways from radars to points meet plates, if they do."""
    if np.all(end.plate < 0):
        return []
    plates = world.plates
    normal, way = plates.normal[end.plate], point - end.image
    below, along = _along(plates.centre[end.plate] - end.image, normal), _along(way, normal)
    share = below / np.where(along == 0, np.inf, along)
    return [(Bounce.REFLECTION, plates.actor[end.plate], end.image + share[:, None] * way)]


def _means(
    moments: ComplexArray, middle: FloatArray, ends: list[End], rotation: FloatArray
) -> tuple[FloatArray, list[FloatArray]]:
    """Length (m) and the two directions in the world of cells, from their moments.

    Where a cell's contributions all but cancel, the ratios of moments mean nothing; then the
    cell's centre and the body's direction stand in. The field at the centre frequency is right
    in any case.
    """
    total = moments[:, 0]
    divisor = np.where(total == 0, 1.0, total)
    excess = (moments[:, 4] / divisor).real
    length = middle + np.clip(excess, -CELL, CELL)
    directions = []
    for first, end in zip((5, 8), ends, strict=True):
        mean = (moments[:, first : first + 3] / divisor[:, None]).real @ rotation.T
        directions.append(np.where(_is_direction(mean)[:, None], mean, end.towards))
    return length, directions


def _is_direction(vectors: FloatArray) -> BoolArray:
    return np.asarray(np.abs(np.linalg.norm(vectors, axis=-1) - 1.0) < 0.2)


def _coherence_time(
    moments: ComplexArray, slides: list[FloatArray], rate: FloatArray, wavenumber: float
) -> FloatArray:
    r"""Time, s ``(path,)``, after which a cell's contributions c no longer move as one.

    Carried on at the rate :math:`\nu_0`, their sum is wrong by

    .. math:: \frac{\sum c\,e^{-jk(\nu-\nu_0)t}}{\sum c} - 1 \approx
        -jkt\,\overline{(\nu-\nu_0)} - \tfrac12 k^2t^2\,\overline{(\nu-\nu_0)^2}

    with means over c, which are complex. The time is that at which the two terms' sizes add up to
    one half: a spread of 1 rad rms, if the first vanishes.
    """
    divisor = np.where(moments[:, 0] == 0, 1.0, moments[:, 0])
    out, back = np.sum(moments[:, 5:8] * slides[0], -1), np.sum(moments[:, 8:11] * slides[1], -1)
    mean = (out + back) / divisor
    square = moments[:, 11] / divisor - 2 * rate * mean + rate**2
    first, second = wavenumber * np.abs(mean - rate), 0.5 * wavenumber**2 * np.abs(square)
    # ½ = first·t + second·t², written so that nothing cancels
    below = first + np.sqrt(first**2 + 2 * second)
    return np.asarray(1.0 / np.maximum(below, 1e-12))


def _ellipse_point(
    start: FloatArray, end: FloatArray, direction: FloatArray, length: FloatArray
) -> FloatArray:
    """M ``(path, xyz)``: where paths of total ``length`` that leave along ``direction`` turn."""
    unit = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    base = end - start
    room = 2 * np.maximum(length - _along(unit, base), 1e-9)
    share = (length**2 - _along(base, base)) / room
    return np.asarray(start + share[:, None] * unit)
