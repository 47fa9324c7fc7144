r"""Paths over many small scatterers of random phase: what rough surfaces and leaves share.

A scatterer p of mean cross section :math:`\sigma_p(t, x) = g_p(t)\,g_p(x)` between radars t and x
makes the path

.. math:: A = \frac{\lambda}{(4\pi)^{3/2}}\,\frac{\sqrt{g_p(t)}\,\sqrt{g_p(x)}}{r_t r_x}\,S_p

(the radar equation), with a symmetric matrix S of fixed random phases,

.. math:: S = \begin{pmatrix}
    \sqrt{1-\chi}\,e^{j\varphi_1} & \sqrt\chi\,e^{j\varphi_3} \\
    \sqrt\chi\,e^{j\varphi_3} & \sqrt{1-\chi}\,e^{j\varphi_2} \end{pmatrix}

in (V, H) of `frames.polarisation_basis` at either end. χ is the share of the power that returns
cross-polarised; both columns have power 1, so σ counts both received polarisations; and S is
symmetric, so that the way back is the way there. Right below or above a scatterer the (V, H) basis
turns fast, and the phases with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths
from polychirp.channel.direct.point_scatterers import echoes_over
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.shadow_tests import strong_and_free
from polychirp.channel.scene.transmission import through, with_legs
from polychirp.channel.scene.world import World
from polychirp.model.paths import Bounce, PropagationPaths

MOST: Final = 2000
"""Points that are tried for a pair, the strongest."""


class Scatterers(NamedTuple):
    """Points of one world, ``(point, …)``.

    ``position`` m ``(point, xyz)``, ``actor``, ``matrix`` S ``(point, 2, 2)``, and ``reach`` √m
    ``(radar, point)``: √g towards every radar, 0 where it certainly does not see the point.
    """

    position: FloatArray
    actor: IntArray
    matrix: ComplexArray
    reach: FloatArray


def joined(parts: Sequence[Scatterers], num_radars: int) -> Scatterers:
    """All scatterers of several parts."""
    nothing = Scatterers(
        position=np.zeros((0, 3)),
        actor=np.zeros(0, dtype=np.int64),
        matrix=np.zeros((0, 2, 2), dtype=np.complex128),
        reach=np.zeros((num_radars, 0)),
    )
    together = [nothing, *parts]
    return Scatterers(
        position=np.concatenate([part.position for part in together]),
        actor=np.concatenate([part.actor for part in together]),
        matrix=np.concatenate([part.matrix for part in together]),
        reach=np.concatenate([part.reach for part in together], axis=1),
    )


def random_matrices(rng: np.random.Generator, size: int, cross_share: float) -> ComplexArray:
    """S ``(point, 2, 2)``, of which ``cross_share`` (χ, 0…1) of the power is cross-polarised.

    >>> s = random_matrices(np.random.default_rng(0), 5, 0.1)
    >>> np.sum(np.abs(s[0]) ** 2, axis=0), float(np.abs(s[0, 0, 1]) ** 2)
    (array([1., 1.]), 0.1)
    """
    turn = np.exp(2j * np.pi * rng.random((size, 3)))
    matrix = np.empty((size, 2, 2), dtype=np.complex128)
    matrix[:, 0, 0], matrix[:, 1, 1] = np.sqrt(1 - cross_share) * turn[:, :2].T
    matrix[:, 0, 1] = matrix[:, 1, 0] = np.sqrt(cross_share) * turn[:, 2]
    return matrix


def scattered_paths(world: World, pairs: IntArray, points: Scatterers) -> PropagationPaths:
    """Paths of ``pairs`` ``(pair, 2)`` over points, at most the `MOST` strongest of every pair.

    Of those, shadow rays go to what is within the dynamic range of the strongest that is free, all
    as the radars' elements see it and before thin sheets and leaves weaken it; what is weaker is
    left out.
    """
    seen = _as_seen(world, points)
    group, number = [], []
    for row, (transmitter, receiver) in enumerate(pairs):
        mine = seen[transmitter] * seen[receiver]
        chosen = np.flatnonzero(mine > 0)
        if len(chosen) > MOST:
            chosen = np.sort(chosen[np.argpartition(-mine[chosen], MOST - 1)[:MOST]])
        group.append(np.full(len(chosen), row))
        number.append(chosen)
    if not sum(map(len, number)):
        return no_paths(world.scene, world.frequency)
    of_pair, of_point = np.concatenate(group), np.concatenate(number)
    ends = pairs[of_pair]
    sight = _Sight(world, points.position)
    kept = strong_and_free(
        seen[ends[:, 0], of_point] * seen[ends[:, 1], of_point],
        of_pair,
        lambda some: (
            sight.is_free(ends[some, 0], of_point[some])
            & sight.is_free(ends[some, 1], of_point[some])
        ),
        world.dynamic_range,
    )
    return _paths(world, ends[kept], of_point[kept], points)


def _as_seen(world: World, points: Scatterers) -> FloatArray:
    """g/r² times the element's gain, ``(radar, point)``: factors of a path's power."""
    scene, seen = world.scene, np.zeros(points.reach.shape)
    for row, radar in enumerate(scene.radars):
        some = np.flatnonzero(points.reach[row])
        way = points.position[some] - scene.radar_position[row]
        gain = radar.array.pattern.gain(way @ scene.radar_rotation[row])
        seen[row, some] = points.reach[row, some] ** 2 * gain / np.sum(way**2, axis=-1)
    return seen


class _Sight:
    """Whether radars see points, each asked once."""

    def __init__(self, world: World, position: FloatArray) -> None:
        self.world, self.position = world, position
        # unknown, hidden, free
        self.known = np.full((len(world.scene.radars), len(position)), -1, dtype=np.int8)

    def is_free(self, radar: IntArray, point: IntArray) -> BoolArray:
        """``(ray,)``."""
        wanted = np.zeros(self.known.shape, dtype=np.bool_)
        wanted[radar, point] = True
        rows, columns = np.nonzero(wanted & (self.known < 0))
        if len(rows):
            start = self.world.scene.radar_position[rows]
            self.known[rows, columns] = ~blocked(self.world, start, self.position[columns])
        return np.asarray(self.known[radar, point] == 1)


def _paths(world: World, pair: IntArray, number: IntArray, points: Scatterers) -> PropagationPaths:
    """Paths of pairs ``(path, 2)`` over points of a number each, all free."""
    reach = points.reach[pair[:, 0], number] * points.reach[pair[:, 1], number]
    legs = _losses(world, pair.T, number, points.position)
    return echoes_over(
        world.scene,
        frequency=world.frequency,
        pair=pair,
        actor=points.actor[number],
        point=points.position[number],
        scattering=with_legs(reach[:, None, None] * points.matrix[number], *legs),
        kind=Bounce.DIFFUSE,
    )


def _losses(world: World, radar: IntArray, number: IntArray, position: FloatArray) -> ComplexArray:
    """What thin sheets and leaves leave on the ways to points, ``(end, path, 2, 2)``.

    ``radar`` is ``(end, path)``, ``number`` of the point ``(path,)``; every way is asked once.
    """
    ways, which = np.unique(radar * len(position) + number, return_inverse=True)
    start, end = np.divmod(ways, len(position))
    return through(world, world.scene.radar_position[start], position[end])[which]
