"""Names and interface of the ray casters, apart from the casters, as these load kernels."""

from typing import Literal, Protocol

from polychirp.axes import BoolArray, FloatArray, IntArray

CasterName = Literal["numba", "embree", "auto"]
"""Names of the ray casters; `embree.caster_name` tells which of them "auto" means here."""


class RayCaster(Protocol):
    """Interface of a set of triangles among which rays can be cast, such as `bvh.Caster`."""

    def closest(self, origins: FloatArray, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance to the first hit, m, infinite without one, and its face, ``(ray,)`` each."""

    def occluded(self, origins: FloatArray, ends: FloatArray) -> BoolArray:
        """Mask of the rays with a triangle between origin and end, ``(ray,)``."""
