r"""From contributions to paths: smooth cells of path length, and what each cell's path is.

Contributions c of one journey (transmitter, first body, last body, receiver) are gathered in
cells of total path length with smooth weights w, a partition of unity. With S = Σwc, a cell's
path has

.. math:: A = S e^{jkL}, \qquad
    \langle x\rangle = \mathrm{Re}\,\frac{\sum w\,\langle S, c\rangle x}{\langle S, S\rangle}

for its length L, rate and directions x, where :math:`\langle S, c\rangle = \sum S^*_{rt} c_{rt}`
over all four entries of the transfer: the moments' ratio of `facets`, but of whatever
polarisation the path has.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, path_table
from polychirp.channel.physical_optics.kernels import CELL_LENGTH
from polychirp.channel.scene.world import World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths


class Contributions(NamedTuple):
    """What tubes radiate, ``(contribution, …)``.

    ``pair`` (transmitter, receiver) and ``body`` (first, last) ``(contribution, 2)``;
    ``transfer`` ``(contribution, receiving, transmitting)`` with all phase in it; ``length`` m and
    its ``rate`` m/s; ``direction`` of departure and arrival and ``point`` on the first and the
    last body, ``(contribution, 2, xyz)``.
    """

    pair: IntArray
    body: IntArray
    transfer: ComplexArray
    length: FloatArray
    rate: FloatArray
    direction: FloatArray
    point: FloatArray

    def of(self, which: IntArray) -> Contributions:
        """Some of them, by number."""
        return Contributions(
            self.pair[which],
            self.body[which],
            self.transfer[which],
            self.length[which],
            self.rate[which],
            self.direction[which],
            self.point[which],
        )

    @property
    def reversed(self) -> Contributions:
        """The same journeys the other way round."""
        return self._replace(
            pair=self.pair[:, ::-1],
            body=self.body[:, ::-1],
            transfer=np.swapaxes(self.transfer, 1, 2),
            direction=self.direction[:, ::-1],
            point=self.point[:, ::-1],
        )


def joined(parts: Sequence[Contributions]) -> Contributions:
    """All contributions of several tables, in their order."""
    return Contributions(*[np.concatenate(fields) for fields in zip(*parts, strict=True)])


def both_ways(found: Contributions) -> Contributions:
    """Half of everything, and half of its reverse, for pairs of which the first is not greater."""
    half = found._replace(transfer=0.5 * found.transfer)
    other = half.reversed
    return joined(
        [side.of(np.flatnonzero(side.pair[:, 0] <= side.pair[:, 1])) for side in (half, other)]
    )


class _Sums:
    """Sums over the cells to which every contribution belongs: two each."""

    def __init__(self, cell: IntArray, num_cells: int) -> None:
        self.cell, self.num_cells = cell, num_cells

    def __call__(self, values: FloatArray) -> FloatArray:
        """Sums of ``(contribution, …)`` as ``(cell, …)``."""
        flat = values.reshape(len(values), -1)
        sums = [np.bincount(self.cell, weights=v, minlength=self.num_cells) for v in flat.T]
        return np.asarray(
            np.stack(sums, axis=-1).reshape(self.num_cells, *values.shape[1:]), dtype=np.float64
        )


def cell_paths(world: World, found: Contributions) -> PropagationPaths:
    """Paths of contributions and of their reverse, which is what reciprocity asks for."""
    if not len(found.length):
        return no_paths(world.scene, world.frequency)
    half = both_ways(found)
    number = np.floor(half.length / CELL_LENGTH).astype(np.int64)
    x = half.length / CELL_LENGTH - number
    share = x * x * (3.0 - 2.0 * x)
    # every contribution twice: in the cell below and in the one above
    weight = np.concatenate([1.0 - share, share])
    some = np.flatnonzero(weight > 0)
    twice, weight = np.tile(np.arange(len(x)), 2)[some], weight[some]
    journey = np.concatenate([half.pair, half.body], axis=1)[twice]
    key = np.column_stack([journey, np.concatenate([number, number + 1])[some]])
    code = np.ravel_multi_index(tuple(key.T), tuple(key.max(axis=0) + 1))
    _, first, cell = np.unique(code, return_index=True, return_inverse=True)
    parts = half.of(twice)
    parts = parts._replace(transfer=weight[:, None, None] * parts.transfer)
    return _paths(world, key[first], _Sums(cell.reshape(-1), len(first)), parts)


def _paths(world: World, key: IntArray, sums: _Sums, parts: Contributions) -> PropagationPaths:
    """One path for every cell, and its reverse; ``key``: pair, bodies and number of the cells."""
    flat = parts.transfer.reshape(-1, 4)
    total = sums(flat.real) + 1j * sums(flat.imag)
    power = np.sum(np.abs(total) ** 2, axis=-1)
    share = np.sum((total.conj()[sums.cell] * flat).real, axis=-1)
    share /= np.where(power > 0, power, 1.0)[sums.cell]
    loudness = np.sum(np.abs(flat) ** 2, axis=-1)
    loudness /= sums(loudness)[sums.cell]
    middle = CELL_LENGTH * key[:, 4]
    numbers = np.concatenate(
        [(parts.length - middle[sums.cell])[:, None], parts.rate[:, None],
         parts.direction.reshape(-1, 6)], axis=1
    )  # fmt: skip
    mean, plain = sums(share[:, None] * numbers), sums(loudness[:, None] * numbers)
    # where contributions all but cancel, their ratios mean nothing
    size = np.linalg.norm(mean[:, 2:].reshape(-1, 2, 3), axis=-1)
    is_wild = (np.abs(mean[:, 0]) > CELL_LENGTH) | np.any(np.abs(size - 1.0) > 0.2, axis=1)
    mean = np.where(is_wild[:, None], plain, mean)
    spread = np.sqrt(sums(loudness * (parts.rate - plain[sums.cell, 1]) ** 2))
    length = middle + mean[:, 0]
    transfer = total.reshape(-1, 2, 2) * np.exp(1j * world.wavenumber * length)[:, None, None]
    found = Contributions(
        pair=key[:, :2],
        body=key[:, 2:4],
        transfer=transfer,
        length=length,
        rate=mean[:, 1],
        direction=mean[:, 2:].reshape(-1, 2, 3),
        point=sums(loudness[:, None, None] * parts.point),
    )
    return _table(world, found, spread)


def _table(world: World, found: Contributions, spread: FloatArray) -> PropagationPaths:
    """Paths as they are, and the other way round between two radars."""
    back = np.flatnonzero(found.pair[:, 0] != found.pair[:, 1])
    both = joined([found, found.reversed.of(back)])
    spread = np.concatenate([spread, spread[back]])
    holds = np.where(spread > 1e-9, 1.0 / (world.wavenumber * np.maximum(spread, 1e-9)), np.inf)
    return path_table(
        scene=world.scene,
        frequency=world.frequency,
        pair=both.pair,
        delay=both.length / SPEED_OF_LIGHT,
        delay_rate=both.rate / SPEED_OF_LIGHT,
        transfer=both.transfer,
        departure=both.direction[:, 0],
        arrival=both.direction[:, 1],
        bounces=[
            (Bounce.REFLECTION, world.body[both.body[:, 0]], both.point[:, 0]),
            (Bounce.SCATTERING, world.body[both.body[:, 1]], both.point[:, 1]),
        ],
        coherence_time=holds,
    )
