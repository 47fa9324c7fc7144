"""Canonical bodies as triangles, halves of cells, and scenes with isotropic radars around them."""

from collections.abc import Sequence

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.mesh import Mesh
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene


def mesh_of(corners: FloatArray, material: str = "metal") -> Mesh:
    """A mesh of one material, of triangles with ``corners``, m ``(face, corner, xyz)``."""
    size = len(corners)
    return Mesh(
        vertex=corners.reshape(-1, 3),
        face=np.arange(3 * size).reshape(-1, 3),
        material=np.zeros(size, dtype=np.int64),
        part=np.zeros(size, dtype=np.int64),
        materials=(material,),
        parts=("body",),
    )


def _sheet(points: FloatArray) -> FloatArray:
    """Two triangles, ``(face, corner, xyz)``, for each cell of a grid ``(row, column, xyz)``."""
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate(
        [
            np.stack([a, b, c], axis=2).reshape(-1, 3, 3),
            np.stack([a, c, d], axis=2).reshape(-1, 3, 3),
        ]
    )


def plate(side: float, edge: float) -> FloatArray:
    """A square in the plane x = 0 that faces +x: m ``(face, corner, xyz)``, cells up to ``edge``.

    >>> plate(0.1, 0.06).shape
    (8, 3, 3)
    """
    line = np.linspace(-side / 2, side / 2, int(np.ceil(side / edge)) + 1)
    y, z = np.meshgrid(line, line, indexing="ij")
    return _sheet(np.stack([np.zeros_like(y), y, z], axis=-1))


def sphere(radius: float, edge: float) -> FloatArray:
    """A sphere about the origin, m ``(face, corner, xyz)``, cells up to about ``edge``."""
    count = int(np.ceil(np.pi / 2 * radius / edge))
    line = np.tan(np.linspace(-np.pi / 4, np.pi / 4, count + 1))
    u, v = np.meshgrid(line, line, indexing="ij")
    faces = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            points = np.stack([np.full_like(u, sign), sign * u, v], axis=-1)
            faces.append(_sheet(np.roll(points, axis, axis=-1)))
    corners = np.concatenate(faces)
    return np.asarray(radius * corners / np.linalg.norm(corners, axis=-1, keepdims=True))


def box(size: Sequence[float], edge: float) -> FloatArray:
    """A box about the origin of ``size`` xyz: m ``(face, corner, xyz)``, cells up to ``edge``."""
    faces = []
    for axis in range(3):
        u, v = (
            np.linspace(-0.5, 0.5, int(np.ceil(size[(axis + k) % 3] / edge)) + 1) for k in (1, 2)
        )
        for sign in (1.0, -1.0):
            y, z = np.meshgrid(sign * u, v, indexing="ij")
            points = np.stack([np.full_like(y, 0.5 * sign), y, z], axis=-1)
            faces.append(_sheet(np.roll(points, axis, axis=-1)))
    return np.asarray(np.concatenate(faces) * np.array(size))


def dihedral(side: float, edge: float) -> FloatArray:
    """Two squares at right angles, m ``(face, corner, xyz)``, open towards +x, crease along z.

    >>> dihedral(0.1, 0.1).shape
    (4, 3, 3)
    """
    turn = np.sqrt(0.5)
    flat = plate(side, edge) + np.array([0.0, side / 2, 0.0])
    left = flat @ np.array([[turn, -turn, 0.0], [turn, turn, 0.0], [0.0, 0.0, 1.0]])
    right = left[:, ::-1] * np.array([1.0, -1.0, 1.0])
    return np.concatenate([left, right])


def trihedral(side: float, edge: float) -> FloatArray:
    """Three triangles with right angles at the origin, open towards +x: m ``(face, corner, xyz)``.

    ``side`` is the length of the sides at the right angles. Each triangle is cut into similar ones,
    whose sides at the right angle are at most ``edge``.

    >>> trihedral(0.1, 0.05).shape
    (12, 3, 3)
    """
    count = int(np.ceil(side / edge))
    # corners of the small triangles, in steps along both sides at the right angle
    u, v = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    cell = np.stack([u, v], axis=-1).reshape(-1, 1, 2)
    lower = cell + np.array([[0, 0], [1, 0], [0, 1]])
    upper = cell + np.array([[1, 0], [1, 1], [0, 1]])
    steps = np.concatenate([t[t.sum(axis=-1).max(axis=-1) <= count] for t in (lower, upper)])
    # directions of the three sides at the origin, at equal angles about x
    angle = 2 * np.pi / 3 * np.arange(3)
    ways = np.stack([np.full(3, np.sqrt(0.5)), np.cos(angle), np.sin(angle)], axis=-1)
    ways *= side / count * np.sqrt(2 / 3)
    return np.concatenate([steps @ ways[[i, (i + 1) % 3]] for i in range(3)])


def around(
    actors: Sequence[Actor],
    places: Sequence[Sequence[float]],
    *,
    velocities: Sequence[Sequence[float]] | None = None,
) -> Scene:
    """Scene of ``actors`` and isotropic radars "0", "1", … at ``places`` (m) on bare carriers."""
    moves = velocities or [(0.0, 0.0, 0.0)] * len(places)
    carriers = tuple(
        Actor(
            name=f"carrier {number}",
            kind="vehicle",
            pose=Pose(x=float(x), y=float(y), z=float(z)),
            velocity=(float(move[0]), float(move[1]), float(move[2])),
        )
        for number, ((x, y, z), move) in enumerate(zip(places, moves, strict=True))
    )
    return Scene(
        time=0.0,
        actors=(*carriers, *actors),
        radars=tuple(
            Radar(name=str(number), array=AntennaArray(pattern=ISOTROPIC))
            for number in range(len(places))
        ),
        carriers=tuple(range(len(places))),
    )


def transfer_at(
    paths: PropagationPaths, frequency: float, transmitter: int = 0, receiver: int = 0
) -> ComplexArray:
    """Sum of a pair's paths with phases at ``frequency``, Hz: ``(receiving, transmitting)``."""
    mine = paths.select((paths.transmitter == transmitter) & (paths.receiver == receiver))
    turn = np.exp(-2j * np.pi * frequency * mine.delay)
    return np.asarray(np.sum(mine.transfer * turn[:, None, None], axis=0))
