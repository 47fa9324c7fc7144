"""`Mesh`: triangles, each with a material; `Plate`: a flat rectangle too large to be meshed."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, FloatArray, IntArray, seal
from polychirp.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mesh:
    """A triangle mesh in its actor's frame; seen from outside, corners run counter-clockwise.

    `load_mesh` reads one from a file, and `vehicle_mesh` makes those of the built-in bodies.

    Parameters
    ----------
    vertex : positions, m, ``(vertex, xyz)``
    face : numbers of the three vertices of every triangle, ``(face, 3)``
    material : place of every triangle's material in ``materials``, ``(face,)``
    part : place of every triangle's part in ``parts``, ``(face,)``
    materials, parts : names, such as "metal", "glass" and "body", "windscreen"
    """

    vertex: Annotated[FloatArray, Axes("vertex", "3")]
    face: Annotated[IntArray, Axes("face", "3", dtype=np.int64)]
    material: Annotated[IntArray, Axes("face", dtype=np.int64)]
    part: Annotated[IntArray, Axes("face", dtype=np.int64)]
    materials: tuple[str, ...]
    parts: tuple[str, ...]

    def __post_init__(self) -> None:
        seal(self)
        for name, index, limit in (
            ("face", self.face, self.vertex.shape[0]),
            ("material", self.material, len(self.materials)),
            ("part", self.part, len(self.parts)),
        ):
            if index.size and not (index.min() >= 0 and index.max() < limit):
                raise InputError(f"Mesh.{name} points outside its table of {limit} entries")

    @property
    def num_faces(self) -> int:
        """Number of triangles."""
        return int(self.face.shape[0])

    @property
    def corners(self) -> FloatArray:
        """Corners of all triangles, m, ``(face, corner, xyz)``."""
        return self.vertex[self.face]


EMPTY_MESH = Mesh(
    vertex=np.zeros((0, 3)),
    face=np.zeros((0, 3), dtype=np.int64),
    material=np.zeros(0, dtype=np.int64),
    part=np.zeros(0, dtype=np.int64),
    materials=(),
    parts=(),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plate:
    """A flat rectangle such as a road or a wall, which reflects and occludes.

    An `Actor` has a tuple of them.

    Parameters
    ----------
    centre : m, ``(x, y, z)`` in the frame of its actor
    half_u, half_v : m, perpendicular vectors from the centre to the middles of two adjacent sides;
        the outward normal has the direction ``half_u × half_v``
    material, part : names, as in `Mesh`
    """

    centre: tuple[float, float, float]
    half_u: tuple[float, float, float]
    half_v: tuple[float, float, float]
    material: str
    part: str

    @property
    def normal(self) -> FloatArray:
        """Outward unit normal, ``(xyz,)``."""
        cross = np.cross(self.half_u, self.half_v)
        return np.asarray(cross / np.linalg.norm(cross))

    @property
    def triangles(self) -> FloatArray:
        """The plate's two triangles in the frame of its actor, m, ``(face, corner, xyz)``."""
        centre, u, v = (np.array(x) for x in (self.centre, self.half_u, self.half_v))
        a, b, c, d = centre - u - v, centre + u - v, centre + u + v, centre - u + v
        return np.array([[a, b, c], [a, c, d]])
