"""Paths among vehicles that are boxes with a few points.

Only radars and points are examined that are within ``max_length`` of each other.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial import KDTree

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, strength, strongest_of_pair
from polychirp.channel.direct.line_of_sight import line_of_sight
from polychirp.channel.direct.moving_parts import articulated_actors, part_echoes
from polychirp.channel.direct.point_scatterers import echoes_over
from polychirp.channel.point_vehicles.occlusion_boxes import (
    Obstacles,
    crosses,
    extent,
    obstacles_of,
)
from polychirp.channel.point_vehicles.scattering_points import (
    IsotropicPoint,
    PointModel,
    VehicleModel,
    lobe_points,
    most_similar_table,
)
from polychirp.channel.scene.world import World, world_of
from polychirp.channel.specular.plates import mirror_paths
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.material import Material
from polychirp.model.mesh import EMPTY_MESH
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams

MAX_BATCH_PATHS: Final = 1 << 19
"""Number of possible paths over points that are tested together; most of them are too long or too
weak. Chosen: it bounds the working memory."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedStreet:
    """A scene whose vehicles are boxes.

    Parameters
    ----------
    scene : the scene with its meshes
    world : the scene without meshes, so that plates are its only surfaces
    obstacles : boxes and plates
    max_length : greatest length of a path, m
    """

    scene: Scene
    world: World
    obstacles: Obstacles
    max_length: float

    def near_pairs(self) -> IntArray:
        """(Transmitter, receiver) within ``max_length``, also of a single radar, ``(pair, 2)``."""
        tree = KDTree(self.obstacles.place)
        twos = tree.query_pairs(self.max_length, output_type="ndarray").reshape(-1, 2)
        alone = np.repeat(np.arange(len(self.scene.radars))[:, None], 2, axis=1)
        pairs = np.concatenate([twos, twos[:, ::-1], alone]).astype(np.int64)
        return np.asarray(pairs[np.lexsort([pairs[:, 1], pairs[:, 0]])])


def prepared(
    scene: Scene,
    *,
    frequency: float,
    dynamic_range: float,
    max_length: float,
    table: Mapping[str, Material],
) -> PreparedStreet:
    """A scene prepared for `direct`, `mirrored` and `echoes`.

    `InputError` is raised if a plate is of an unknown material.
    """
    bare = replace(scene, actors=tuple(replace(a, mesh=EMPTY_MESH) for a in scene.actors))
    world = world_of(bare, frequency=frequency, dynamic_range=dynamic_range, table=table)
    obstacles = obstacles_of(scene, world.plates, max_length)
    return PreparedStreet(scene=scene, world=world, obstacles=obstacles, max_length=max_length)


def direct(street: PreparedStreet) -> PropagationPaths:
    """Direct paths that no box and no plate blocks."""
    obstacles, scene = street.obstacles, street.scene
    if not scene.radars:
        return no_paths(scene, street.world.frequency)
    paths = line_of_sight(scene, frequency=street.world.frequency, pairs=street.near_pairs())
    sink = obstacles.place[paths.receiver]
    hidden = obstacles.hide(paths.transmitter, sink, obstacles.carrier[paths.receiver])
    hidden |= crosses(
        obstacles.own.select(paths.receiver), sink, obstacles.place[paths.transmitter]
    )
    return paths.select(~hidden)


def mirrored(street: PreparedStreet) -> PropagationPaths:
    """Paths by one reflection in a plate, up to ``max_length``, that no box and no plate blocks."""
    if not street.scene.radars:
        return no_paths(street.scene, street.world.frequency)
    paths = mirror_paths(street.world, street.near_pairs())
    paths = paths.select(paths.delay * SPEED_OF_LIGHT <= street.max_length)
    obstacles = street.obstacles.without_plates()  # `mirror_paths` has tested the plates
    hidden = np.zeros(paths.num_paths, dtype=np.bool_)
    for radar in (paths.transmitter, paths.receiver):
        hidden |= obstacles.hide(radar, paths.bounce_point, paths.bounce_actor)
    return paths.select(~hidden)


def moving(street: PreparedStreet) -> list[PropagationPaths]:
    """Paths over the moving parts of every body that has some, that no box and no plate hides."""
    scene, obstacles = street.scene, street.obstacles
    tables = []
    for actor in articulated_actors(scene):
        paths = part_echoes(
            scene, actor, frequency=street.world.frequency, pairs=street.near_pairs()
        )
        paths = paths.select(paths.delay * SPEED_OF_LIGHT <= street.max_length)
        hidden = np.zeros(paths.num_paths, dtype=np.bool_)
        for radar in (paths.transmitter, paths.receiver):
            hidden |= obstacles.hide(radar, paths.bounce_point, paths.bounce_actor)
        tables.append(paths.select(~hidden))
    return tables


