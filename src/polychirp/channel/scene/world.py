"""A scene prepared for rays: every mesh is prepared once and then only moved rigidly.

Every mesh becomes a `Surface` in its own frame, with a tree of its faces for every `Role`; the
trees of all bodies of a scene are concatenated in one `Tree`. A later snapshot of the scene changes
only the poses, so that nothing is rebuilt for it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Final, Literal, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.bvh import Tree, grow_tree
from polychirp.channel.materials.fresnel import Media, media_of
from polychirp.channel.materials.library import check_materials
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import turned_at_rate
from polychirp.model.material import Material
from polychirp.model.mesh import Mesh
from polychirp.model.scene import Scene
from polychirp.threads import side_by_side

PATCH_SIZE: Final = 0.08
"""Side of the cubes that divide a surface into patches, m. The facets of a patch share a shadow ray
and transmission losses. Chosen."""

PANEL_SIZE: Final = 0.24
"""Side of the cubes that divide patches into panels, m, which tell whether waves over a vehicle's
edges reach a body. Chosen."""

NUM_NEAR_PATCHES: Final = 9
"""Number of patches, the patch itself and its nearest ones, whose shadow rays must agree before its
facets are taken as lit or hidden without shadow rays of their own. Chosen."""

RADAR_CLEARANCE: Final = 0.02
"""Distance from a radar within which nothing blocks its rays, m. Chosen: its cover and its mount
lie within it."""

POLARISATION_AXES: Final = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""World's z axis, the reference of polarisation, and its y axis, which replaces z for waves along
z, as in `frames.polarisation_basis`."""

Role = Literal["opaque", "pane", "cloud"]
"""Role of a face for a ray: opaque, a thin sheet to cross, or the border of a cloud of leaves."""

ROLES: Final[tuple[Role, ...]] = ("opaque", "pane", "cloud")
"""All roles, in the order of `Forest.root`."""


def role_of(material: Material, *, transmission: bool = True) -> Role:
    """Role of a material's faces; thin sheets are panes, or opaque without ``transmission``."""
    if material.is_cloud:
        return "cloud"
    return "pane" if transmission and material.is_sheet else "opaque"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface:
    """A mesh in its own frame, prepared for physical optics and for rays.

    Faces of clouds of leaves are in the trees, but not among the faces that scatter.

    Parameters
    ----------
    centroid, normal, tangent : m and unit vectors, ``(face, xyz)``; normal × tangent is the
        second tangent
    corner : m from the centroid, ``(face, corner, xyz)``
    reach : distance of the farthest corner from the centroid, m ``(face,)``
    area : m², ``(face,)``; medium : number into ``materials``, ``(face,)``
    trees : trees of the faces of every `Role`
    tree_medium : number into ``materials`` of the triangles of every tree
    patch : number of the patch of neighbouring faces of similar direction, ``(face,)``
    patch_face : the face in the middle of every patch, ``(patch,)``
    patch_near : numbers of the patch itself and of the nearest patches, ``(patch, near)``
    panel_face : the face in the middle of every panel of patches of similar direction, ``(panel,)``
    centre, radius : m, of a sphere around all faces
    """

    centroid: FloatArray
    normal: FloatArray
    tangent: FloatArray
    corner: FloatArray
    reach: FloatArray
    area: FloatArray
    medium: IntArray
    materials: tuple[str, ...]
    trees: Mapping[Role, Tree]
    tree_medium: Mapping[Role, IntArray]
    patch: IntArray
    patch_face: IntArray
    patch_near: IntArray
    panel_face: IntArray
    centre: FloatArray
    radius: float


@lru_cache(maxsize=64)
def surface_of(mesh: Mesh, roles: tuple[Role, ...]) -> Surface:
    """Surface of a mesh whose materials have these roles; cached for later snapshots."""
    corners = mesh.corners
    double = _double_area(corners)
    real = double > 0  # a face without area neither scatters nor blocks
    corners, medium = corners[real], mesh.material[real]
    role = np.array(roles)[medium]
    trees = {name: grow_tree(corners[role == name]) for name in ROLES}
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    centre = 0.5 * (low + high)
    face = corners[role != "cloud"]
    double = _double_area(face)
    normal = np.cross(face[:, 1] - face[:, 0], face[:, 2] - face[:, 0]) / double[:, None]
    edge = face[:, 1] - face[:, 0]
    centroid = face.mean(axis=1)
    patch, patch_face = _patches(centroid, normal, PATCH_SIZE)
    _, panel_middle = _patches(centroid[patch_face], normal[patch_face], PANEL_SIZE)
    offset = np.ascontiguousarray(face - centroid[:, None])
    return Surface(
        centroid=centroid,
        normal=normal,
        tangent=edge / np.linalg.norm(edge, axis=-1, keepdims=True),
        corner=offset,
        reach=np.sqrt(np.max(np.sum(offset**2, axis=-1), axis=-1)),
        area=0.5 * double,
        medium=medium[role != "cloud"],
        materials=mesh.materials,
        trees=trees,
        tree_medium={name: medium[role == name][tree.face] for name, tree in trees.items()},
        patch=patch,
        patch_face=patch_face,
        patch_near=_near(centroid[patch_face]),
        panel_face=patch_face[panel_middle],
        centre=centre,
        radius=float(np.sqrt(np.max(np.sum((corners - centre) ** 2, axis=-1)))),
    )


