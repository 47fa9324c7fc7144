"""Compiled parts of `bundles`: what every path adds to the columns of a sum of tones."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.synthesis.kernels import (
    STEADY,
    TAU,
    Lines,
    Pairs,
    Ramps,
    Taps,
    compiled,
    derivative,
    edge_gain,
    end_series,
    from_table,
    inlined,
    phase_of,
    received,
    sent_amplitude,
    unit,
)

SMALL: Final = 0.5
"""rad, up to which Taylor's polynomials of sine and cosine are right to 1e-13."""


@compiled
def spread(grid: FloatArray, frequency: FloatArray, weight: FloatArray, window: FloatArray) -> None:
    """Spread tones over the grid's points nearest to them.

    ``grid`` (point, 2 × column) and ``weight`` (path, 2 × column) hold real and imaginary parts in
    turn; ``frequency`` is in cycles per sample; ``window`` is that of `tones`.
    """
    size, columns = grid.shape
    degrees, width = window.shape
    value = np.empty(width)
    for p in range(frequency.size):
        place = (frequency[p] - math.floor(frequency[p])) * size
        first = math.ceil(place - 0.5 * width)
        x = 2.0 * (first - (place - 0.5 * width)) - 1.0
        value[:] = window[degrees - 1]
        for power in range(degrees - 2, -1, -1):
            for i in range(width):
                value[i] = value[i] * x + window[power, i]
        for i in range(width):
            point = first + i
            if point < 0:
                point += size
            elif point >= size:
                point -= size
            factor = value[i]
            row, own = grid[point], weight[p]
            for c in range(columns):
                row[c] += factor * own[c]


@compiled
def summary(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    own: Ramps, k: int, sent: Ramps, i: int, lines: Lines, low: int, high: int, half: float,
    from_time: float, until_time: float, passband: float, pulse: float,
) -> FloatArray:  # fmt: skip
    """What `overlaps` tells of the lines ``low:high`` and a pair of ramps.

    Least and greatest rate, lowest and highest beat in magnitude, the earliest and the latest
    beginning, the earliest and the latest end, power that comes into the band.
    """
    since = own.start[k] - lines.reference_time[lines.chosen[k]]
    out = np.array(
        [np.inf, -np.inf, np.inf, -np.inf, np.inf, -np.inf, np.inf, -np.inf, 0.0], dtype=np.float64
    )
    channels = lines.element_delay.shape[1]
    f, g = sent.frequency[i], sent.slope[i]
    ahead = own.start[k] - sent.start[i]
    for p in range(low, high):
        drift = lines.delay_rate[p]
        stretched = 1.0 - drift
        back = 1.0 / stretched
        rate = own.slope[k] - stretched * stretched * g
        out[0], out[1] = min(out[0], rate), max(out[1], rate)
        base = (own.frequency[k] - f) + drift * f
        closest = np.inf
        for m in range(channels):
            into = ahead - (lines.delay[p] + drift * since + lines.element_delay[p, m])
            begin = max(0.0, -into * back)
            end = min(own.duration[k], (sent.duration[i] - into) * back)
            out[4], out[5] = min(out[4], begin), max(out[5], begin)
            out[6], out[7] = min(out[6], end), max(out[7], end)
            if end <= begin:
                continue
            beat = base - stretched * g * into
            one, other = beat + rate * (begin - half), beat + rate * (end + half)
            out[3] = max(out[3], abs(one), abs(other))
            out[2] = min(out[2], 0.0 if one * other <= 0.0 else min(abs(one), abs(other)))
            begin, end = max(begin, from_time), min(end, until_time)
            if end > begin:
                one, other = beat + rate * begin, beat + rate * end
                closest = min(closest, 0.0 if one * other <= 0.0 else min(abs(one), abs(other)))
        if closest <= passband:
            height = min(1.0, pulse * pulse / max(abs(rate), 1e-300))
            a = sent_amplitude(sent, i, lines, p)
            out[8] += height * (a.real * a.real + a.imag * a.imag)
    return out


