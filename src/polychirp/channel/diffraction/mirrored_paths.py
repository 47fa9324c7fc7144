r"""Diffraction of mirror images: waves by way of road or wall, over edges of what is in the way.

The wave from radar to radar by way of a mirror is the direct wave of the first radar's image. What
stands in front of the mirror obstructs it behind the reflection, and by its image before the
reflection (`sight_lines`). With the field :math:`U/U_0` of `paths` over all these edges, the
mirror's path of transfer matrix :math:`A` (`specular.plates`) becomes

.. math:: A\,[\text{clear}] + \sum_{\text{edges}} A\,\frac{U_{\text{edge}}}{U_0}

The first term is `mirror_paths`. A wave that passes below a vehicle by way of the road goes through
a slit as wide as twice the vehicle's ground clearance, and fades over a Fresnel zone where a tyre
or the edge of a bumper moves into its way.

**Limits** are those of `paths`, and more: the mirror is taken as endless beside its reflection, of
the strength that the geometric path has, so that waves are followed only if that path meets the
plate itself. Bodies that are behind the mirror's plane, or belong to the same actor, obstruct
nothing by their edges. A wave that is reflected both before and after the same edge is left out.

A radar that sees itself in a mirror has every edge at the same excess before the reflection and
behind it. Only the edges behind it are then sought, and half of their field goes either way.
"""

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.base import gather, no_paths, path_table, strength, strongest_of_pair
from polychirp.channel.diffraction.edge_paths import EdgePaths, edge_paths
from polychirp.channel.diffraction.sight_lines import (
    Line,
    Obstructing,
    line_by_mirror,
    mirror_of,
    obstructing,
)
from polychirp.channel.scene.world import World
from polychirp.channel.specular.images import nearest_on_plates
from polychirp.channel.specular.plates import Reflections, reflections
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths


def diffracted_mirror_paths(
    world: World, pairs: IntArray, strongest: FloatArray, *, actor: int | None = None
) -> PropagationPaths:
    """Paths of ``pairs`` by one reflection in a plate and over the edges of what is in their way.

    Together with `mirror_paths` they are the field that arrives by way of the plate, which is
    continuous while an obstacle moves into the way. The transfer matrices of the two directions
    between two radars are transposes of each other, as those of `mirror_paths` are.

    Parameters
    ----------
    pairs : (transmitter, receiver), ``(pair, 2)``
    strongest : `strength` of the strongest path known of every pair, ``(transmitter, receiver)``;
        plates by which even an unobstructed wave is weaker by the dynamic range are left out
    actor : number of the actor whose plates are meant; None: those of all

    Examples
    --------
    Below a wall that ends 10 cm above a metal road, half of the power goes on:

    >>> from polychirp.channel.specular.plates import mirror_paths
    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.model.mesh import Plate
    >>> from polychirp.model.scene import Actor
    >>> from polychirp.testing.shapes import around, transfer_at
    >>> road = Plate(centre=(20, 0, 0), half_u=(60, 0, 0), half_v=(0, 60, 0), material="metal",
    ...     part="road")
    >>> wall = Plate(centre=(15, 0, 6.1), half_u=(0, 30, 0), half_v=(0, 0, 6), material="brick",
    ...     part="wall")
    >>> actors = [Actor(name="road", kind="road", plates=(road,)),
    ...     Actor(name="wall", kind="building", plates=(wall,))]
    >>> scene = around(actors, [(0, 0, 0.5), (40, 0, 0.6)])
    >>> world, pair = Composite().prepare(scene), np.array([[0, 1]])
    >>> road_alone = transfer_at(reflections(world, pair, actor=2).paths, 79e9, 0, 1)
    >>> edges = diffracted_mirror_paths(world, pair, np.zeros((2, 2)), actor=2)
    >>> both = gather([mirror_paths(world, pair), edges])
    >>> field = transfer_at(both, 79e9, 0, 1)[0, 0] / road_alone[0, 0]
    >>> float(round(abs(field) ** 2, 2))
    0.45
    """
    found = reflections(world, pairs, actor=actor)
    tables = [no_paths(world.scene, world.frequency)]
    edges: dict[tuple[int, int, int], tuple[Line, EdgePaths] | None] = {}
    for number in np.flatnonzero(_is_followed(world, found, strongest)):
        a, b = int(found.paths.transmitter[number]), int(found.paths.receiver[number])
        key = min(a, b), max(a, b), int(found.plate[number])
        if key not in edges:
            edges[key] = _edges_of(world, *key, bool(found.is_free[number]))
        if (known := edges[key]) is not None:
            tables += _path_tables(world, found, int(number), *known)
    return gather(tables)