@lru_cache(maxsize=6)
def _surfaces_of(kinds: tuple[tuple[Mesh, tuple[Role, ...]], ...]) -> tuple[Surface, ...]:
    """Surfaces of meshes with the roles of their materials; new ones are prepared in parallel."""
    unlike = tuple(dict.fromkeys(kinds))
    made = side_by_side([partial(surface_of, mesh, roles) for mesh, roles in unlike])
    surfaces = dict(zip(unlike, made, strict=True))
    return tuple(surfaces[kind] for kind in kinds)


def _double_area(corners: FloatArray) -> FloatArray:
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.linalg.norm(cross, axis=-1))


def _patches(centroid: FloatArray, normal: FloatArray, size: float) -> tuple[IntArray, IntArray]:
    """Patch of every face, and the face nearest to the middle of every patch."""
    key = np.concatenate([np.floor(centroid / size), np.round(1.5 * normal)], axis=1)
    key -= np.min(key, axis=0, initial=np.inf)
    shape = 1 + np.max(key, axis=0, initial=0)
    # patches are sorted by one number each: sorting their rows takes ten times as long
    one = np.ravel_multi_index(tuple(key.astype(np.int64).T), tuple(shape.astype(np.int64)))
    patch = np.unique(one, return_inverse=True)[1]
    counts = np.bincount(patch)
    middle = np.stack([np.bincount(patch, weights=x) / counts for x in centroid.T], axis=-1)
    off = np.sum((centroid - middle[patch]) ** 2, axis=-1)
    order = np.lexsort([off, patch])
    return patch, order[np.cumsum(counts) - counts]


def _near(middle: FloatArray) -> IntArray:
    """Numbers of the points nearest to each of some points, itself included: ``(point, near)``."""
    count = min(NUM_NEAR_PATCHES, len(middle))
    if not count:
        return np.zeros((0, 0), dtype=np.int64)
    number = cKDTree(middle).query(middle, k=count)[1]
    return np.asarray(number, dtype=np.int64).reshape(len(middle), count)


class Forest(NamedTuple):
    """Trees of several bodies, concatenated; bodies with the same surface share their trees.

    Body b has the nodes ``root[role, b, 0]:root[role, b, 1]``, with roles as in `ROLES`.
    """

    tree: Tree
    root: IntArray


@lru_cache(maxsize=6)
def forest_of(surfaces: tuple[Surface, ...]) -> Forest:
    """Concatenated trees of all surfaces."""
    none = grow_tree(np.zeros((0, 3, 3)))
    kinds = tuple(dict.fromkeys(surfaces))
    trees = [s.trees[role] for role in ROLES for s in kinds] or [none]
    root = np.concatenate([[0], np.cumsum([tree.skip.size for tree in trees])])
    offset = np.concatenate([[0], np.cumsum([tree.face.size for tree in trees])])
    kind = np.array([kinds.index(surface) for surface in surfaces], dtype=np.int64)
    number = np.arange(len(ROLES))[:, None] * len(kinds) + kind
    return Forest(
        tree=Tree(
            box=np.concatenate([tree.box for tree in trees]),
            skip=np.concatenate([t.skip + r for t, r in zip(trees, root[:-1], strict=True)]),
            first=np.concatenate([t.first + o for t, o in zip(trees, offset[:-1], strict=True)]),
            size=np.concatenate([tree.size for tree in trees]),
            triangle=np.concatenate([tree.triangle for tree in trees]),
            face=np.concatenate([tree.face for tree in trees]),
        ),
        root=np.stack([root[number], root[number + 1]], axis=-1),
    )