class Scatterers(NamedTuple):
    """All points of a scene that echo.

    ``actor``, ``model``, ``number`` ``(point,)``: numbers of the actor, of the model in ``models``
    and of the point in that model; ``place`` m ``(point, xyz)`` in the world. ``matrix`` ``(point,
    2, 2)`` multiplies the root of the model's cross section, and contains the random phases.
    """

    actor: IntArray
    place: FloatArray
    model: IntArray
    number: IntArray
    matrix: ComplexArray
    models: tuple[PointModel, ...]


ISOTROPIC_POINT: Final = IsotropicPoint(place=np.zeros((1, 3)))
"""Model of an actor's own `PointScatterer`: number 0 of `Scatterers.models`."""


def scatterers(scene: Scene, *, model: VehicleModel, seed: int) -> Scatterers:
    """Points of all vehicles that have a mesh, and every `PointScatterer` of the scene."""
    models: list[PointModel] = [ISOTROPIC_POINT]
    actor, place, of_model, number = [], [], [], []
    matrix: list[ComplexArray] = []
    for index, one in enumerate(scene.actors):
        if one.points:
            actor.append(np.full(len(one.points), index))
            place.append(one.pose.to_outer(np.array([point.position for point in one.points])))
            of_model.append(np.zeros(len(one.points), dtype=np.int64))
            number.append(np.zeros(len(one.points), dtype=np.int64))
            root = np.sqrt([point.rcs for point in one.points])
            matrix.append(root[:, None, None] * np.eye(2, dtype=np.complex128))
        if one.kind == "vehicle" and one.mesh.num_faces:
            mine = _model_of(one, model)
            if mine not in models:
                models.append(mine)
            low, high = extent(one.mesh)
            count = len(mine.place)
            actor.append(np.full(count, index))
            place.append(one.pose.to_outer(low + mine.place * (high - low)))
            of_model.append(np.full(count, models.index(mine)))
            number.append(np.arange(count))
            matrix.append(np.sqrt(mine.scale(high - low)) * _random_matrices(mine, seed, one.name))
    if not actor:
        none = np.zeros(0, dtype=np.int64)
        matrices = np.zeros((0, 2, 2), dtype=np.complex128)
        return Scatterers(none, np.zeros((0, 3)), none, none, matrices, tuple(models))
    return Scatterers(
        np.concatenate(actor),
        np.concatenate(place),
        np.concatenate(of_model),
        np.concatenate(number),
        np.concatenate(matrix),
        tuple(models),
    )


def _model_of(actor: Actor, model: VehicleModel) -> PointModel:
    if model == "tables":
        low, high = extent(actor.mesh)
        return most_similar_table(high - low)
    return lobe_points("one" if model == "3gpp-one" else "five")


@lru_cache(maxsize=4096)
def _random_matrices(model: PointModel, seed: int, name: str) -> ComplexArray:
    """Random matrices of the points of the vehicle called ``name``, ``(point, 2, 2)``."""
    streams = Streams(seed).of("point-vehicles", name)
    return np.array([model.matrix(streams[number]) for number in range(len(model.place))])


class Legs(NamedTuple):
    """Straight legs between radars and the points that are visible to them, sorted by point.

    ``radar``, ``point`` ``(leg,)``; ``length`` m; ``gain``: power gain of the radar's element along
    the leg; ``towards`` ``(leg, xyz)``: unit vectors to the radar, in the point's actor's frame.
    """

    radar: IntArray
    point: IntArray
    length: FloatArray
    gain: FloatArray
    towards: FloatArray


def legs_of(street: PreparedStreet, found: Scatterers) -> Legs:
    """All legs up to ``max_length`` to points that are not hidden."""
    obstacles, scene = street.obstacles, street.scene
    near = KDTree(obstacles.place).sparse_distance_matrix(
        KDTree(found.place), street.max_length, output_type="ndarray"
    )
    radar, point = near["i"].astype(np.int64), near["j"].astype(np.int64)
    actor = found.actor[point]
    # a vehicle's model is not valid for a radar on the same vehicle
    open_ways = (found.model[point] == 0) | (actor != obstacles.carrier[radar])
    radar, point = radar[open_ways], point[open_ways]
    open_ways = ~obstacles.hide(radar, found.place[point], found.actor[point])
    radar, point = radar[open_ways], point[open_ways]
    order = np.lexsort([radar, point])
    radar, point = radar[order], point[order]
    gap = obstacles.place[radar] - found.place[point]
    length = np.linalg.norm(gap, axis=-1)
    outward = gap / np.maximum(length, 1e-12)[:, None]
    turn = np.array([actor.pose.rotation for actor in scene.actors])[found.actor[point]]
    return Legs(
        radar=radar,
        point=point,
        length=length,
        gain=_gains(scene, radar, -outward),
        towards=np.einsum("lij,li->lj", turn, outward),
    )


