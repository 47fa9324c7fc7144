"""Canonical bodies of revolution as meshes: the round side of a cylinder, and a disc."""

from __future__ import annotations

import numpy as np

from polychirp.axes import FloatArray


def cylinder(radius: float, height: float, edge: float) -> FloatArray:
    """The round side of a cylinder about z, m ``(face, corner, xyz)``, arcs below ``edge``.

    Without ends. Corners are on the cylinder, and squares are cut in two; along z, where it is
    straight, sides are up to ten times ``edge``.

    >>> cylinder(0.05, 0.1, 0.01).shape
    (64, 3, 3)
    """
    around = np.linspace(0.0, 2 * np.pi, int(np.ceil(2 * np.pi * radius / edge)) + 1)
    along = np.linspace(-height / 2, height / 2, int(np.ceil(height / (10 * edge))) + 1)
    angle, z = np.meshgrid(around, along, indexing="ij")
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    halves = [np.stack(corners, axis=2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))]
    return np.concatenate(halves)


def disc(radius: float, edge: float) -> FloatArray:
    """A disc in the plane x = 0 that faces +x, m ``(face, corner, xyz)``, edges about ``edge``.

    Rings around the centre; the rim is a polygon of the disc's own area.

    >>> corners = disc(0.06, 0.01)
    >>> cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    >>> float(0.5 * cross[:, 0].sum() / np.pi / 0.06**2)
    1.0
    """
    spokes = max(24, int(np.ceil(2 * np.pi * radius / edge)))
    turn = 2 * np.pi / spokes
    reach = radius * np.sqrt(turn / np.sin(turn))
    rings = np.linspace(0.0, reach, int(np.ceil(reach / edge)) + 1)
    angle = turn * np.arange(spokes + 1)
    r, phi = np.meshgrid(rings, angle, indexing="ij")
    points = np.stack([np.zeros_like(r), r * np.cos(phi), r * np.sin(phi)], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    outer = np.stack([a, b, c], axis=2).reshape(-1, 3, 3)
    # at the centre the inner corners are one
    inner = np.stack([a[1:], c[1:], d[1:]], axis=2).reshape(-1, 3, 3)
    return np.concatenate([outer, inner])