@compiled
def tune(
    own: Ramps, k: int, sent: Ramps, i: int, lines: Lines, low: int, high: int, middle: float,
    frequency: FloatArray,
) -> FloatArray:  # fmt: skip
    """Hz, of every line ``low:high`` the beat at the time ``middle``, mean of the channels'.

    Gives the least and the greatest beat of any channel, and the greatest difference of a channel
    from the line's mean.
    """
    since = own.start[k] - lines.reference_time[lines.chosen[k]]
    out = np.array([np.inf, -np.inf, 0.0])
    channels = lines.element_delay.shape[1]
    f, g = sent.frequency[i], sent.slope[i]
    for p in range(low, high):
        drift = lines.delay_rate[p]
        stretched = 1.0 - drift
        rate = own.slope[k] - stretched * stretched * g
        into = own.start[k] - sent.start[i] - (lines.delay[p] + drift * since)
        beat = (own.frequency[k] - f) + drift * f - stretched * g * into + rate * middle
        early, late = np.inf, -np.inf
        for m in range(channels):
            shift = stretched * g * lines.element_delay[p, m]
            early, late = min(early, shift), max(late, shift)
        frequency[p - low] = beat + 0.5 * (early + late)
        out[0], out[1] = min(out[0], beat + early), max(out[1], beat + late)
        out[2] = max(out[2], 0.5 * (late - early))
    return out


@inlined
def _turn(angle: FloatArray, cosine: FloatArray, sine: FloatArray, largest: float) -> None:
    """Cosines and sines of angles of at most ``largest``."""
    if largest > SMALL:
        for q in range(angle.size):
            cosine[q], sine[q] = math.cos(angle[q]), math.sin(angle[q])
        return
    for q in range(angle.size):
        x = angle[q]
        y = x * x
        cosine[q] = 1.0 - y * (
            1 / 2 - y * (1 / 24 - y * (1 / 720 - y * (1 / 40320 - y * (1 / 3628800))))
        )
        sine[q] = x * (
            1.0 - y * (1 / 6 - y * (1 / 120 - y * (1 / 5040 - y * (1 / 362880 - y / 39916800))))
        )


@compiled
def slow_weights(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    out: FloatArray, own: Ramps, k: int, sent: Ramps, pairs: Pairs, pair: int, taps: Taps,
    lines: Lines, low: int, middle: float, frequency: FloatArray, apart: float,
    node: FloatArray,
) -> None:  # fmt: skip
    """Values at the times ``middle + node`` of what a line is beside its tone, gain included.

    No channel's beat is more than ``apart`` from the line's. ``out`` is
    (path, 2 × channel × node), real and imaginary parts in turn.
    """
    i = pairs.sent[k] + pair - pairs.start[k]
    since = own.start[k] - lines.reference_time[lines.chosen[k]]
    nodes, channels = node.size, lines.element_delay.shape[1]
    reach = np.abs(node).max()
    angle, cosine, sine = np.empty(nodes), np.empty(nodes), np.empty(nodes)
    real, imag = np.empty(nodes), np.empty(nodes)
    gain = np.empty(4, dtype=np.complex128)
    for p in range(out.shape[0]):
        line = low + p
        drift = lines.delay_rate[line]
        delay = lines.delay[line] + drift * since
        detune, span, gentle = complex(0.0, 0.0), 0.0, False
        for m in range(channels):
            chirp = received(
                own, k, sent, i, delay + lines.element_delay[line, m], drift,
                sent_amplitude(sent, i, lines, line), 0.0,
            )  # fmt: skip
            beat, rate = chirp.beat + chirp.rate * middle, chirp.rate
            if m == 0:
                # one cubic in the beat serves all channels and times of the line
                detune = complex(0.0, math.pi * (rate - pairs.rate[pair]) * taps.half**2)
                span = max(abs(rate) * reach + apart, 1e-9)
                gentle = 4.0 * span * taps.half <= STEADY
                if gentle:
                    _cubic_gain(gain, pairs, pair, frequency[p], span, detune)
            off, bend = TAU * (beat - frequency[p]), math.pi * (rate - pairs.rate[pair])
            for q in range(nodes):
                angle[q] = node[q] * (off + bend * node[q])
            _turn(angle, cosine, sine, reach * (abs(off) + abs(bend) * reach))
            value = chirp.amplitude * unit(phase_of(chirp, middle))
            if gentle:
                scale, start = rate / span, (beat - frequency[p]) / span
                for q in range(nodes):
                    x = start + scale * node[q]
                    real[q] = gain[0].real + x * (
                        gain[1].real + x * (gain[2].real + x * gain[3].real)
                    )
                    imag[q] = gain[0].imag + x * (
                        gain[1].imag + x * (gain[2].imag + x * gain[3].imag)
                    )
            else:
                for q in range(nodes):
                    exact = from_table(pairs, pair, beat + rate * node[q], detune)
                    real[q], imag[q] = exact.real, exact.imag
            row = out[p, 2 * m * nodes : 2 * (m + 1) * nodes]
            for q in range(nodes):
                x = real[q] * value.real - imag[q] * value.imag
                y = real[q] * value.imag + imag[q] * value.real
                row[2 * q] = x * cosine[q] - y * sine[q]
                row[2 * q + 1] = x * sine[q] + y * cosine[q]


