r"""Kernels of the Gauss–Newton step of a group of points that overlap each other.

The signal of point p on channel m and ramp k is :math:`\alpha_{pm}\,g_{pk}\,s_{pkn}`, with the
unit signal s of its motion and the known shape g (`Observation.shape`). Its derivative by the
quantity i of the motion is :math:`j\,\alpha_{pm}\,g_{pk}\,(A_{pki} + B_{ki}u_n)\,s_{pkn}`, with u
the time from the middle of the ramp, A the derivative of the phase there and B that of the beat.
Amplitudes are linear and are eliminated from the normal equations (variable projection, Golub and
Pereyra 1973).
"""

from typing import Any

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import reordered_inner
from polychirp.receiver.coherent.ramps import ELAPSED, FREQUENCY, SLOPE, USED
from polychirp.receiver.coherent.replicas import bessel_into, gains_into
from polychirp.receiver.coherent.solutions import REGULARISATION, inverse_into, product_of
from polychirp.receiver.estimation.azimuth_rate import TYPICAL_CROSSING_SPEED
from polychirp.receiver.signal_model.point_signal import LEAST_RANGE_SHARE

ACCELERATION_DEVIATION = 10.0
"""Standard deviation of a priori known range accelerations, m/s²; chosen: it decides for points
that are too weak to measure theirs, and hardly counts for others."""

REGULARISATION_OF_STEPS = 1e-6
"""The same for motions; chosen: they are less well determined."""


@reordered_inner
def step_into(
    frame: Any, now: Any, moving: Any, own: Any, work: Any
) -> Any:  # pragma: no cover - compiled
    """Step of a group, in place, and the expected fall of the residual's power, W.

    ``own`` are the numbers of its points; ``work`` holds what they match, and gets the step.
    """
    size, channels, ramps = own.size, now.wave.shape[1], now.track.shape[2]
    phase, beat = np.empty((size, 4, ramps)), np.empty((size, 4, ramps))
    mean, side = np.empty((size, 4)), np.zeros((size, 4))
    white = np.zeros((2, size, channels), dtype=np.complex128)
    for j in range(size):
        p = own[j]
        _slopes_into(frame.ramps, moving.motion[p], phase[j], beat[j], mean[j])
        _derivatives_into(frame, now.amplitude[p], white[:, j])
        _sides_into(frame, white[:, j], phase[j], beat[j], work.value[j], work.moment[j], side[j])
    normal = np.empty((4 * size, 4 * size), dtype=np.complex128)
    cross = np.empty((4 * size, size), dtype=np.complex128)
    gram = np.empty((size, size), dtype=np.complex128)
    inverse = np.empty((size, size), dtype=np.complex128)
    for j in range(size):
        for q in range(size):
            pair = (phase[j], beat[j], phase[q], beat[q])
            gram[j, q] = _overlap_into(
                frame.ramps, now, own[j], own[q], pair, cross[4 * j :, q], normal[4 * j :, 4 * q :]
            )
    inverse_into(gram, REGULARISATION, inverse)
    matched = work.matched[:size]
    gain = _without_amplitudes(frame, matched, white, inverse, cross, normal, side)
    for j in range(size):
        energy = 0.0
        for m in range(channels):
            energy += white[0, j, m].real ** 2 + white[0, j, m].imag ** 2
        moving.power[own[j]] = energy / moving.floor[own[j]] / max(inverse[j, j].real, 1e-300)
        _add_prior(moving.motion[own[j]], moving.floor[own[j]], j, normal, side)
    return gain + _solve_into(frame, normal, side, mean, work)


@reordered_inner
def _derivatives_into(
    frame: Any, amplitude: Any, white: Any
) -> None:  # pragma: no cover - compiled
    """Amplitudes on white channels by which derivatives differ from signals, ``(2, channel)``.

    The second are those of the derivative by the sine's rate, which grows with a channel's place.
    """
    for m in range(amplitude.size):
        for n in range(amplitude.size):
            one = 1j * frame.mixing[m, n] * amplitude[n]
            white[0, m] += one
            white[1, m] += one * frame.ramps.channel_y[n]


