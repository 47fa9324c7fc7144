"""A scene made ready for rays: what never changes is prepared once and moved rigidly.

Every mesh becomes a `Surface` in its own frame, with a tree of the faces that block; the trees
of all bodies of a scene lie behind one another in one `Tree`. A snapshot adds only poses, so
that tracing the scene a millisecond later rebuilds nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.caster import Tree, grow_tree
from polychirp.channel.fresnel import Media, media, power_through
from polychirp.channel.materials import check_materials
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.material import Material
from polychirp.model.mesh import Mesh
from polychirp.model.scene import Scene

CLEAR: Final = 0.75
"""Power a sheet must let through at normal incidence to block nothing: a bumper's 0.87 is 0.6 dB.

The loss of the crossing is left out; a mechanism for transmission would put it in."""

PATCH: Final = 0.08
"""m, size of the patches of a surface that are in the shadow of a mirror together."""

SKIN: Final = 0.02
"""m from a radar within which nothing blocks: its own cover and what it is mounted on."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface:
    """A mesh in its own frame, as physical optics and rays need it.

    Parameters
    ----------
    centroid, normal, tangent : m and unit vectors, ``(face, xyz)``; normal × tangent is the
        second tangent
    corner : m from the centroid, ``(face, corner, xyz)``; the farthest is at ``reach`` ``(face,)``
    area : m², ``(face,)``; medium : number into ``materials``, ``(face,)``
    tree : of the faces that block
    patch : number of the patch of neighbours that turn alike, ``(face,)``
    patch_face : the face in the middle of every patch, ``(patch,)``
    centre, radius : m, of a sphere around all
    """

    centroid: FloatArray
    normal: FloatArray
    tangent: FloatArray
    corner: FloatArray
    reach: FloatArray
    area: FloatArray
    medium: IntArray
    materials: tuple[str, ...]
    tree: Tree
    patch: IntArray
    patch_face: IntArray
    centre: FloatArray
    radius: float


@lru_cache(maxsize=64)
def surface_of(mesh: Mesh, blocks: tuple[bool, ...]) -> Surface:
    """The surface of a mesh, of whose materials some block; kept for the next snapshot."""
    corners = mesh.corners
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.linalg.norm(cross, axis=-1)
    real = double > 0  # a face without area neither scatters nor blocks
    corners, cross, double = corners[real], cross[real], double[real]
    medium = mesh.material[real]
    normal = cross / double[:, None]
    edge = corners[:, 1] - corners[:, 0]
    centroid = corners.mean(axis=1)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    centre = 0.5 * (low + high)
    patch, patch_face = _patches(centroid, normal)
    offset = np.ascontiguousarray(corners - centroid[:, None])
    return Surface(
        centroid=centroid,
        normal=normal,
        tangent=edge / np.linalg.norm(edge, axis=-1, keepdims=True),
        corner=offset,
        reach=np.sqrt(np.max(np.sum(offset**2, axis=-1), axis=-1)),
        area=0.5 * double,
        medium=medium,
        materials=mesh.materials,
        tree=grow_tree(corners[np.asarray(blocks, dtype=np.bool_)[medium]]),
        patch=patch,
        patch_face=patch_face,
        centre=centre,
        radius=float(np.sqrt(np.max(np.sum((corners - centre) ** 2, axis=-1)))),
    )


def _patches(centroid: FloatArray, normal: FloatArray) -> tuple[IntArray, IntArray]:
    """Patch of every face, and the face nearest to the middle of every patch."""
    key = np.concatenate([np.floor(centroid / PATCH), np.round(1.5 * normal)], axis=1)
    _, patch = np.unique(key.astype(np.int64), axis=0, return_inverse=True)
    patch = patch.reshape(-1)
    counts = np.bincount(patch)
    middle = np.stack([np.bincount(patch, weights=x) / counts for x in centroid.T], axis=-1)
    off = np.sum((centroid - middle[patch]) ** 2, axis=-1)
    order = np.lexsort([off, patch])
    return patch, order[np.concatenate([[0], np.cumsum(counts)[:-1]])]


class Forest(NamedTuple):
    """Trees of several bodies, one behind the other; body b has nodes ``root[b]:root[b+1]``."""

    tree: Tree
    root: IntArray