def _is_followed(world: World, found: Reflections, strongest: FloatArray) -> BoolArray:
    """Mask of the reflections that meet their plate and are strong enough."""
    paths = found.paths
    power = strength(paths, world.scene)
    known = np.maximum(strongest, strongest_of_pair(paths, power, len(strongest)))
    limit = known[paths.transmitter, paths.receiver] / world.dynamic_range
    meet = paths.bounce_point
    gap = nearest_on_plates(world.plates.of(found.plate), meet) - meet
    return np.asarray((power > limit) & (np.linalg.norm(gap, axis=-1) < 1e-6))


def _edges_of(
    world: World, first: int, second: int, plate: int, is_clear: bool
) -> tuple[Line, EdgePaths] | None:
    """The line between two radars by way of a plate with its edges; None if there are none."""
    line = line_by_mirror(world, first, second, mirror_of(world, plate), is_clear)
    some = obstructing(world, line)
    if first == second:
        # the images block the same intervals; rounding would choose between the two at every edge
        none = np.zeros(0, dtype=np.int64)
        some = some[0], Obstructing(none, none)
    if all(one.is_empty for one in some):
        return None
    return line, edge_paths(world, line, some)


def _path_tables(
    world: World, found: Reflections, number: int, line: Line, edges: EdgePaths
) -> list[PropagationPaths]:
    """Edge paths of reflection ``number`` in its direction: edges before and behind the plate.

    The line starts at the image of the radar with the lower number.
    """
    mirrors, mirror = found.paths, mirror_of(world, int(found.plate[number]))
    a, b = int(mirrors.transmitter[number]), int(mirrors.receiver[number])
    tables = []
    # a radar's own waves, which have no images of edges, go both ways
    ways = ((True, a <= b), (False, a <= b)) if a != b else ((False, True), (False, False))
    for is_image, is_forward in ways:
        some = edges.select(edges.is_image == is_image)
        if a == b:
            some = some._replace(field=0.5 * some.field)
        ends = mirror.turned(some.out), some.back
        departure, arrival = ends if is_forward else ends[::-1]
        turns = mirror.turned(some.out_rate), some.back_rate
        departure_rate, arrival_rate = turns if is_forward else turns[::-1]
        size = len(some.actor)
        plate = np.full(size, mirrors.bounce_actor[number])
        meet = np.tile(mirrors.bounce_point[number], (size, 1))
        edge = mirror.image_of(some.point) if is_image else some.point
        bounces = [(Bounce.DIFFRACTION, some.actor, edge), (Bounce.REFLECTION, plate, meet)]
        # an image's edge is on the way between the first radar and the plate
        is_edge_first = is_image == is_forward
        tables.append(
            path_table(
                scene=world.scene,
                frequency=world.frequency,
                pair=np.tile([a, b], (size, 1)),
                delay=mirrors.delay[number] + some.excess / SPEED_OF_LIGHT,
                delay_rate=mirrors.delay_rate[number] + (some.rate - line.opening) / SPEED_OF_LIGHT,
                transfer=mirrors.transfer[number] * some.field[:, None, None],
                departure=departure,
                arrival=arrival,
                bounces=bounces if is_edge_first else bounces[::-1],
                coherence_time=some.coherence_time,
                delay_acceleration=some.acceleration / SPEED_OF_LIGHT,
                transfer_drift=mirrors.transfer_drift[number] + some.drift,
                departure_rate=departure_rate,
                arrival_rate=arrival_rate,
            )
        )
    return tables
