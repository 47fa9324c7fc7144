r"""Powers of the sums of all ramps, for blocks of neighbouring range rates at once.

Range rates of a block share the places that the profiles have at its middle :math:`v_0`. At
:math:`v_0 \pm u` the phase of ramp k differs from that at :math:`v_0` by :math:`\mp\omega_k u`,
with :math:`\omega_k = 4\pi f_k (t_k - t_0)/c`. So two sums with real factors serve two range rates,
which takes half the products of separate sums:

.. math:: Y(v_0 \pm u) = \sum_k z_k \cos\omega_k u \mp j \sum_k z_k \sin\omega_k u,

with the profiles :math:`z_k` turned to the phases at :math:`v_0`. A place differs from the true one
by half a step and `MOST_DRIFT` steps at most.

Neighbouring ramps turn nearly alike within a block. Their cosines and sines are therefore replaced
by the straight lines :math:`\alpha + \beta\omega_k` that fit best in each group of ramps:

.. math:: \sum_k z_k \cos\omega_k u \approx \sum_g \Big(\alpha_g(u) \sum_{k\in g} z_k
          + \beta_g(u) \sum_{k\in g} \omega_k z_k\Big).

The two sums of a group serve all range rates of the block, so that fewer products are left for each
of them. Phases that are replaced by their projection lose as much of a point's power relative to
the noise as the projection leaves of them, `MOST_LOSS` at most; this is 0.1 dB.
"""

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import reordered, reordered_inner
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.profiles import STEPS_PER_RANGE, Profiles, shifts

MOST_DRIFT = 0.8
"""Greatest change of a place within a block, in steps of the profiles, 1/8 range cell each; chosen.
With half a step of rounding, the mean square of the distance from the true place is
:math:`(1/12 + 0.8^2/3)/8^2` cells at most. Of a :math:`\\mathrm{sinc}^2` lobe this takes
:math:`\\pi^2/3` times as much of the power, 0.07 dB; at twice as much it would be 0.2 dB."""

MOST_RATES = 16
"""Greatest number of range rates in a block; chosen: more save less than 1/10 of the products."""

CACHE = 2**17
"""Number of bytes of turned profiles that are summed at once; chosen below a core's second cache.
"""

BLOCKS_AT_ONCE = 8
"""Number of blocks that are summed for one channel after the other; chosen: their powers and the
profiles of a channel fit in a core's second cache."""

LANES = 16
"""Number of ranges of which a multiple is summed; chosen: no vector instruction is left in part."""

MOST_LOSS = 0.02
"""Greatest share of the power of the ramps' phasors that lines may leave at the ends of a block;
chosen: 0.09 dB."""

TOGETHER = 4
"""Number of ramps in one pass over the sums, as the kernel is written."""


