r"""Crowns of trees: clouds in which waves are scattered once, and fade.

First-order radiative transfer: a cloud takes :math:`e^{-\alpha l}` of the power over a length l,
and scatters the share ω (albedo) of what it takes. Scattered evenly in all directions, a volume V
has the bistatic cross section

.. math:: \sigma = \omega\,\alpha\,\int_V e^{-\alpha\,(l_1 + l_2)}\,dV

with l₁, l₂ the ways of both legs inside crowns (Ulaby, Moore & Fung 1986, ch. 13). N points at
random in the crown, of cross section ωαV/N and random phase each, stand for the integral. They are
fixed in the tree's frame: the echo of a crown fluctuates as the radars move, and is the same in
the next snapshot.

Limits: single scattering, so that a crown that is deep beside 1/(αω) is too dark; no coherent
backscatter; leaves that do not move in the wind; no preferred direction, where real leaves
scatter most forwards; equal scatterers, where the trunk and the boughs in a crown are stronger.
The cross-polarised share is that of thin needles in all directions:
:math:`\langle|S_{vh}|^2\rangle : \langle|S_{vv}|^2\rangle = 1/15 : 1/5`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.clutter.random_scatterers import (
    Scatterers,
    joined,
    random_matrices,
    scattered_paths,
)
from polychirp.channel.scene.world import World
from polychirp.errors import InputError
from polychirp.model.mesh import Mesh
from polychirp.model.paths import PropagationPaths
from polychirp.rng import Streams

SPACING: Final = 0.5
"""m: a crown has one point for each cube of this edge, within `NUM_POINTS`."""

NUM_POINTS: Final = (32, 512)
"""Least and greatest number of points in a crown."""

CROSS_SHARE: Final = 0.25
"""χ, share of the power that returns cross-polarised: of randomly turned needles."""


def foliage_paths(world: World, pairs: IntArray, *, seed: int) -> PropagationPaths:
    r"""Paths of ``pairs`` ``(pair, 2)`` over the leaves of trees, own echoes included.

    .. math:: |A|^2 = \frac{\omega\alpha V}{N}\,
        \frac{\lambda^2\,e^{-\alpha(l_1+l_2)}}{(4\pi)^3 r_1^2 r_2^2}

    Faces of a material that `is_cloud` must close around a volume. The same seed gives the same
    points and phases in every snapshot; they depend on the actor's name and mesh alone.

    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.model.scene import Scene
    >>> empty = Composite().prepare(Scene(time=0.0, actors=()))
    >>> foliage_paths(empty, np.zeros((0, 2), dtype=np.int64), seed=1).num_paths
    0

    Raises
    ------
    InputError
        A cloud's faces enclose no volume.
    """
    parts = [
        _in_crown(world, body, name, seed)
        for body, surface in enumerate(world.surfaces)
        for name in surface.materials
        if world.table[name].is_cloud
    ]
    return scattered_paths(world, pairs, joined(parts, len(world.scene.radars)))


class _Crown(NamedTuple):
    """Points in a crown in its tree's frame, m ``(point, xyz)``, their matrices; volume, m³."""

    position: FloatArray
    matrix: ComplexArray
    volume: float


@lru_cache(maxsize=256)
def _crown(mesh: Mesh, material: str, seed: int, name: str) -> _Crown:
    """Points at random inside the faces of a material; the same arguments give the same ones."""
    corners = mesh.corners[mesh.material == mesh.materials.index(material)]
    volume = enclosed_volume(corners)
    if not volume > 0:
        raise InputError(
            f"the faces of '{material}' of '{name}' enclose no volume; close them, and turn them "
            "counter-clockwise seen from outside"
        )
    rng = Streams(seed)["foliage", name, material]
    wanted = int(np.clip(np.ceil(volume / SPACING**3), *NUM_POINTS))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    found = np.zeros((0, 3))
    while len(found) < wanted:
        trial = low + (high - low) * rng.random((wanted, 3))
        found = np.concatenate([found, trial[windings(corners, trial) > 0.5]])
    return _Crown(found[:wanted], random_matrices(rng, wanted, CROSS_SHARE), volume)


def enclosed_volume(corners: FloatArray) -> float:
    """M³ inside a closed surface of triangles, m ``(face, corner, xyz)``: the divergence theorem.

    >>> from polychirp.testing.shapes import box
    >>> round(enclosed_volume(box((1.0, 2.0, 3.0), 1.0)), 12)
    6.0
    """
    a, b, c = np.moveaxis(corners - corners.mean(axis=(0, 1)), 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6)


def windings(corners: FloatArray, points: FloatArray) -> FloatArray:
    r"""How often a closed surface winds about points, ``(point,)``: 1 inside, 0 outside.

    The sum of the triangles' solid angles over 4π (van Oosterom & Strackee 1983),

    .. math:: \tan\frac\Omega2 = \frac{a\cdot(b\times c)}
        {|a||b||c| + (a\cdot b)|c| + (b\cdot c)|a| + (c\cdot a)|b|}

    >>> from polychirp.testing.shapes import box
    >>> windings(box((1.0, 1.0, 1.0), 1.0), np.array([[0.2, 0.1, 0.3], [0.6, 0.0, 0.0]])).round(9)
    array([1., 0.])
    """
    turns = np.empty(len(points))
    for number, point in enumerate(points):
        a, b, c = np.moveaxis(corners - point, 1, 0)
        x, y, z = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
        above = np.sum(a * np.cross(b, c), axis=-1)
        below = x * y * z + np.sum(a * b, -1) * z + np.sum(b * c, -1) * x + np.sum(c * a, -1) * y
        turns[number] = np.sum(np.arctan2(above, below)) / (2 * np.pi)
    return turns


def _in_crown(world: World, body: int, material: str, seed: int) -> Scatterers:
    """The points of one tree as all radars see them, fading on the way left out."""
    number = int(world.body[body])
    actor, row = world.scene.actors[number], world.table[material]
    crown = _crown(actor.mesh, material, seed, actor.name)
    size = len(crown.position)
    area = row.albedo * row.attenuation * crown.volume / size
    return Scatterers(
        position=crown.position @ world.rotation[body].T + world.position[body],
        actor=np.full(size, number),
        matrix=crown.matrix,
        reach=np.full((len(world.scene.radars), size), area**0.25),
    )
