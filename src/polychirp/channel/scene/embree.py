"""Casting of rays among triangles by the library Embree, if ``embreex`` is installed.

Embree works in single precision: the rounding error of a ray's start is up to 6e-8 of its
coordinates. Meshes are therefore moved so that the middle of their bounding box is the origin, and
the distance of every hit is computed again in double precision from the triangle that was hit. For
rays that pass an edge at a distance below the rounding error, the triangle can differ from that of
`bvh.Caster`.
"""

from functools import lru_cache
from typing import Final, Literal

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.bvh import Caster, paired_rays
from polychirp.channel.geometry.caster_names import CasterName, RayCaster
from polychirp.channel.scene.world import Surface, World
from polychirp.errors import InputError

END_MARGIN: Final = 1e-6
"""Share of a ray's length, at each of its two ends, within which hits are ignored. Chosen: it
exceeds the relative rounding error of single precision, 6e-8."""


def has_embree() -> bool:
    """True if the package ``embreex`` can be imported."""
    try:
        import embreex.mesh_construction  # type: ignore[import-not-found,unused-ignore]  # noqa: F401
    except ImportError:
        return False
    return True


def caster_of(triangles: FloatArray, name: CasterName = "auto") -> RayCaster:
    """Ray caster for triangles, m ``(triangle, corner, xyz)``.

    The ``name`` "numba" needs no further package, "embree" needs ``embreex``, and "auto" means
    Embree if it is installed. `InputError` is raised if the name is "embree", and Embree is not
    installed.

    >>> caster = caster_of(np.array([[[1.0, -1, -1], [1.0, 1, -1], [1.0, 0, 1]]]), "numba")
    >>> float(caster.closest(np.zeros((1, 3)), np.array([[1.0, 0, 0]]))[0][0])
    1.0
    """
    return Caster(triangles) if caster_name(name) == "numba" else EmbreeCaster(triangles)


def caster_name(name: CasterName) -> Literal["numba", "embree"]:
    """Caster that a name selects on this machine: "auto" becomes "embree" or "numba".

    `InputError` is raised if the name is "embree", and Embree is not installed.

    >>> caster_name("numba")
    'numba'
    """
    if name == "auto":
        return "embree" if has_embree() else "numba"
    if name == "embree" and not has_embree():
        raise InputError(
            "rays on Embree need the package 'embreex' (pip install \"polychirp[embree]\"); "
            "install it, or use the caster 'numba'"
        )
    return name


class EmbreeCaster:
    """Casts rays among triangles, m ``(triangle, corner, xyz)``, on Embree.

    It has the methods of `bvh.Caster`. In `occluded`, triangles within the share
    `END_MARGIN` of a ray's length from its origin or its end do not block it. `InputError` is
    raised if ``embreex`` is not installed.
    """

    def __init__(self, triangles: FloatArray) -> None:
        caster_name("embree")
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._corners = np.asarray(triangles, dtype=np.float64).reshape(-1, 3, 3)
        self._middle = np.zeros(3)
        self._scene = EmbreeScene()
        if len(self._corners):
            flat = self._corners.reshape(-1, 3)
            self._middle = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
            TriangleMesh(self._scene, (self._corners - self._middle).astype(np.float32))

    def closest(self, origins: FloatArray, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance and face of the first hits, as `bvh.Caster.closest` gives them."""
        start, way = paired_rays(origins, directions)
        distance = np.full(len(start), np.inf)
        face = np.zeros(len(start), dtype=np.int64)
        if not len(self._corners) or not len(start):
            return distance, face
        unit = way / np.linalg.norm(way, axis=-1, keepdims=True)
        found = self._scene.run(
            (start - self._middle).astype(np.float32), unit.astype(np.float32), query="INTERSECT"
        )
        hit = found >= 0
        face[hit] = found[hit]
        corner = self._corners[face[hit]]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        height = np.sum(normal * (corner[:, 0] - start[hit]), axis=-1)
        distance[hit] = height / np.sum(normal * unit[hit], axis=-1)
        return distance, face

    def occluded(self, origins: FloatArray, ends: FloatArray) -> BoolArray:
        """Mask of the rays that are blocked, as `bvh.Caster.occluded` gives it."""
        start, stop = paired_rays(origins, ends)
        if not len(self._corners) or not len(start):
            return np.zeros(len(start), dtype=np.bool_)
        way = stop - start
        found = self._scene.run(
            (start + END_MARGIN * way - self._middle).astype(np.float32),
            way.astype(np.float32),
            dists=np.full(len(start), 1 - 2 * END_MARGIN, dtype=np.float32),
            query="OCCLUDED",
        )
        return np.asarray(found >= 0)


@lru_cache(maxsize=64)
def embree_of(surface: Surface) -> EmbreeCaster:
    """Caster of a surface's opaque faces in the body's frame, cached for later snapshots."""
    rows = surface.trees["opaque"].triangle
    return EmbreeCaster(
        np.stack([rows[:, :3], rows[:, :3] + rows[:, 3:6], rows[:, :3] + rows[:, 6:]], axis=1)
    )


def blocked_by_bodies(
    world: World, bodies: IntArray, starts: FloatArray, ends: FloatArray, clearance: float
) -> BoolArray:
    """Mask of the rays from ``starts`` to ``ends`` (world frame, m) that one of ``bodies`` blocks.

    Triangles within ``clearance``, m, of a ray's start do not block it.
    """
    out = np.zeros(len(starts), dtype=np.bool_)
    way = ends - starts
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    first = starts + np.minimum(clearance / np.maximum(length, 1e-30), 1.0) * way
    for body in bodies:
        left = np.flatnonzero(~out & (length[:, 0] > clearance))
        turn, place = world.rotation[body], world.position[body]
        caster = embree_of(world.surfaces[body])
        out[left] = caster.occluded((first[left] - place) @ turn, (ends[left] - place) @ turn)
    return out