@lru_cache(maxsize=2)
def forest_of(surfaces: tuple[Surface, ...]) -> Forest:
    """The trees of all bodies behind one another."""
    trees = [surface.tree for surface in surfaces] or [grow_tree(np.zeros((0, 3, 3)))]
    root = np.concatenate([[0], np.cumsum([tree.skip.size for tree in trees])])
    offset = np.concatenate([[0], np.cumsum([tree.face.size for tree in trees])])
    return Forest(
        tree=Tree(
            box=np.concatenate([tree.box for tree in trees]),
            skip=np.concatenate([t.skip + r for t, r in zip(trees, root[:-1], strict=True)]),
            first=np.concatenate([t.first + o for t, o in zip(trees, offset[:-1], strict=True)]),
            size=np.concatenate([tree.size for tree in trees]),
            triangle=np.concatenate([tree.triangle for tree in trees]),
            face=np.concatenate([tree.face for tree in trees]),
        ),
        root=root,
    )


class Plates(NamedTuple):
    """Rectangles in one common frame: m ``(plate, xyz)``, half sides m ``(plate,)``.

    ``actor`` and ``medium`` ``(plate,)`` say whose they are, and of what.
    """

    centre: FloatArray
    normal: FloatArray
    across: FloatArray
    along: FloatArray
    half_across: FloatArray
    half_along: FloatArray
    actor: IntArray
    medium: IntArray

    def of(self, number: IntArray) -> Plates:
        """The plates of these numbers, with repetitions."""
        return Plates(
            self.centre[number],
            self.normal[number],
            self.across[number],
            self.along[number],
            self.half_across[number],
            self.half_along[number],
            self.actor[number],
            self.medium[number],
        )


