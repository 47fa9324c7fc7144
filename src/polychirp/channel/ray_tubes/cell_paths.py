r"""Paths from contributions: one for every smooth cell of path length.

Contributions c with the same transmitter, bodies, detour and receiver are summed in cells
of total path length with smooth weights w, a partition of unity. With S = Σwc, a cell's path has

.. math:: A = S e^{jkL}, \qquad
    \langle x\rangle = \mathrm{Re}\,\frac{\sum w\,\langle S, c\rangle x}{\langle S, S\rangle}

where x is its length L, its rate or one of its directions, and
:math:`\langle S, c\rangle = \sum S^*_{rt} c_{rt}` over all four entries of the transfer.
`physical_optics.cell_paths` uses the same ratio of moments, but with the V–V entry alone.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.base import gather, no_paths, path_table
from polychirp.channel.physical_optics.kernels import CELL_LENGTH
from polychirp.channel.scene.world import World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce, PropagationPaths

NO_ACTOR: Final = -1
"""`Contributions.detour` of waves that no other actor reflects on their way."""


class Contributions(NamedTuple):
    """Waves that points hit by rays radiate to receivers, ``(contribution, …)``.

    ``pair`` (transmitter, receiver) and ``body`` (first, last) are numbers, ``(contribution, 2)``.
    ``transfer`` ``(contribution, receiving, transmitting)`` includes the phase of ``length``, m,
    whose ``rate`` is in m/s and ``acceleration`` in m/s². ``direction`` (of departure, of arrival)
    and ``point``, m, on (the first, the last) body are ``(contribution, 2, xyz)``. Where both
    bodies are of one actor, ``detour`` is another actor that reflects the wave between them, at
    ``detour_point``, m ``(contribution, xyz)``; it is `NO_ACTOR` if there is none.
    """

    pair: IntArray
    body: IntArray
    transfer: ComplexArray
    length: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    direction: FloatArray
    point: FloatArray
    detour: IntArray
    detour_point: FloatArray

    def of(self, which: IntArray) -> "Contributions":
        """The contributions with the numbers ``which``."""
        return Contributions._make(field[which] for field in self)

    @property
    def reversed(self) -> "Contributions":
        """The same contributions from the receivers to the transmitters."""
        return self._replace(
            pair=self.pair[:, ::-1],
            body=self.body[:, ::-1],
            transfer=np.swapaxes(self.transfer, 1, 2),
            direction=self.direction[:, ::-1],
            point=self.point[:, ::-1],
        )


NO_CONTRIBUTIONS: Final = Contributions(
    pair=np.zeros((0, 2), dtype=np.int64),
    body=np.zeros((0, 2), dtype=np.int64),
    transfer=np.zeros((0, 2, 2), dtype=np.complex128),
    length=np.zeros(0),
    rate=np.zeros(0),
    acceleration=np.zeros(0),
    direction=np.zeros((0, 2, 3)),
    point=np.zeros((0, 2, 3)),
    detour=np.zeros(0, dtype=np.int64),
    detour_point=np.zeros((0, 3)),
)
"""Table of contributions without rows."""


def joined(parts: Sequence[Contributions]) -> Contributions:
    """All contributions of several tables, in their order."""
    return Contributions(*[np.concatenate(fields) for fields in zip(*parts, strict=True)])


def both_ways(found: Contributions) -> Contributions:
    """Contributions and their reverse, each with half the amplitude, as their mean is reciprocal.

    Only those are kept whose transmitter has no greater number than their receiver.
    """
    half = found._replace(transfer=0.5 * found.transfer)
    other = half.reversed
    return joined(
        [side.of(np.flatnonzero(side.pair[:, 0] <= side.pair[:, 1])) for side in (half, other)]
    )


class _Sums:
    """Sums of contributions over cells; ``cell`` is the number of each contribution's cell."""

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
    """Paths of contributions: one for each cell of the means of `both_ways`, and its reverse."""
    if not len(found.length):
        return no_paths(world.scene, world.frequency)
    half = both_ways(found)
    number = np.floor(half.length / CELL_LENGTH).astype(np.int64)
    x = half.length / CELL_LENGTH - number
    share = x * x * (3.0 - 2.0 * x)
    # every contribution counts twice: in the cell at its length or below, and in the next one
    weight = np.concatenate([1.0 - share, share])
    some = np.flatnonzero(weight > 0)
    twice, weight = np.tile(np.arange(len(x)), 2)[some], weight[some]
    ends = np.column_stack([half.pair, half.body, half.detour - NO_ACTOR])[twice]
    key = np.column_stack([ends, np.concatenate([number, number + 1])[some]])
    code = np.ravel_multi_index(tuple(key.T), tuple(key.max(axis=0) + 1))
    _, first, cell = np.unique(code, return_index=True, return_inverse=True)
    parts = half.of(twice)
    parts = parts._replace(transfer=weight[:, None, None] * parts.transfer)
    return _paths(world, key[first], _Sums(cell.reshape(-1), len(first)), parts)


