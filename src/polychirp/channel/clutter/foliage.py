r"""Crowns of trees: clouds in which waves are scattered once and attenuated.

First-order radiative transfer: a cloud attenuates the power by :math:`e^{-\alpha l}` over a length
l, and scatters the share ω (albedo) of that loss. Scattered evenly in all directions, a volume V
has the bistatic cross section

.. math:: \sigma = \omega\,\alpha\,\int_V e^{-\alpha\,(l_1 + l_2)}\,dV

with l₁, l₂ the lengths of both legs inside crowns (Ulaby, Moore & Fung 1986, ch. 13). N points at
random in the crown, of cross section ωαV/N and random phase each, represent the integral. They
are fixed in the tree's frame: the echo of a crown fluctuates as the radars move, and is the same
in the next snapshot.

Limits: single scattering, so that a crown that is deep compared with 1/(αω) is too dark; no
coherent backscatter; leaves that do not move in the wind; no preferred direction, though real
leaves scatter most forwards; equal scatterers, though the trunk and the boughs in a crown are
stronger. The cross-polarised share is that of thin needles in all directions:
:math:`\langle|S_{vh}|^2\rangle : \langle|S_{vv}|^2\rangle = 1/15 : 1/5`.
"""

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
from polychirp.channel.geometry.enclosure import enclosed_volume, winding_numbers
from polychirp.channel.scene.world import World
from polychirp.errors import InputError
from polychirp.model.mesh import Mesh
from polychirp.model.paths import PropagationPaths
from polychirp.rng import Streams

POINT_SPACING: Final = 0.5
"""Edge of the cube for which a crown has one point, m, within `POINT_COUNT_RANGE`. Chosen."""

POINT_COUNT_RANGE: Final = (32, 512)
"""Least and greatest number of points in a crown. Chosen."""

CROSS_POLARISED_SHARE: Final = 0.25
"""χ, share of the scattered power that is cross-polarised: that of randomly oriented needles."""


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
    """Random points inside the faces of a material; the same arguments give the same points."""
    corners = mesh.corners[mesh.material == mesh.materials.index(material)]
    volume = enclosed_volume(corners)
    if not volume > 0:
        raise InputError(
            f"the faces of '{material}' of '{name}' enclose no volume; close them, and turn them "
            "counter-clockwise seen from outside"
        )
    rng = Streams(seed)["foliage", name, material]
    wanted = int(np.clip(np.ceil(volume / POINT_SPACING**3), *POINT_COUNT_RANGE))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    found = np.zeros((0, 3))
    while len(found) < wanted:
        trial = low + (high - low) * rng.random((wanted, 3))
        found = np.concatenate([found, trial[winding_numbers(corners, trial) > 0.5]])
    return _Crown(found[:wanted], random_matrices(rng, wanted, CROSS_POLARISED_SHARE), volume)


def _in_crown(world: World, body: int, material: str, seed: int) -> Scatterers:
    """Points of one tree as scatterers, without the attenuation on the way."""
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