def _gains(scene: Scene, radar: IntArray, direction: FloatArray) -> FloatArray:
    """Power gains of the radars' elements ``(leg,)`` in directions of the world ``(leg, xyz)``."""
    gain, order, turn = np.empty(len(radar)), np.argsort(radar, kind="stable"), scene.radar_rotation
    first = np.searchsorted(radar[order], np.arange(len(scene.radars) + 1))
    for number, one in enumerate(scene.radars):
        mine = order[first[number] : first[number + 1]]
        gain[mine] = one.array.pattern.gain(direction[mine] @ turn[number])
    return gain


def _leg_pairs(legs: Legs) -> Iterator[tuple[IntArray, IntArray]]:
    """Numbers of an outward and a return leg, for all pairs of legs of one point, in batches."""
    _, first, count = np.unique(legs.point, return_index=True, return_counts=True)
    partners, start = np.repeat(count, count), np.repeat(first, count)
    total = np.concatenate([[0], np.cumsum(partners)])
    begin = 0
    while begin < len(partners):
        end = max(
            begin + 1, int(np.searchsorted(total, total[begin] + MAX_BATCH_PATHS, side="right")) - 1
        )
        out = np.repeat(np.arange(begin, end), partners[begin:end])
        inner = np.arange(len(out)) - np.repeat(
            total[begin:end] - total[begin], partners[begin:end]
        )
        yield out, start[out] + inner
        begin = end


def echoes(
    street: PreparedStreet, *, model: VehicleModel, seed: int, known: PropagationPaths
) -> PropagationPaths:
    """Paths over the points of vehicles, and over every `PointScatterer`.

    A path is left out if it is weaker, by more than the dynamic range over 0.9, than a ``known``
    path of its pair of radars or one found before; `without_weak` later makes the exact cut.
    """
    scene, frequency = street.scene, street.world.frequency
    found = scatterers(scene, model=model, seed=seed)
    if not len(found.actor) or not scene.radars:
        return no_paths(scene, frequency)
    legs, share = legs_of(street, found), 1 / street.world.dynamic_range
    strongest = strongest_of_pair(known, strength(known, scene), len(scene.radars))
    factor = np.max(np.abs(found.matrix) ** 2, axis=(1, 2))
    factor *= (SPEED_OF_LIGHT / frequency) ** 2 / (4 * np.pi) ** 3
    kept = []
    for out, back in _leg_pairs(legs):
        short = legs.length[out] + legs.length[back] <= street.max_length
        ways = np.stack([out[short], back[short]], axis=-1)
        area = _cross_section(found, legs, ways)
        spread = np.prod(legs.gain[ways] / legs.length[ways] ** 2, axis=-1)
        power = factor[legs.point[ways[:, 0]]] * area * spread
        pair = legs.radar[ways]
        np.maximum.at(strongest, (pair[:, 0], pair[:, 1]), power)
        strong = power > 0.9 * share * strongest[pair[:, 0], pair[:, 1]]
        kept.append((ways[strong], area[strong]))
    ways = np.concatenate([rows for rows, _ in kept]) if kept else np.zeros((0, 2), dtype=np.int64)
    area = np.concatenate([some for _, some in kept]) if kept else np.zeros(0)
    point = legs.point[ways[:, 0]]
    return echoes_over(
        scene,
        frequency=frequency,
        pair=legs.radar[ways],
        actor=found.actor[point],
        point=found.place[point],
        scattering=np.sqrt(area)[:, None, None] * found.matrix[point],
    )


def _cross_section(found: Scatterers, legs: Legs, ways: IntArray) -> FloatArray:
    """Cross sections, m² ``(path,)``, for pairs of legs ``ways`` ``(path, 2)``."""
    point, area = legs.point[ways[:, 0]], np.empty(len(ways))
    for index, model in enumerate(found.models):
        mine = found.model[point] == index
        towards, back = (legs.towards[ways[mine, end]] for end in (0, 1))
        area[mine] = model.cross_section(found.number[point[mine]], towards, back)
    return area