def _paths(world: World, key: IntArray, sums: _Sums, parts: Contributions) -> PropagationPaths:
    """One path and its reverse for every cell.

    ``key`` ``(cell, 6)``: pair, bodies, detour from `NO_ACTOR` on, and number.
    """
    flat = parts.transfer.reshape(-1, 4)
    total = sums(flat.real) + 1j * sums(flat.imag)
    power = np.sum(np.abs(total) ** 2, axis=-1)
    unit = total / np.sqrt(np.where(power > 0, power, 1.0))[:, None]
    moment = np.sum(unit.conj()[sums.cell] * flat, axis=-1)
    moment /= np.sqrt(np.where(power > 0, power, 1.0))[sums.cell]
    share = moment.real
    weight = np.sum(np.abs(flat) ** 2, axis=-1)
    weight /= sums(weight)[sums.cell]
    middle = CELL_LENGTH * key[:, 5]
    numbers = np.concatenate(
        [(parts.length - middle[sums.cell])[:, None], parts.rate[:, None],
         parts.acceleration[:, None], parts.direction.reshape(-1, 6)], axis=1
    )  # fmt: skip
    mean, plain = sums(share[:, None] * numbers), sums(weight[:, None] * numbers)
    # where contributions almost cancel, power-weighted means replace the ratios of moments
    size = np.linalg.norm(mean[:, 3:].reshape(-1, 2, 3), axis=-1)
    is_wild = (np.abs(mean[:, 0]) > CELL_LENGTH) | np.any(np.abs(size - 1.0) > 0.2, axis=1)
    mean = np.where(is_wild[:, None], plain, mean)
    motion = _Motion(sums, moment, parts, mean[:, 1:3], world.wavenumber)
    length = middle + mean[:, 0]
    transfer = total.reshape(-1, 2, 2) * np.exp(1j * world.wavenumber * length)[:, None, None]
    found = Contributions(
        pair=key[:, :2],
        body=key[:, 2:4],
        transfer=transfer,
        length=length,
        rate=mean[:, 1],
        acceleration=mean[:, 2] + motion.glide,
        direction=mean[:, 3:].reshape(-1, 2, 3),
        point=sums(weight[:, None, None] * parts.point),
        detour=key[:, 4] + NO_ACTOR,
        detour_point=sums(weight[:, None] * parts.detour_point),
    )
    some = [found.detour == NO_ACTOR, found.detour != NO_ACTOR]
    rows = [np.flatnonzero(mask) for mask in some]
    return gather([_table(world, found.of(n), motion.coherence_time[n]) for n in rows if len(n)])


MOST_GLIDE: Final = 300.0
"""Greatest acceleration, m/s², by which points of reflection glide. Chosen: bodies that pass at
15 m/s within a metre have less; a cell that seems to have more is one of contributions that
cancel."""


class _Motion:
    r"""Deviations of a cell's contributions from the motion with one rate and one acceleration.

    With the deviations ν of their rates and a of their accelerations, the sum changes within t by

    .. math:: \frac{\sum c\,e^{-jk(\nu t + at^2/2)}}{\sum c} - 1 \approx
        -jkt\,\overline{\nu} - \tfrac12 t^2 (k^2\,\overline{\nu^2} + jk\,\overline{a})

    with means weighted by c, which are complex. The imaginary part of the last term is one more
    acceleration, ``glide``, m/s² ``(cell,)``: the point of reflection glides over the bodies.

    ``moment`` is ⟨S, c⟩/⟨S, S⟩ of each contribution; ``motion`` ``(cell, 2)`` the cell's rate and
    acceleration.
    """

    def __init__(
        self,
        sums: _Sums,
        moment: ComplexArray,
        parts: Contributions,
        motion: FloatArray,
        wavenumber: float,
    ) -> None:
        def mean(values: FloatArray) -> ComplexArray:
            return np.asarray(sums(moment.real * values) + 1j * sums(moment.imag * values))

        rate = parts.rate - motion[sums.cell, 0]
        bend = parts.acceleration - motion[sums.cell, 1]
        square = wavenumber**2 * mean(rate**2) + 1j * wavenumber * mean(bend)
        glide = square.imag / wavenumber
        self.glide = np.where(np.abs(glide) < MOST_GLIDE, glide, 0.0)
        self._first = wavenumber * np.abs(mean(rate))
        self._second = 0.5 * np.abs(square - 1j * wavenumber * self.glide)

    @property
    def coherence_time(self) -> FloatArray:
        """Time until both terms, without the glide, add up to one half, s ``(cell,)``."""
        below = self._first + np.sqrt(self._first**2 + 2 * self._second)
        return np.asarray(1.0 / np.maximum(below, 1e-12))


def _table(world: World, found: Contributions, coherence: FloatArray) -> PropagationPaths:
    """Table of paths, and of their reverse where they join two radars.

    All of them have a detour, or none has.
    """
    back = np.flatnonzero(found.pair[:, 0] != found.pair[:, 1])
    both = joined([found, found.reversed.of(back)])
    has_detour = np.all(both.detour != NO_ACTOR)
    between = [(Bounce.REFLECTION, both.detour, both.detour_point)] if has_detour else []
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
            *between,
            (Bounce.SCATTERING, world.body[both.body[:, 1]], both.point[:, 1]),
        ],
        coherence_time=np.concatenate([coherence, coherence[back]]),
        delay_acceleration=both.acceleration / SPEED_OF_LIGHT,
    )
