r"""Powers of the sums of all ramps, for blocks of neighbouring range rates at once.

Range rates of a block share the places that the profiles have at its middle :math:`v_0`. At
:math:`v_0 \pm u` the phase of ramp k differs from that at :math:`v_0` by :math:`\mp\omega_k u`,
with :math:`\omega_k = 4\pi f_k (t_k - t_0)/c`. So two sums with real factors serve two range rates,
which takes half the products of separate sums:

.. math:: Y(v_0 \pm u) = \sum_k z_k \cos\omega_k u \mp j \sum_k z_k \sin\omega_k u,

with the profiles :math:`z_k` turned to the phases at :math:`v_0`. The phases are exact; a place
differs from the true one by half a step and `MOST_DRIFT` steps at most.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import reordered
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

LANES = 16
"""Number of ranges of which a multiple is summed; chosen: no vector instruction is left in part."""

TOGETHER = 4
"""Number of ramps in one pass over the sums, as the kernel is written."""


def powers(seen: Observation, profiles: Profiles) -> NDArray[np.float32]:
    """Power of the sum of all profiles in phase, over the weight, ``(range rate, range)``.

    The powers of all channels are added.
    """
    axes = profiles.axes
    size = rates_per_block(seen, profiles)
    first = np.minimum(np.arange(0, axes.range_rate.size, size), axes.range_rate.size - size)
    middle = axes.range_rate[first] + 0.5 * (size - 1) * axes.range_rate_step
    place, turn = profiles.places(seen, middle)
    omega = 4.0 * np.pi / SPEED_OF_LIGHT * seen.frequency * (seen.middle - seen.model.time)
    angle = axes.range_rate_step * (np.arange(size // 2)[:, None] + 0.5) * omega
    tiles = -(-8 * axes.range.size * len(omega) // CACHE)
    width = LANES * -(-axes.range.size // (LANES * tiles))
    spare = -len(omega) % TOGETHER  # ramps without power
    wider = ((0, 0), (0, spare))
    place = np.pad(place, wider)
    weight = _apart(profiles.weight[None], spare, width)[0]
    return np.asarray(
        _powers(
            np.stack(
                [
                    _apart(profiles.value.real, spare, width),
                    _apart(profiles.value.imag, spare, width),
                ]
            ),
            place,
            np.pad(turn.astype(np.complex64), wider).view(np.float32),
            np.pad(np.cos(angle), wider).astype(np.float32),
            np.pad(np.sin(angle), wider).astype(np.float32),
            first,
            _total_weights(weight, place, axes.range.size),
            np.empty((axes.range_rate.size, axes.range.size), dtype=np.float32),
            width,
        )
    )


def rates_per_block(seen: Observation, profiles: Profiles) -> int:
    """Even number of range rates within which no place changes by more than `MOST_DRIFT`."""
    axes = profiles.axes
    per_rate = np.max(np.abs(shifts(seen, np.array([axes.range_rate_step]))))
    drift = per_rate * STEPS_PER_RANGE / axes.range_step
    most = min(MOST_RATES, axes.range_rate.size - 1)  # the axis has three range rates or more
    return 2 * int(np.clip(MOST_DRIFT / drift + 0.5, 1, most // 2))


def _apart(value: NDArray[np.float32], spare: int, width: int) -> NDArray[np.float32]:
    """Profiles ``(channel, ramp, step)`` in an order in which ranges of the map are neighbours.

    They are ``(channel, ramp, step within a range, range)``, with zeros at their ends.
    """
    channels, ramps, size = value.shape
    length = -(-size // STEPS_PER_RANGE) + width
    out = np.zeros((channels, ramps + spare, STEPS_PER_RANGE, length), dtype=np.float32)
    for n in range(STEPS_PER_RANGE):
        part = value[:, :, n::STEPS_PER_RANGE]
        out[:, :ramps, n, : part.shape[2]] = part
    return out


@reordered
def _total_weights(weight: Any, place: Any, num_ranges: int) -> Any:  # pragma: no cover - compiled
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
    value: Any,
    place: Any,
    turn: Any,
    cos: Any,
    sin: Any,
    first: Any,
    weight: Any,
    out: Any,
    width: int,
) -> Any:
    num_ranges, pairs = out.shape[1], len(cos)
    z = np.empty((value.shape[2], 2 * width), dtype=np.float32)  # real parts, then imaginary ones
    a, b = np.empty(2 * width, dtype=np.float32), np.empty(2 * width, dtype=np.float32)
    for left in range(0, num_ranges, width):
        for block in range(first.size):
            power = np.zeros((2 * pairs, width), dtype=np.float32)
            for m in range(value.shape[1]):
                for k in range(len(z)):
                    c, s = turn[block, 2 * k], turn[block, 2 * k + 1]
                    start = place[block, k] // STEPS_PER_RANGE + left
                    x = value[0, m, k, place[block, k] % STEPS_PER_RANGE, start:]
                    y = value[1, m, k, place[block, k] % STEPS_PER_RANGE, start:]
                    for i in range(width):
                        z[k, i] = x[i] * c - y[i] * s
                        z[k, width + i] = x[i] * s + y[i] * c
                for p in range(pairs):
                    for i in range(2 * width):
                        a[i], b[i] = np.float32(0.0), np.float32(0.0)
                    for part in range(len(z) // TOGETHER):
                        k = TOGETHER * part
                        c0, c1, c2, c3 = cos[p, k], cos[p, k + 1], cos[p, k + 2], cos[p, k + 3]
                        s0, s1, s2, s3 = sin[p, k], sin[p, k + 1], sin[p, k + 2], sin[p, k + 3]
                        for i in range(2 * width):
                            z0, z1, z2, z3 = z[k, i], z[k + 1, i], z[k + 2, i], z[k + 3, i]
                            a[i] += z0 * c0 + z1 * c1 + z2 * c2 + z3 * c3
                            b[i] += z0 * s0 + z1 * s1 + z2 * s2 + z3 * s3
                    for i in range(width):
                        re, im = a[i] + b[width + i], a[width + i] - b[i]
                        power[pairs + p, i] += re * re + im * im
                        re, im = a[i] - b[width + i], a[width + i] + b[i]
                        power[pairs - 1 - p, i] += re * re + im * im
            for h in range(2 * pairs):
                for i in range(min(width, num_ranges - left)):
                    out[first[block] + h, left + i] = power[h, i] / weight[block, left + i]
    return out