@lru_cache(maxsize=6)
def _forest_medium(surfaces: tuple[Surface, ...], materials: tuple[str, ...]) -> IntArray:
    numbers = [
        np.array([materials.index(name) for name in surface.materials], dtype=np.int64)[
            surface.tree_medium[role]
        ]
        for role in ROLES
        for surface in dict.fromkeys(surfaces)
    ]
    return np.concatenate([np.zeros(0, dtype=np.int64), *numbers])


class Plates(NamedTuple):
    """Rectangles in one common frame: m ``(plate, xyz)``, half sides m ``(plate,)``.

    ``actor`` and ``medium`` ``(plate,)`` are the numbers of the plate's actor and material.
    """

    centre: FloatArray
    normal: FloatArray
    across: FloatArray
    along: FloatArray
    half_across: FloatArray
    half_along: FloatArray
    actor: IntArray
    medium: IntArray

    def of(self, number: IntArray) -> "Plates":
        """Plates of these numbers; a number that is repeated gives a repeated plate."""
        return Plates._make(column[number] for column in self)


def _plates(scene: Scene, materials: tuple[str, ...]) -> Plates:
    """All plates of a scene, in the frame of the world."""
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
    """A scene at one instant, prepared for the mechanisms that find paths.

    Parameters
    ----------
    scene : the scene itself
    frequency : Hz
    dynamic_range : power ratio by which a path may be weaker than its pair of radars' strongest
    surfaces : surfaces of the bodies, in the order of ``body``
    body : numbers of the bodies' actors, ``(body,)``
    rotation, position, velocity : of the bodies, ``(body, xyz, xyz)``, m and m/s ``(body, xyz)``;
        the velocity is that at the position
    yaw_rate : of the bodies, rad/s, ``(body,)``
    plates : plates of the scene, in the frame of the world
    materials : names of all media
    table : materials by name
    transmission : True if thin sheets transmit waves; otherwise they block
    max_length : m, of the longest path that is followed
    caster : ray caster that `occlusion.blocked` uses for bodies; facets' shadows always use numba's
    """

    scene: Scene
    frequency: float
    dynamic_range: float
    surfaces: tuple[Surface, ...]
    body: IntArray
    rotation: FloatArray
    position: FloatArray
    velocity: FloatArray
    yaw_rate: FloatArray
    plates: Plates
    materials: tuple[str, ...]
    table: Mapping[str, Material]
    transmission: bool = True
    max_length: float = np.inf
    caster: Literal["numba", "embree"] = "numba"

    @property
    def wavenumber(self) -> float:
        """Wavenumber 2π/λ, 1/m."""
        return float(2 * np.pi * self.frequency / SPEED_OF_LIGHT)

    @cached_property
    def forest(self) -> Forest:
        """Trees of all faces, without plates."""
        return forest_of(self.surfaces)

    @property
    def forest_medium(self) -> IntArray:
        """Number into ``materials`` of the triangles of ``forest``, ``(triangle,)``."""
        return _forest_medium(self.surfaces, self.materials)

    @cached_property
    def translucent_bodies(self) -> IntArray:
        """Numbers of the bodies that have panes or clouds."""
        return np.array(
            [
                number
                for number, surface in enumerate(self.surfaces)
                if surface.trees["pane"].face.size or surface.trees["cloud"].face.size
            ],
            dtype=np.int64,
        )

    @cached_property
    def plate_is_pane(self) -> BoolArray:
        """Mask of the plates that are thin sheets, ``(plate,)``."""
        roles = [role_of(self.table[m], transmission=self.transmission) for m in self.materials]
        return np.array([role == "pane" for role in roles], dtype=np.bool_)[self.plates.medium]

    @cached_property
    def centre(self) -> FloatArray:
        """Centres of the bodies' spheres in the world, m, ``(body, xyz)``."""
        local = np.array([surface.centre for surface in self.surfaces]).reshape(-1, 3)
        return np.asarray(np.einsum("bij,bj->bi", self.rotation, local) + self.position)

    @cached_property
    def radius(self) -> FloatArray:
        """Radii of the bodies' spheres, m, ``(body,)``."""
        return np.array([surface.radius for surface in self.surfaces])

    @cached_property
    def media(self) -> Media:
        """Materials for kernels, in the order of ``materials``."""
        return media_of(self.materials, self.table, self.frequency)

    def velocity_at(self, body: int | IntArray, point: FloatArray) -> FloatArray:
        r"""Velocity of the matter of bodies at places in the world, m/s and m ``(…, xyz)``.

        .. math:: v + \omega\times(p - c)

        A place may be outside of its body: for the rate of a distance, all points p of the line on
        which it is measured are alike, since :math:`u\cdot(\omega\times u) = 0`.
        """
        way = point - self.position[body]
        return np.asarray(self.velocity[body] + turned_at_rate(self.yaw_rate[body], way))

    def acceleration_at(self, body: int | IntArray, point: FloatArray) -> FloatArray:
        """Acceleration of the matter of bodies at places in the world, m/s² ``(…, xyz)``."""
        steady = turned_at_rate(self.yaw_rate[body], self.velocity_at(body, point))
        if not self.scene.towed:
            return steady
        actor = np.broadcast_to(self.body[body], steady.shape[:-1])
        return self.scene.motion_at(actor, np.broadcast_to(point, steady.shape))[1]

    def bodies_of(self, actor: int) -> IntArray:
        """Numbers of the bodies of ``actor``: one or none."""
        return np.flatnonzero(self.body == actor)