@reordered_inner
def _slopes_into(
    ramps: Any, motion: Any, phase: Any, beat: Any, mean: Any
) -> None:  # pragma: no cover - compiled
    """Derivatives of the phase, less its mean over the frame, and of the beat by the motion.

    They are ``(4, ramp)``, those by the sine's rate per metre of a channel's place. A step in range
    turns all phases by many cycles alike, which the amplitude takes back exactly.
    """
    distance, rate, acceleration = motion[0], motion[1], motion[2]
    bend = rate * rate + distance * acceleration
    wave_number = 2.0 * np.pi / SPEED_OF_LIGHT
    total = 0.0
    for i in range(4):
        mean[i] = 0.0
    for k in range(ramps.table.shape[1]):
        time, frequency, slope = (
            ramps.table[ELAPSED, k],
            ramps.table[FREQUENCY, k],
            ramps.table[SLOPE, k],
        )
        square = distance * distance + (2.0 * distance * rate + bend * time) * time
        now = np.copysign(np.sqrt(max(square, (LEAST_RANGE_SHARE * distance) ** 2)), distance)
        scale = 2.0 * wave_number * frequency / now
        phase[0, k] = scale * (distance + rate * time + 0.5 * acceleration * time * time)
        phase[1, k] = scale * (distance + rate * time) * time
        phase[2, k] = scale * 0.5 * distance * time * time
        phase[3, k] = -0.5 * scale * distance * time
        beat[0, k] = 2.0 * wave_number * slope
        beat[1, k] = 2.0 * wave_number * (frequency + slope * time)
        beat[2, k] = 2.0 * wave_number * (frequency * time + 0.5 * slope * time * time)
        beat[3, k] = -wave_number * frequency
        total += ramps.table[USED, k]
        for i in range(4):
            mean[i] += ramps.table[USED, k] * phase[i, k]
    for i in range(4):
        mean[i] /= max(total, 1.0)
        for k in range(ramps.table.shape[1]):
            phase[i, k] -= mean[i]


@reordered_inner
def _sides_into(
    frame: Any, white: Any, phase: Any, beat: Any, value: Any, moment: Any, side: Any
) -> None:  # pragma: no cover - compiled
    """Sums of a point's derivatives times what is left, ``(4,)``."""
    channels, ramps = value.shape[1:]
    for s in range(2):
        for n in range(channels):
            factor = complex(0.0, 0.0)
            for m in range(channels):
                factor += white[s, m].conjugate() * frame.mixing[m, n]
            for k in range(ramps):
                x = factor.real * value[0, n, k] - factor.imag * value[1, n, k]
                y = factor.real * moment[0, n, k] - factor.imag * moment[1, n, k]
                for i in range(3 * s, 3 + s):
                    side[i] += x * phase[i, k] + y * beat[i, k]


@reordered_inner
def _overlap_into(
    ramps: Any, now: Any, first: int, second: int, pair: Any, cross: Any, normal: Any
) -> complex:  # pragma: no cover - compiled
    """Product of the signals of two points; those of their derivatives, in place.

    Parameters
    ----------
    pair : slopes of phase and beat of the first, and of the second, each ``(4, ramp)``
    cross : products of the first point's derivatives with the second's signal, ``(4,)``
    normal : those of its derivatives with the derivatives of the second, ``(4, 4)``
    """
    count = ramps.table.shape[1]
    a, b, c = np.zeros(count), np.zeros(count), np.zeros(count)
    u, v = np.empty(count), np.empty(count)
    bessel_into(ramps, now.track[first], now.track[second], a, b, c)
    gains_into(now.wave[first], now.wave[second], u, v)
    total = complex(0.0, 0.0)
    for k in range(count):
        total += complex(u[k] * a[k], v[k] * a[k])
    for i in range(4):
        phase, beat = pair[0][i], pair[1][i]
        re, im = 0.0, 0.0
        for k in range(count):
            x, y = phase[k] * a[k], beat[k] * b[k]
            re += u[k] * x - v[k] * y
            im += v[k] * x + u[k] * y
        cross[i] = complex(re, im)
        for n in range(4):
            other, beat_of_other = pair[2][n], pair[3][n]
            re, im = 0.0, 0.0
            for k in range(count):
                even = phase[k] * other[k] * a[k] + beat[k] * beat_of_other[k] * c[k]
                odd = (phase[k] * beat_of_other[k] + beat[k] * other[k]) * b[k]
                re += u[k] * even - v[k] * odd
                im += v[k] * even + u[k] * odd
            normal[i, n] = complex(re, im)
    return total


