r"""Crowns of trees: clouds of leaves in which waves are attenuated and scattered once.

The model is first-order radiative transfer. A cloud attenuates the power by the factor
:math:`e^{-\alpha l}` over a length l, and scatters the share ω (albedo) of the lost power, evenly
in all directions. A crown of volume V then has the bistatic cross section

.. math:: \sigma = \omega\,\alpha\,\int_V e^{-\alpha\,(l_1 + l_2)}\,dV

where l₁ and l₂ are the lengths inside crowns of the legs to the transmitter and to the receiver
(Ulaby, Moore & Fung 1986, ch. 13). N random points in the crown represent the integral; each has
the cross section ωαV/N and a random phase. Points and phases are fixed in the tree's frame and do
not change between snapshots, so that the echo of a crown fluctuates only as radars or trees move.

Limits: multiple scattering is left out, so that the echo of a crown that is deep compared with
1/(αω) is too weak, and so is the enhancement of backscatter that multiple scattering causes. Leaves
do not move in the wind. Scattering has no preferred direction, whereas real leaves scatter mostly
forwards. All scatterers are equal, whereas trunk and boughs scatter more than leaves.
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
"""Edge of a cube, m: a crown has one point for each such cube in its volume, within the limits of
`POINT_COUNT_RANGE`. Chosen: a moderate cost of each crown."""

POINT_COUNT_RANGE: Final = (32, 512)
"""Least and greatest number of points in a crown. Chosen: enough points for an echo that fluctuates
like a sum of many, and a bound on the cost of large crowns."""

CROSS_POLARISED_SHARE: Final = 0.25
"""χ, share of the scattered power that is cross-polarised. It is that of thin needles in all
directions, whose mean powers ⟨|S_vh|²⟩ : ⟨|S_vv|²⟩ are 1/15 : 1/5."""


def foliage_paths(world: World, pairs: IntArray, *, seed: int) -> PropagationPaths:
    r"""Paths of ``pairs`` ``(pair, 2)`` over the leaves of trees, own echoes included.

    .. math:: |A|^2 = \frac{\omega\alpha V}{N}\,
        \frac{\lambda^2\,e^{-\alpha(l_1+l_2)}}{(4\pi)^3 r_1^2 r_2^2}

    Here r₁ and r₂ are the distances from a point to transmitter and receiver. The faces of a
    material that `is_cloud` must enclose a volume. Points and phases depend only on the seed, the
    actor's name, its mesh and the material. `InputError` is raised if a cloud's faces enclose no
    volume.

    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.model.scene import Scene
    >>> empty = Composite().prepare(Scene(time=0.0, actors=()))
    >>> foliage_paths(empty, np.zeros((0, 2), dtype=np.int64), seed=1).num_paths
    0
    """
    parts = [
        _in_crown(world, body, name, seed)
        for body, surface in enumerate(world.surfaces)
        for name in surface.materials
        if world.table[name].is_cloud
    ]
    return scattered_paths(world, pairs, joined(parts, len(world.scene.radars)))


class _Crown(NamedTuple):
    """Points of a crown.

    ``position`` m ``(point, xyz)`` in the tree's frame, ``matrix`` S ``(point, 2, 2)`` as in
    `random_scatterers`, ``volume`` m³ of the crown.
    """

    position: FloatArray
    matrix: ComplexArray
    volume: float


@lru_cache(maxsize=256)
def _crown(mesh: Mesh, material: str, seed: int, name: str) -> _Crown:
    """Random points in the volume that the faces of a material enclose.

    The same arguments give the same points.
    """
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
    """Points of one tree as scatterers; `scattered_paths` adds the attenuation in crowns."""
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