_NODES: Final = np.cos(np.pi * (np.arange(4) + 0.5) / 4)
_TO_POWERS: Final = np.ascontiguousarray(np.linalg.inv(_NODES[:, None] ** np.arange(4)))


@inlined
def _cubic_gain(
    out: ComplexArray, pairs: Pairs, pair: int, centre: float, span: float, detune: complex
) -> None:
    """Powers of (beat − centre)/span in the gain, from four of its values."""
    out[:] = 0.0
    for i in range(4):
        value = from_table(pairs, pair, centre + span * _NODES[i], detune)
        for j in range(4):
            out[j] += _TO_POWERS[j, i] * value


@compiled
def crossing_sums(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    out: FloatArray, own: Ramps, k: int, sent: Ramps, pairs: Pairs, pair: int, taps: Taps,
    lines: Lines, low: int, high: int, middle: float, node: FloatArray, centre: float,
    width: float, terms: IntArray,
) -> None:  # fmt: skip
    """Sums over the lines ``low:high`` of their values times polynomials of their beats.

    Values are those at the time ``middle`` and, for every time ``middle + node``, what the line's
    rate adds to the phase beside the beat there. The polynomials are Chebyshev's of the beat's
    distance from ``centre``, ``width`` Hz at most; there are ``terms`` of them for every power of
    the detuning from the pair's rate. ``out`` is (term, 2 × channel × node).
    """
    i = pairs.sent[k] + pair - pairs.start[k]
    since = own.start[k] - lines.reference_time[lines.chosen[k]]
    nodes, channels = node.size, lines.element_delay.shape[1]
    size, reach = out.shape[1], np.abs(node).max()
    angle, cosine, sine = np.empty(nodes), np.empty(nodes), np.empty(nodes)
    x, value, before, now = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    for p in range(low, high):
        drift = lines.delay_rate[p]
        delay = lines.delay[p] + drift * since
        amplitude = sent_amplitude(sent, i, lines, p)
        bend = 0.0
        for m in range(channels):
            chirp = received(
                own, k, sent, i, delay + lines.element_delay[p, m], drift, amplitude, 0.0
            )
            apart = chirp.rate - pairs.rate[pair]
            if m == 0:
                bend = math.pi * apart
                for q in range(nodes):
                    angle[q] = -bend * node[q] * node[q]
                _turn(angle, cosine, sine, abs(bend) * reach * reach)
            start = chirp.amplitude * unit(phase_of(chirp, middle))
            place = chirp.beat + chirp.rate * middle - centre
            for q in range(nodes):
                c = 2 * (m * nodes + q)
                value[c] = start.real * cosine[q] - start.imag * sine[q]
                value[c + 1] = start.real * sine[q] + start.imag * cosine[q]
                x[c] = x[c + 1] = 2.0 * (place + apart * node[q]) / width
        row = 0
        for j in range(terms.size):
            if j > 0:
                # the detuning is imaginary
                detune = bend * taps.half**2
                for c in range(0, size, 2):
                    value[c], value[c + 1] = -detune * value[c + 1], detune * value[c]
            for c in range(size):
                now[c] = value[c]
                before[c] = 0.5 * x[c] * value[c]
            for _ in range(terms[j]):
                total = out[row]
                for c in range(size):
                    total[c] += now[c]
                    following = x[c] * now[c] - before[c]
                    before[c] = now[c]
                    now[c] = following
                row += 1