def _plates(scene: Scene, materials: tuple[str, ...]) -> Plates:
    """All plates of a scene in the world."""
    rows = [
        (actor.pose, plate, index) for index, actor in enumerate(scene.actors)
        for plate in actor.plates
    ]  # fmt: skip
    empty = np.zeros((0, 3))
    u = np.array([pose.rotation @ plate.half_u for pose, plate, _ in rows]).reshape(-1, 3)
    v = np.array([pose.rotation @ plate.half_v for pose, plate, _ in rows]).reshape(-1, 3)
    half_across = np.linalg.norm(u, axis=-1)
    half_along = np.linalg.norm(v, axis=-1)
    across, along = u / half_across[:, None], v / half_along[:, None]
    centres = [pose.to_outer(np.array(plate.centre)) for pose, plate, _ in rows]
    return Plates(
        centre=np.array(centres) if rows else empty,
        normal=np.cross(across, along),
        across=across,
        along=along,
        half_across=half_across,
        half_along=half_along,
        actor=np.array([index for _, _, index in rows], dtype=np.int64),
        medium=np.array([materials.index(p.material) for _, p, _ in rows], dtype=np.int64),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class World:
    """A scene at one instant, ready for the mechanisms.

    Parameters
    ----------
    scene : what it was made from
    frequency : Hz
    dynamic_range : ratio by which a path may be weaker than its pair's strongest
    surfaces : of the bodies, in the order of ``body``
    body : their actors, ``(body,)``
    rotation, position, velocity : of the bodies, ``(body, xyz, xyz)``, m and m/s ``(body, xyz)``
    plates : in the world
    materials : of the plates' media
    table : materials by name
    """

    scene: Scene
    frequency: float
    dynamic_range: float
    surfaces: tuple[Surface, ...]
    body: IntArray
    rotation: FloatArray
    position: FloatArray
    velocity: FloatArray
    plates: Plates
    materials: tuple[str, ...]
    table: Mapping[str, Material]

    @property
    def wavenumber(self) -> float:
        """1/m."""
        return float(2 * np.pi * self.frequency / SPEED_OF_LIGHT)

    @cached_property
    def forest(self) -> Forest:
        """All that blocks, plates apart."""
        return forest_of(self.surfaces)

    @cached_property
    def centre(self) -> FloatArray:
        """m, ``(body, xyz)``: centres of the bodies' spheres in the world."""
        local = np.array([surface.centre for surface in self.surfaces]).reshape(-1, 3)
        return np.asarray(np.einsum("bij,bj->bi", self.rotation, local) + self.position)

    @cached_property
    def radius(self) -> FloatArray:
        """m, ``(body,)``."""
        return np.array([surface.radius for surface in self.surfaces])

    @cached_property
    def plate_media(self) -> Media:
        """Of the plates, in the order of ``materials``."""
        return media(self.materials, self.table, self.frequency)

    def bodies_of(self, actor: int) -> IntArray:
        """Numbers of the bodies that are ``actor``: one or none."""
        return np.flatnonzero(self.body == actor)


def world_of(
    scene: Scene, *, frequency: float, dynamic_range: float, table: Mapping[str, Material]
) -> World:
    """A scene made ready.

    Raises
    ------
    InputError
        A mesh or a plate is of a material that the table does not know.
    """
    meshed = [index for index, actor in enumerate(scene.actors) if actor.mesh.num_faces]
    used = {plate.material for actor in scene.actors for plate in actor.plates}
    used.update(name for index in meshed for name in scene.actors[index].mesh.materials)
    check_materials(used, table, frequency)
    clear = {name for name in used if power_through(table[name], frequency) >= CLEAR}
    materials = tuple(sorted(used))
    actors = [scene.actors[index] for index in meshed]
    return World(
        scene=scene,
        frequency=frequency,
        dynamic_range=dynamic_range,
        surfaces=tuple(
            surface_of(actor.mesh, tuple(name not in clear for name in actor.mesh.materials))
            for actor in actors
        ),
        body=np.array(meshed, dtype=np.int64),
        rotation=np.array([actor.pose.rotation for actor in actors]).reshape(-1, 3, 3),
        position=np.array([actor.pose.position for actor in actors]).reshape(-1, 3),
        velocity=np.array([actor.velocity for actor in actors]).reshape(-1, 3),
        plates=_plates(scene, materials),
        materials=materials,
        table=table,
    )


class Blockers(NamedTuple):
    """What may block, in the frame of one body: the fields of `Forest` and `Plates`, and poses.

    ``turn``, ``shift`` ``(body, …)`` take a point of this frame to the frame of each body. Flat,
    because a compiled parallel loop cannot take nested tuples.
    """

    box: FloatArray
    skip: IntArray
    first: IntArray
    size: IntArray
    triangle: FloatArray
    face: IntArray
    root: IntArray
    turn: FloatArray
    shift: FloatArray
    plate_centre: FloatArray
    plate_normal: FloatArray
    plate_across: FloatArray
    plate_along: FloatArray
    half_across: FloatArray
    half_along: FloatArray
    plate_medium: IntArray


def in_frame_of(world: World, rotation: FloatArray, position: FloatArray) -> Blockers:
    """All blockers, seen from a frame at ``position`` (m) turned by ``rotation``."""
    back = np.swapaxes(world.rotation, 1, 2)
    plates = world.plates
    return Blockers(
        *world.forest.tree,
        root=world.forest.root,
        turn=np.ascontiguousarray(back @ rotation),
        shift=np.einsum("bij,bj->bi", back, position - world.position),
        plate_centre=(plates.centre - position) @ rotation,
        plate_normal=plates.normal @ rotation,
        plate_across=plates.across @ rotation,
        plate_along=plates.along @ rotation,
        half_across=plates.half_across,
        half_along=plates.half_along,
        plate_medium=plates.medium,
    )


def bodies_near(world: World, ends: FloatArray, radius: float) -> IntArray:
    """Bodies that can block between a point and a sphere: m ``(2, xyz)`` and its radius at end 1.

    The two span a cone inside the capsule of that radius, which a body's own sphere must touch.
    """
    if not len(world.surfaces):
        return np.zeros(0, dtype=np.int64)
    start, way = ends[0], ends[1] - ends[0]
    length = max(float(way @ way), 1e-30)
    where = np.clip((world.centre - start) @ way / length, 0.0, 1.0)
    gap = np.linalg.norm(world.centre - start - where[:, None] * way, axis=-1)
    return np.flatnonzero(gap <= world.radius + radius)


def plates_near(world: World, ends: FloatArray, radius: float) -> IntArray:
    """Plates that can block between a point and a sphere: those not wholly on one side."""
    sides = np.einsum("epx,px->ep", ends[:, None] - world.plates.centre, world.plates.normal)
    return np.flatnonzero(
        (np.minimum(sides[0], sides[1] - radius) <= 0)
        & (np.maximum(sides[0], sides[1] + radius) >= 0)
    )


def everything(world: World) -> tuple[IntArray, IntArray]:
    """Numbers of all bodies and all plates."""
    return np.arange(len(world.surfaces)), np.arange(len(world.plates.actor))