def world_of(
    scene: Scene,
    *,
    frequency: float,
    dynamic_range: float,
    table: Mapping[str, Material],
    transmission: bool = True,
    max_length: float = np.inf,
    caster: Literal["numba", "embree"] = "numba",
) -> World:
    """World of a scene.

    `InputError` is raised if a mesh or a plate is of a material that the table does not know.
    """
    meshed = [index for index, actor in enumerate(scene.actors) if actor.mesh.num_faces]
    used = {plate.material for actor in scene.actors for plate in actor.plates}
    used.update(name for index in meshed for name in scene.actors[index].mesh.materials)
    check_materials(used, table, frequency)
    materials = tuple(sorted(used))
    roles = {name: role_of(table[name], transmission=transmission) for name in used}
    actors = [scene.actors[index] for index in meshed]
    kinds = [(actor.mesh, tuple(roles[name] for name in actor.mesh.materials)) for actor in actors]
    return World(
        scene=scene,
        frequency=frequency,
        dynamic_range=dynamic_range,
        surfaces=_surfaces_of(tuple(kinds)),
        body=np.array(meshed, dtype=np.int64),
        rotation=np.array([actor.pose.rotation for actor in actors]).reshape(-1, 3, 3),
        position=np.array([actor.pose.position for actor in actors]).reshape(-1, 3),
        velocity=np.array([actor.velocity for actor in actors]).reshape(-1, 3),
        yaw_rate=np.array([actor.yaw_rate for actor in actors], dtype=np.float64),
        plates=_plates(scene, materials),
        materials=materials,
        table=table,
        transmission=transmission,
        max_length=max_length,
        caster=caster,
    )


def bodies_near(world: World, ends: FloatArray, radius: float, *, margin: float = 0.0) -> IntArray:
    """Bodies that can block rays from the point ``ends[0]`` to the sphere about ``ends[1]``, m.

    The point and the sphere span a cone, of radius t·``radius`` at the share t of the way. A body
    can block if its own sphere touches that cone. The gap between them is a convex function of t,
    least where its slope is zero. Rays may begin within ``margin`` m of the point.
    """
    if not len(world.surfaces):
        return np.zeros(0, dtype=np.int64)
    start, way = ends[0], ends[1] - ends[0]
    length = max(float(np.linalg.norm(way)), 1e-15)
    gap = world.centre - start
    foot = gap @ way / length**2
    off = np.linalg.norm(gap - foot[:, None] * way, axis=-1)
    where = np.ones(len(foot))
    if length > radius:
        where = np.clip(foot + off * radius / (length * np.sqrt(length**2 - radius**2)), 0.0, 1.0)
    away = np.hypot(off, (where - foot) * length)
    return np.flatnonzero(away - where * radius <= world.radius + margin)


def plates_near(world: World, ends: FloatArray, radius: float, *, margin: float = 0.0) -> IntArray:
    """Plates whose planes pass between a point and a sphere, or cut the sphere.

    Rays may begin within ``margin`` m of the point.
    """
    sides = np.einsum("epx,px->ep", ends[:, None] - world.plates.centre, world.plates.normal)
    return np.flatnonzero(
        (np.minimum(sides[0] - margin, sides[1] - radius) <= 0)
        & (np.maximum(sides[0] + margin, sides[1] + radius) >= 0)
    )


def opaque_obstacles(world: World) -> tuple[IntArray, IntArray]:
    """Numbers of all bodies, and of all plates that are not panes."""
    return np.arange(len(world.surfaces)), np.flatnonzero(~world.plate_is_pane)