@reordered_inner
def _without_amplitudes(
    frame: Any, matched: Any, white: Any, inverse: Any, cross: Any, normal: Any, side: Any
) -> float:  # pragma: no cover - compiled
    """Normal equations of the motions alone, in place, and the fall by the best amplitudes."""
    own = np.zeros_like(matched)  # on white channels
    for j in range(len(matched)):
        for m in range(matched.shape[1]):
            for n in range(matched.shape[1]):
                own[j, m] += frame.mixing[m, n] * matched[j, n]
    best = product_of(inverse, own)
    gain = 0.0
    for j in range(len(matched)):
        for m in range(matched.shape[1]):
            gain += (own[j, m].conjugate() * best[j, m]).real
    taken = product_of(cross, best)
    solved = product_of(cross, inverse)
    for row in range(len(cross)):
        j, i = row // 4, row % 4
        for m in range(matched.shape[1]):
            side[j, i] -= (white[i // 3, j, m].conjugate() * taken[row, m]).real
        for column in range(len(cross)):
            one, weight = normal[row, column], complex(0.0, 0.0)
            for r in range(cross.shape[1]):
                one -= solved[row, r] * cross[column, r].conjugate()
            for m in range(matched.shape[1]):
                other = white[column % 4 // 3, column // 4, m]
                weight += white[i // 3, j, m].conjugate() * other
            normal[row, column] = (weight * one).real
    return gain


@reordered_inner
def _add_prior(
    motion: Any, floor: float, member: int, normal: Any, side: Any
) -> None:  # pragma: no cover - compiled
    """Add what is known a priori of the acceleration and of the sine's rate of a member."""
    # half the noise power: sums are of complex samples, of which noise has both parts
    known = (1.0 / ACCELERATION_DEVIATION, motion[0] / TYPICAL_CROSSING_SPEED)
    for n in range(2):
        weight = 0.5 * floor * known[n] ** 2
        normal[4 * member + 2 + n, 4 * member + 2 + n] += weight
        side[member, 2 + n] -= weight * motion[2 + n]


@reordered_inner
def _solve_into(
    frame: Any, normal: Any, side: Any, mean: Any, work: Any
) -> float:  # pragma: no cover - compiled
    """Steps and the phases by which they turn the signals, in place, and the fall that they give.

    Steps end at the limits.
    """
    size, gain = len(side), 0.0
    solution = np.empty((4 * size, 4 * size), dtype=np.complex128)
    inverse_into(normal, REGULARISATION_OF_STEPS, solution)
    for j in range(size):
        excess = 1.0
        for i in range(4):
            step = 0.0
            for q in range(4 * size):
                step += solution[4 * j + i, q].real * side[q // 4, q % 4]
            work.change[j, i] = step
            gain += step * side[j, i]
            excess = max(excess, abs(step) / frame.limit[i])
        for i in range(4):
            work.change[j, i] /= excess
        for m in range(work.phase.shape[1]):
            work.phase[j, m] = mean[j, 3] * work.change[j, 3] * frame.ramps.channel_y[m]
            for i in range(3):
                work.phase[j, m] += mean[j, i] * work.change[j, i]
    return gain
