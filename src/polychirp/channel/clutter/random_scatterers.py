r"""Paths over many small scatterers of random phase, for rough surfaces and for leaves.

A scatterer p of mean cross section :math:`\sigma_p(t, x) = g_p(t)\,g_p(x)` between radars t and x,
at the distances :math:`r_t` and :math:`r_x` from them, makes a path of the amplitude

.. math:: A = \frac{\lambda}{(4\pi)^{3/2}}\,\frac{\sqrt{g_p(t)}\,\sqrt{g_p(x)}}{r_t r_x}\,S_p

(the radar equation), with a symmetric matrix S of constant random phases φ,

.. math:: S = \begin{pmatrix}
    \sqrt{1-\chi}\,e^{j\varphi_1} & \sqrt\chi\,e^{j\varphi_3} \\
    \sqrt\chi\,e^{j\varphi_3} & \sqrt{1-\chi}\,e^{j\varphi_2} \end{pmatrix}

in (V, H) of `frames.polarisation_basis` at either end. χ is the cross-polarised share of the
scattered power. Both columns have the power 1, so that σ is the sum over both received
polarisations; S is symmetric, so that paths are reciprocal. In directions close to the vertical,
the (V, H) basis turns quickly with the direction, and the phases with the basis.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths
from polychirp.channel.direct.point_scatterers import echoes_over
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.shadow_tests import strongest_visible
from polychirp.channel.scene.transmission import transmission_matrices, with_leg_losses
from polychirp.channel.scene.world import World
from polychirp.model.paths import Bounce, PropagationPaths

MAX_POINTS_PER_PAIR: Final = 2000
"""Greatest number of points tried for a pair of radars; the strongest are taken. Chosen."""


class Scatterers(NamedTuple):
    """Scattering points of one world.

    ``position`` m ``(point, xyz)``; ``actor`` number ``(point,)``; ``matrix`` S ``(point, 2, 2)``;
    ``reach`` √m ``(radar, point)``: √g towards every radar, 0 if the point is certainly hidden.
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
    """Random matrices S ``(point, 2, 2)``; ``cross_share`` is χ, 0 to 1.

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
    """Paths of ``pairs`` ``(pair, 2)`` over the strongest points, `MAX_POINTS_PER_PAIR` at most.

    Of these points, those are kept that are visible and within the world's dynamic range of the
    strongest visible one. Their powers include the gains of both radars' elements, but no losses
    in sheets and leaves.
    """
    seen = _power_factors(world, points)
    group, number = [], []
    for row, (transmitter, receiver) in enumerate(pairs):
        power = seen[transmitter] * seen[receiver]
        chosen = np.flatnonzero(power > 0)
        if len(chosen) > MAX_POINTS_PER_PAIR:
            order = np.argpartition(-power[chosen], MAX_POINTS_PER_PAIR - 1)
            chosen = np.sort(chosen[order[:MAX_POINTS_PER_PAIR]])
        group.append(np.full(len(chosen), row))
        number.append(chosen)
    if not sum(map(len, number)):
        return no_paths(world.scene, world.frequency)
    of_pair, of_point = np.concatenate(group), np.concatenate(number)
    ends, sees = pairs[of_pair], _Visibility(world, points.position)
    kept = strongest_visible(
        seen[ends[:, 0], of_point] * seen[ends[:, 1], of_point],
        of_pair,
        lambda some: sees(ends[some, 0], of_point[some]) & sees(ends[some, 1], of_point[some]),
        world.dynamic_range,
    )
    return _paths(world, ends[kept], of_point[kept], points)


def _power_factors(world: World, points: Scatterers) -> FloatArray:
    """g/r² times the gain of the radar's element, 1/m ``(radar, point)``: factors of path power."""
    scene, seen = world.scene, np.zeros(points.reach.shape)
    for row, radar in enumerate(scene.radars):
        some = np.flatnonzero(points.reach[row])
        way = points.position[some] - scene.radar_position[row]
        gain = radar.array.pattern.gain(way @ scene.radar_rotation[row])
        seen[row, some] = points.reach[row, some] ** 2 * gain / np.sum(way**2, axis=-1)
    return seen


class _Visibility:
    """Visibility of points from radars; every pair of a radar and a point is tested once."""

    def __init__(self, world: World, position: FloatArray) -> None:
        self.world, self.position = world, position
        shape = len(world.scene.radars), len(position)
        self.is_known, self.is_visible = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)

    def __call__(self, radar: IntArray, point: IntArray) -> BoolArray:
        """Mask ``(ray,)``: true if the ray's point is visible from the ray's radar."""
        wanted = np.zeros(self.is_known.shape, dtype=np.bool_)
        wanted[radar, point] = True
        rows, columns = np.nonzero(wanted & ~self.is_known)
        if len(rows):
            start = self.world.scene.radar_position[rows]
            self.is_visible[rows, columns] = ~blocked(self.world, start, self.position[columns])
            self.is_known[rows, columns] = True
        return np.asarray(self.is_visible[radar, point])


def _paths(world: World, pair: IntArray, number: IntArray, points: Scatterers) -> PropagationPaths:
    """Paths of pairs ``(path, 2)`` over one visible point each."""
    reach = points.reach[pair[:, 0], number] * points.reach[pair[:, 1], number]
    legs = _losses(world, pair.T, number, points.position)
    return echoes_over(
        world.scene,
        frequency=world.frequency,
        pair=pair,
        actor=points.actor[number],
        point=points.position[number],
        scattering=with_leg_losses(reach[:, None, None] * points.matrix[number], *legs),
        kind=Bounce.DIFFUSE,
    )


def _losses(world: World, radar: IntArray, number: IntArray, position: FloatArray) -> ComplexArray:
    """Transmission through thin sheets and leaves on the ways to points, ``(end, path, 2, 2)``.

    ``radar`` ``(end, path)`` are the radars at transmitting and receiving end, ``number``
    ``(path,)`` the points; the way from a radar to a point is computed once.
    """
    ways, which = np.unique(radar * len(position) + number, return_inverse=True)
    start, end = np.divmod(ways, len(position))
    return transmission_matrices(world, world.scene.radar_position[start], position[end])[which]
