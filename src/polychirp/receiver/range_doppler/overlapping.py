r"""Two targets in one cell of a code, whose range rates differ by whole spans of the code.

Once the motion of one of the K range rates is removed, a target that is s spans
:math:`\lambda/2KT` faster has the samples

.. math:: Y_{ck} = a\, e^{j2\pi sk/K} \sum_l \overline{w_{kl}}\, e^{-ju(y_l + y_c)}

on channel c and sweep k of the block, with the elements' code w and the sine u of an azimuth, or of
an elevation if the virtual elements are above each other. All pairs of such
waves with different s are compared on a grid of azimuths, and the best ones between its points. The
pair whose least-squares fit leaves least is the maximum-likelihood pair in white noise.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray

BEAMS_PER_CHANNEL: Final = 4
"""Azimuths per step of the line of virtual channels. Chosen: between two of them, a plane wave
loses 0.22 dB."""

FALSE_PAIR: Final = 1e-4
"""Probability that noise counts as a second target of a cell. Chosen as that of the empty bands."""

LARGEST_LIKENESS: Final = 0.98
"""Greatest magnitude of the correlation of two waves that are told apart. Chosen: amplitudes of
waves that are more alike are 5 times as uncertain as that of one wave, or more."""


class TwoWaves(NamedTuple):
    """Two plane waves, the stronger first.

    shift : range rates above that of the cell, in spans ``(wave,)``
    cell : what each wave contributes, V ``(wave, channel, sweep of the block)``
    share : of each wave in the sum of their powers ``(wave,)``
    """

    shift: IntArray
    cell: ComplexArray
    share: FloatArray


def two_waves(
    cell: ComplexArray, *, code: ComplexArray, order: IntArray, steps: IntArray, noise: float
) -> TwoWaves | None:
    """The two waves of different range rates that explain most of a cell's power.

    None if one of them adds no more than noise to what the other explains.

    Parameters
    ----------
    cell : V ``(channel, sweep of the block)``
    code : weights of the elements ``(sweep of the block, element)``
    order : flat index into (element, channel) of each virtual channel
    steps : place of each virtual channel on their line, in steps of it
    noise : power of the noise of one channel and sweep, W
    """
    model = _Model(code=code, order=order, steps=steps, num_channels=cell.shape[0])
    found = _refined(model, cell, _best_of_grid(model, cell))
    for kept in (0, 1):
        # a weak wave may have the wrong shift until the strong one is between two grid points
        other = _refined(model, cell, _best_beside(model, cell, found, kept=kept))
        found = max(found, other, key=lambda pair: pair.power)
    pair = model.waves(found.shift, found.turn)
    alone = max(model.explained(cell, pair[one : one + 1]) for one in (0, 1))
    if found.power - alone < math.log(len(code) * order.size / FALSE_PAIR) * noise:
        return None
    amplitude = _least_squares(pair, cell)
    strength = np.abs(amplitude) ** 2
    by_power = np.argsort(-strength)
    return TwoWaves(
        shift=found.shift[by_power],
        cell=(amplitude[:, None, None] * pair)[by_power],
        share=(strength / strength.sum())[by_power],
    )


class _Pair(NamedTuple):
    """Shifts and azimuths of two waves ``(wave,)``, and the power that they explain, W.

    An azimuth is given by ``turn``, cycles from one step of the line to the next.
    """

    shift: IntArray
    turn: FloatArray
    power: float


class _Model(NamedTuple):
    """The code, order and places of the virtual channels, and number of receiving channels."""

    code: ComplexArray
    order: IntArray
    steps: IntArray
    num_channels: int

    @property
    def grid(self) -> FloatArray:
        """Azimuths that are tried, as cycles from one step of the line to the next."""
        count = BEAMS_PER_CHANNEL * (int(self.steps.max()) + 1)
        return np.arange(count) / count

    def waves(self, shift: IntArray, turn: FloatArray) -> ComplexArray:
        """Waves of unit energy, ``(wave, channel, sweep of the block)``."""
        length, elements = self.code.shape
        flat = np.empty((turn.size, self.order.size), dtype=np.complex128)
        flat[:, self.order] = np.exp(2j * np.pi * np.outer(turn, self.steps))
        by_element = flat.reshape(turn.size, elements, self.num_channels)
        still = np.einsum("kl,ulc->uck", self.code.conj(), by_element)
        faster = np.exp(2j * np.pi * np.outer(shift, np.arange(length)) / length)
        size = np.sqrt(np.sum(np.abs(still) ** 2, axis=(1, 2)))
        return np.asarray(faster[:, None] * still / size[:, None, None])

    def explained(self, cell: ComplexArray, waves: ComplexArray) -> float:
        """Power of the cell that a sum of waves explains at most, W."""
        fit = np.einsum("w,wck->ck", _least_squares(waves, cell), waves)
        return float(np.sum(np.abs(cell) ** 2) - np.sum(np.abs(cell - fit) ** 2))


def _least_squares(waves: ComplexArray, cell: ComplexArray) -> ComplexArray:
    """Amplitudes, V ``(wave,)``, of the waves in a cell."""
    columns = waves.reshape(len(waves), -1).T
    return np.asarray(np.linalg.lstsq(columns, cell.ravel(), rcond=None)[0])


def _best_of_grid(model: _Model, cell: ComplexArray) -> _Pair:
    """The best pair of all shifts and of all azimuths of the grid."""
    length, turn = len(model.code), model.grid
    still = np.zeros(turn.size, dtype=np.int64)
    dictionary = [model.waves(still + shift, turn) for shift in range(length)]
    matched = [np.einsum("uck,ck->u", waves.conj(), cell) for waves in dictionary]
    best = _Pair(still[:2], turn[:2], -math.inf)
    for apart in range(1, length):
        alike = np.einsum("uck,wck->uw", dictionary[0].conj(), dictionary[apart])
        for first in range(length - apart):
            power, place = _best_pair(matched[first], matched[first + apart], alike)
            if power > best.power:
                best = _Pair(np.array([first, first + apart]), turn[place], power)
    return best


def _best_pair(
    first: ComplexArray, second: ComplexArray, alike: ComplexArray
) -> tuple[float, IntArray]:
    r"""Greatest power that two waves explain together, and their numbers.

    .. math:: \frac{|b_1|^2 + |b_2|^2 - 2\,\mathrm{Re}(\bar b_1 g\, b_2)}{1 - |g|^2}

    with the matched amplitudes b and the waves' inner product g.
    """
    common = np.abs(alike) ** 2
    cross = (first.conj()[:, None] * alike * second).real
    power = np.abs(first[:, None]) ** 2 + np.abs(second) ** 2 - 2.0 * cross
    power = np.where(common < LARGEST_LIKENESS**2, power / np.maximum(1.0 - common, 1e-3), 0.0)
    place = np.array(np.unravel_index(np.argmax(power), power.shape))
    return float(power[tuple(place)]), place


def _refined(model: _Model, cell: ComplexArray, pair: _Pair) -> _Pair:
    """The pair with azimuths between those of the grid."""
    from scipy.optimize import minimize

    step = model.grid[1]

    def unexplained(off: FloatArray) -> float:
        return -model.explained(cell, model.waves(pair.shift, pair.turn + step * off))

    found = minimize(
        unexplained,
        np.zeros(2),
        method="Nelder-Mead",
        bounds=[(-1.0, 1.0)] * 2,
        options={"xatol": 1e-4, "fatol": 1e-9 * pair.power},
    )
    return _Pair(pair.shift, pair.turn + step * found.x, -float(found.fun))


def _best_beside(model: _Model, cell: ComplexArray, pair: _Pair, *, kept: int) -> _Pair:
    """One wave of a pair, and the best other wave of all other shifts and azimuths of the grid."""
    length, turn = len(model.code), model.grid
    fixed = model.waves(pair.shift[kept : kept + 1], pair.turn[kept : kept + 1])
    of_fixed = np.einsum("fck,ck->f", fixed.conj(), cell)
    best = _Pair(pair.shift, pair.turn, -math.inf)
    for shift in set(range(length)) - {int(pair.shift[kept])}:
        waves = model.waves(np.full(turn.size, shift), turn)
        alike = np.einsum("fck,uck->fu", fixed.conj(), waves)
        power, place = _best_pair(of_fixed, np.einsum("uck,ck->u", waves.conj(), cell), alike)
        if power > best.power:
            both = np.array([pair.turn[kept], turn[place[1]]])
            best = _Pair(np.array([pair.shift[kept], shift]), both, power)
    return best