@compiled
def gains(
    pairs: Pairs, pair: int, taps: Taps, beat: FloatArray, orders: int, only: int
) -> ComplexArray:
    """G and its change with the detuning, ``(order, beat)``, for the pair's mean rate.

    Near the band it is tabulated; elsewhere it is what the two edges of the filter's window give,
    and there its change with the rate is below what is left out. ``only`` is the one edge that
    counts, 1 or −1, and 0 for both.
    """
    rate, half = pairs.rate[pair], taps.half
    out = np.zeros((orders, beat.size), dtype=np.complex128)
    weight = np.empty(taps.bessel.shape[0], dtype=np.complex128)
    step = complex(0.0, 1e-3)
    near = pairs.far[pair] + half * abs(rate)
    has_table = pairs.end[pair] > pairs.begin[pair]
    for n in range(beat.size):
        f = beat[n]
        if only == 0 and has_table and abs(f) <= near:
            out[0, n] = from_table(pairs, pair, f, 0.0j)
            if orders == 2:
                ahead = from_table(pairs, pair, f, step) - from_table(pairs, pair, f, -step)
                out[1, n] = ahead / (2.0 * step)
        else:
            for side in (-1, 1):
                if side == -only:
                    continue
                last = 0 if side < 0 else taps.taylor.shape[0] - 1
                value = edge_gain(taps, last, f - side * rate * half, rate, weight)
                out[0, n] += side * unit(half * (0.5 * rate * half - side * f)) * value
    return out


@compiled
def corner_sums(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    out: ComplexArray, own: Ramps, k: int, sent: Ramps, pairs: Pairs, pair: int, taps: Taps,
    lines: Lines, low: int, high: int, side: int, centre: float, width: float,
) -> None:  # fmt: skip
    """Sums over the lines ``low:high`` of their corners' weights times polynomials of the corners.

    Corners are beginnings for side −1, endings for side 1. Weights are those of the impulse
    response's derivatives, polynomials Chebyshev's of the corner's distance from ``centre``,
    ``width`` s at most. ``out`` is (channel, order, term).
    """
    i = pairs.sent[k] + pair - pairs.start[k]
    since = own.start[k] - lines.reference_time[lines.chosen[k]]
    weight = np.empty(taps.bessel.shape[0], dtype=np.complex128)
    for p in range(low, high):
        amplitude = sent_amplitude(sent, i, lines, p)
        drift = lines.delay_rate[p]
        delay = lines.delay[p] + drift * since
        for m in range(out.shape[0]):
            chirp = received(
                own, k, sent, i, delay + lines.element_delay[p, m], drift, amplitude, 0.0
            )
            corner = chirp.end if side > 0 else chirp.begin
            count = end_series(taps, chirp.beat + chirp.rate * corner, chirp.rate, weight)
            value = -side * amplitude * unit(phase_of(chirp, corner))
            x = 2.0 * (corner - centre) / width
            for j in range(count):
                now = value * weight[j]
                before = 0.5 * x * now
                for r in range(out.shape[2]):
                    out[m, j, r] += now
                    now, before = x * now - before, now


@compiled
def derivatives(taps: Taps, time: FloatArray, orders: int) -> FloatArray:
    """The impulse response and its derivatives at times within its support, ``(order, time)``."""
    out = np.empty((orders, time.size))
    for n in range(time.size):
        s = min(max(time[n], -taps.half), taps.half)
        for j in range(orders):
            out[j, n] = derivative(taps, s, j)
    return out