def powers(
    seen: Observation, profiles: Profiles, memory: NDArray[np.float32] | None = None
) -> NDArray[np.float32]:
    """Power of the sum of all profiles in phase, over the weight, ``(range rate, range)``.

    The powers of all channels are added. They overwrite ``memory``, an array of this shape; None
    for a new one, whose pages take a fifth of the kernel's time.
    """
    axes = profiles.axes
    if memory is None:
        memory = np.empty((axes.range_rate.size, axes.range.size), dtype=np.float32)
    size = rates_per_block(seen, profiles)
    first = np.minimum(np.arange(0, axes.range_rate.size, size), axes.range_rate.size - size)
    middle = axes.range_rate[first] + 0.5 * (size - 1) * axes.range_rate_step
    place, turn = profiles.places(seen, middle)
    omega = 4.0 * np.pi / SPEED_OF_LIGHT * seen.frequency * (seen.middle - seen.model.time)
    offset = axes.range_rate_step * (np.arange(size // 2, dtype=np.float64) + 0.5)
    lines = Lines.of(omega, offset)
    tiles = -(-8 * axes.range.size * lines.cos.shape[1] // CACHE)
    width = LANES * -(-axes.range.size // (LANES * tiles))
    spare = ((0, 0), (0, lines.share.size - omega.size))  # ramps without power
    return np.asarray(
        _powers(
            profiles.value,
            np.pad(place, spare),
            np.pad(turn.astype(np.complex64), spare).view(np.float32),
            lines,
            first,
            total_weights(profiles.weight, place, axes.range.size),
            memory,
            width,
        )
    )


class Lines(NamedTuple):
    r"""Lines in place of the cosines and sines of groups of neighbouring ramps.

    Parameters
    ----------
    share : deviation of each ramp's :math:`\omega_k` from its group's mean, over the root mean
        square of these deviations, ``(ramp,)``; zero for ramps that fill the last group
    cos, sin : factors of every group's two sums, with 1 and with the share, at every offset of the
        range rate, ``(offset, 2 groups)``; those of each ramp's profile, ``(offset, ramp)``, if
        there are no groups; zeros fill the last `TOGETHER` of them
    length : number of ramps in a group; 0 if there are no groups
    """

    share: NDArray[np.float32]
    cos: NDArray[np.float32]
    sin: NDArray[np.float32]
    length: int

    @classmethod
    def of(cls, omega: FloatArray, offset: FloatArray) -> Self:
        """Lines of the longest groups that lose no more than `MOST_LOSS` at the last offset.

        Parameters
        ----------
        omega : change of every ramp's phase with the range rate, rad s/m
        offset : of the range rate from the middle of a block, m/s
        """
        length, found = TOGETHER, None
        while length <= omega.size and line_loss(omega, float(offset[-1]), length) <= MOST_LOSS:
            found, length = length, 2 * length
        if found is None:
            angle = np.pad(offset[:, None] * omega, ((0, 0), (0, -omega.size % TOGETHER)))
            none = np.zeros(angle.shape[1], dtype=np.float32)
            return cls(none, np.cos(angle).astype(np.float32), np.sin(angle).astype(np.float32), 0)
        share, kept = _shares(omega, found), _is_ramp(omega, found)
        basis = np.stack([kept, share], axis=1) / kept.sum(axis=1)[:, None, None]
        phasor = np.exp(1j * offset[:, None, None] * _in_groups(omega, found))
        factor = np.einsum("ogk,ghk->ogh", phasor, basis).reshape(offset.size, -1)
        factor = np.pad(factor, ((0, 0), (0, -factor.shape[1] % TOGETHER)))
        cos, sin = factor.real.astype(np.float32), factor.imag.astype(np.float32)
        return cls(share.ravel().astype(np.float32), cos, sin, found)


def _in_groups(value: FloatArray, length: int) -> FloatArray:
    """Values ``(ramp,)`` in groups, with zeros at the end of the last one, ``(group, ramp)``."""
    return np.pad(value, (0, -value.size % length)).reshape(-1, length)


def _is_ramp(omega: FloatArray, length: int) -> FloatArray:
    """1 at ramps, 0 where there are none, ``(group, ramp)``."""
    return _in_groups(np.ones(omega.size), length)


def _shares(omega: FloatArray, length: int) -> FloatArray:
    """`Lines.share` in groups, ``(group, ramp)``."""
    value, kept = _in_groups(omega, length), _is_ramp(omega, length)
    count = kept.sum(axis=1, keepdims=True)
    apart = (value - value.sum(axis=1, keepdims=True) / count) * kept
    spread = np.sqrt(np.sum(apart**2, axis=1, keepdims=True) / count)
    return np.asarray(apart / np.maximum(spread, np.finfo(np.float64).tiny))


def line_loss(omega: FloatArray, offset: float, length: int) -> float:
    """Share of the power of the phasors at an offset of the range rate that lines leave."""
    share, kept = _shares(omega, length), _is_ramp(omega, length)
    phasor = np.exp(1j * offset * _in_groups(omega, length)) * kept
    sums = np.stack([phasor.sum(axis=1), np.sum(share * phasor, axis=1)])
    explained = np.sum(np.abs(sums) ** 2 / kept.sum(axis=1))
    return float(1.0 - explained / omega.size)


def rates_per_block(seen: Observation, profiles: Profiles) -> int:
    """Even number of range rates within which no place changes by more than `MOST_DRIFT`."""
    axes = profiles.axes
    per_rate = np.max(np.abs(shifts(seen, np.array([axes.range_rate_step]))))
    drift = per_rate * STEPS_PER_RANGE / axes.range_step
    most = min(MOST_RATES, axes.range_rate.size - 1)  # the axis has three range rates or more
    return 2 * int(np.clip(MOST_DRIFT / drift + 0.5, 1, most // 2))


@reordered
def total_weights(weight: Any, place: Any, num_ranges: int) -> Any:  # pragma: no cover - compiled
    """Sums over ramps of weights at places ``(block, ramp)``: ``(block, range)``."""
    out = np.zeros((len(place), num_ranges), dtype=np.float32)
    for v in range(len(place)):
        for k in range(len(weight)):
            one = weight[k, place[v, k] % STEPS_PER_RANGE, place[v, k] // STEPS_PER_RANGE :]
            for i in range(num_ranges):
                out[v, i] += one[i]
    return out


@reordered
def _powers(  # pragma: no cover - compiled
    value: Any, place: Any, turn: Any, lines: Any, first: Any, weight: Any, out: Any, width: int
) -> Any:
    num_ranges, pairs = out.shape[1], len(lines.cos)
    # real parts, then imaginary ones; what lies beyond the map stays zero
    rows = np.zeros((lines.cos.shape[1], 2 * width), dtype=np.float32)
    z = np.zeros((TOGETHER, 2 * width), dtype=np.float32)
    a, b = np.empty(2 * width, dtype=np.float32), np.empty(2 * width, dtype=np.float32)
    power = np.empty((BLOCKS_AT_ONCE, 2 * pairs, width), dtype=np.float32)
    for left in range(0, num_ranges, width):
        used = min(width, num_ranges - left)
        for begin in range(0, first.size, BLOCKS_AT_ONCE):
            end = min(begin + BLOCKS_AT_ONCE, first.size)
            _fill_zero(power)
            for m in range(value.shape[1]):
                for block in range(begin, end):
                    own = power[block - begin]
                    if lines.length == 0:
                        _turn_into(value, m, place[block], turn[block], 0, left, used, rows)
                    else:
                        for k in range(0, place.shape[1], TOGETHER):
                            _turn_into(value, m, place[block], turn[block], k, left, used, z)
                            g, is_first = 2 * (k // lines.length), k % lines.length == 0
                            _add_group(z, lines.share[k : k + TOGETHER], is_first, rows[g : g + 2])
                    for p in range(pairs):
                        _sum_into(rows, lines.cos[p], lines.sin[p], a, b)
                        _add_powers(a, b, own[pairs - 1 - p], own[pairs + p])
            for block in range(begin, end):
                for h in range(2 * pairs):
                    _divide_into(
                        power[block - begin, h, :used],
                        weight[block, left : left + used],
                        out[first[block] + h, left : left + used],
                    )
    return out


@reordered_inner
def _fill_zero(value: Any) -> None:  # pragma: no cover - compiled
    flat = value.reshape(-1)
    for i in range(flat.size):
        flat[i] = np.float32(0.0)


@reordered_inner
def _divide_into(power: Any, weight: Any, out: Any) -> None:  # pragma: no cover - compiled
    for i in range(out.size):
        out[i] = power[i] / weight[i]


@reordered_inner
def _turn_into(
    value: Any, channel: int, place: Any, turn: Any, begin: int, left: int, used: int, z: Any
) -> None:  # pragma: no cover - compiled
    """Profiles of one channel at their places, turned: real parts, then imaginary ones, in place.

    They are those of as many ramps as ``z`` has rows, from ``begin`` on, at ``used`` ranges from
    ``left`` on.
    """
    width = z.shape[1] // 2
    for row in range(len(z)):
        k = begin + row
        c, s = turn[2 * k], turn[2 * k + 1]
        n, start = place[k] % STEPS_PER_RANGE, place[k] // STEPS_PER_RANGE + left
        ramp = min(k, value.shape[2] - 1)  # one that only fills the last group is turned by zero
        x = value[0, channel, ramp, n, start : start + used]
        y = value[1, channel, ramp, n, start : start + used]
        u, v = z[row, :used], z[row, width : width + used]
        for i in range(used):
            u[i] = x[i] * c - y[i] * s
            v[i] = x[i] * s + y[i] * c


@reordered_inner
def _add_group(z: Any, share: Any, is_first: bool, sums: Any) -> None:  # pragma: no cover
    """Add rows of ramps to the two sums of their group, in place; the first ones begin them."""
    whole, by_share = sums[0], sums[1]
    s0, s1, s2, s3 = share[0], share[1], share[2], share[3]
    old = np.float32(0.0) if is_first else np.float32(1.0)
    for i in range(whole.size):
        z0, z1, z2, z3 = z[0, i], z[1, i], z[2, i], z[3, i]
        whole[i] = old * whole[i] + z0 + z1 + z2 + z3
        by_share[i] = old * by_share[i] + z0 * s0 + z1 * s1 + z2 * s2 + z3 * s3


@reordered_inner
def _sum_into(z: Any, cos: Any, sin: Any, even: Any, odd: Any) -> None:  # pragma: no cover
    """Sums of rows with real factors, in place."""
    for i in range(even.size):
        even[i], odd[i] = np.float32(0.0), np.float32(0.0)
    for part in range(len(z) // TOGETHER):
        k = TOGETHER * part
        c0, c1, c2, c3 = cos[k], cos[k + 1], cos[k + 2], cos[k + 3]
        s0, s1, s2, s3 = sin[k], sin[k + 1], sin[k + 2], sin[k + 3]
        for i in range(even.size):
            z0, z1, z2, z3 = z[k, i], z[k + 1, i], z[k + 2, i], z[k + 3, i]
            even[i] += z0 * c0 + z1 * c1 + z2 * c2 + z3 * c3
            odd[i] += z0 * s0 + z1 * s1 + z2 * s2 + z3 * s3


@reordered_inner
def _add_powers(even: Any, odd: Any, below: Any, above: Any) -> None:  # pragma: no cover - compiled
    """Add the powers at both range rates of a pair, in place."""
    width = above.size
    for i in range(width):
        re, im = even[i] + odd[width + i], even[width + i] - odd[i]
        above[i] += re * re + im * im
        re, im = even[i] - odd[width + i], even[width + i] + odd[i]
        below[i] += re * re + im * im
