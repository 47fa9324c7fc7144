"""Compiled parts of `bundles`: what every path adds to the columns of a sum of tones."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.synthesis.stretch.path_kernels import (
    STEADY,
    TAU,
    Chirp,
    Lines,
    Pairs,
    Ramps,
    Taps,
    add_chirp,
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
    units,
)

SMALL: Final = 0.5
"""rad, up to which Taylor's polynomials of sine and cosine are right to 1e-13."""

MOST_POWERS: Final = 8
"""Powers of the rates' distances from their mean that are made, the power 0 among them."""


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
        for i in range(width):
            value[i] = window[degrees - 1, i]
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


@inlined
def _fill(
    term: FloatArray, value: FloatArray, x: FloatArray, z: FloatArray, amplitude: ComplexArray,
    cycles: FloatArray,
) -> None:  # fmt: skip
    """Chebyshev's polynomials of x, ``(term, path)``, and values times powers of z.

    A value is ``amplitude`` turned by ``cycles``; ``value`` is (path, 2 × power), real and
    imaginary parts in turn.
    """
    count = x.size
    real, imag = np.empty(count), np.empty(count)
    units(cycles, real, imag, count)
    for p in range(count):
        a = amplitude[p] * complex(real[p], imag[p])
        for q in range(value.shape[1] // 2):
            value[p, 2 * q], value[p, 2 * q + 1] = a.real, a.imag
            a *= z[p]
    for p in range(count):
        term[0, p], term[1, p] = 1.0, x[p]
    for r in range(2, term.shape[0]):
        for p in range(count):
            term[r, p] = 2.0 * x[p] * term[r - 1, p] - term[r - 2, p]


@compiled
def crossing_columns(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    term: FloatArray, value: FloatArray, own: Ramps, k: int, sent: Ramps, pairs: Pairs, pair: int,
    lines: Lines, low: int, middle: float, centre: float, width: float,
) -> None:  # fmt: skip
    """What the lines from ``low`` on are at the time ``middle``.

    ``term`` (channel, term, path) are Chebyshev's polynomials of the beat's distance there from
    ``centre``, in units of ``width``. ``value`` (channel, path, 2 × power) are the lines' values
    times powers of the distance of their rates from the pair's, in units of the pair's spread.
    """
    i = pairs.sent[k] + pair - pairs.start[k]
    since = own.start[k] - lines.reference_time[lines.chosen[k]]
    count = term.shape[2]
    x, z, cycles = np.empty(count), np.empty(count), np.empty(count)
    amplitude = np.empty(count, dtype=np.complex128)
    scale = 1.0 / max(pairs.spread[pair], 1e-300)
    for m in range(term.shape[0]):
        for p in range(count):
            line = low + p
            drift = lines.delay_rate[line]
            delay = lines.delay[line] + drift * since + lines.element_delay[line, m]
            amplitude[p] = sent_amplitude(sent, i, lines, line)
            chirp = received(own, k, sent, i, delay, drift, amplitude[p], 0.0)
            cycles[p] = phase_of(chirp, middle)
            x[p] = (chirp.beat + chirp.rate * middle - centre) / width
            z[p] = (chirp.rate - pairs.rate[pair]) * scale
        _fill(term[m], value[m], x, z, amplitude, cycles)


@compiled
def swept(
    out: ComplexArray, pairs: Pairs, pair: int, taps: Taps, centre: float, off: FloatArray,
    first: float, step: float, only: int,
) -> None:  # fmt: skip
    """G of chirps of the pair's mean rate times their turning, ``(beat, sample)``.

    Beats are ``centre + off`` at time 0, the samples' times ``first + n·step``. Near the band G
    is tabulated; elsewhere it is what the two edges of the filter's window give. ``only`` is the
    one edge that counts, 1 or −1, and 0 for both.
    """
    rate, half = pairs.rate[pair], taps.half
    near = pairs.far[pair] + half * abs(rate)
    has_table = pairs.end[pair] > pairs.begin[pair]
    bends = np.empty((2, out.shape[1]), dtype=np.complex128)
    for n in range(out.shape[1]):
        f = centre + rate * (first + n * step)
        for s in range(2):
            bends[s, n] = unit(half * (0.5 * rate * half - (2 * s - 1) * f))
    for b in range(off.size):
        turn, turning = unit(off[b] * first), unit(off[b] * step)
        lean = unit(half * off[b])
        for n in range(out.shape[1]):
            f = centre + rate * (first + n * step) + off[b]
            if only == 0 and has_table and abs(f) <= near:
                gain = from_table(pairs, pair, f, 0.0j)
            else:
                gain = 0.0j
                if only >= 0:
                    last = taps.taylor.shape[0] - 1
                    value = edge_gain(taps, last, f - rate * half, rate)
                    gain += bends[1, n] * lean.conjugate() * value
                if only <= 0:
                    value = edge_gain(taps, 0, f + rate * half, rate)
                    gain -= bends[0, n] * lean * value
            out[b, n] = turn * gain
            turn *= turning


@compiled
def swept_terms(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    pairs: Pairs, pair: int, taps: Taps, centre: float, width: float, node: FloatArray,
    to_terms: FloatArray, first: float, step: float, count: int, only: int, tolerance: float,
    least: float,
) -> tuple[ComplexArray, IntArray]:  # fmt: skip
    """Chebyshev's coefficients by the beat of `swept`, and what rates off the pair's add.

    ``(power, term, sample)``, and how many terms count of every power: those that are left out are
    together below ``tolerance`` of the largest, or below ``least``. A rate off by δ is a
    factor exp(jπδt²) before the filter, and t² is a second derivative by the beat.
    """
    most = node.size
    gain = np.empty((most, count), dtype=np.complex128)
    swept(gain, pairs, pair, taps, centre, width * node, first, step, only)
    out = np.empty((MOST_POWERS, most, count), dtype=np.complex128)
    kept = np.zeros(MOST_POWERS, dtype=np.int64)
    np.dot(to_terms, gain.view(np.float64), out[0].view(np.float64))
    enough = -1.0
    per_power = -0.5j * pairs.spread[pair] / (TAU * width**2)
    for power in range(MOST_POWERS):
        beyond, term = 0.0, most
        largest = np.zeros(most)
        for r in range(most):
            for n in range(count):
                value = out[power, r, n]
                largest[r] = max(largest[r], value.real * value.real + value.imag * value.imag)
        if enough < 0.0:
            enough = max(tolerance * math.sqrt(largest.max()), least)
        while term > 0 and beyond + math.sqrt(largest[term - 1]) <= enough:
            term -= 1
            beyond += math.sqrt(largest[term])
        kept[power] = max(term, 2) if power == 0 else term
        if kept[power] == 0 or power == MOST_POWERS - 1:
            break
        _bend(out[power + 1], out[power], per_power / (power + 1))
    return out, kept


@inlined
def _bend(out: ComplexArray, term: ComplexArray, factor: complex) -> None:
    """Chebyshev's coefficients of a second derivative, times a factor, ``(term, sample)``.

    A derivative's are d_(r−1) = d_(r+1) + 2 r c_r, half of it for d_0 (the usual recurrence).
    """
    most, count = term.shape
    first = np.zeros((most + 1, count), dtype=np.complex128)
    second = np.zeros((most + 1, count), dtype=np.complex128)
    for r in range(most - 1, 0, -1):
        for n in range(count):
            first[r - 1, n] = first[r + 1, n] + 2.0 * r * term[r, n]
    for n in range(count):
        first[0, n] *= 0.5
    for r in range(most - 1, 0, -1):
        for n in range(count):
            second[r - 1, n] = second[r + 1, n] + 2.0 * r * first[r, n]
    for n in range(count):
        second[0, n] *= 0.5
    for r in range(most):
        for n in range(count):
            out[r, n] = factor * second[r, n]


@compiled
def crossing_samples(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    out: ComplexArray, own: Ramps, k: int, sent: Ramps, pairs: Pairs, pair: int, taps: Taps,
    lines: Lines, low: int, high: int, middle: float, centre: float, width: float,
    node: FloatArray, to_terms: FloatArray, step: float, only: int, tolerance: float,
    least: float, held: int,
) -> None:  # fmt: skip
    """Add what the lines ``low:high`` are at the samples about ``middle``, ``(channel, sample)``.

    Their sums with `crossing_columns`, of ``held`` paths times terms at once, times
    `swept_terms`, and the chirp that lies in the middle.
    """
    channels, count = out.shape
    first = -(count // 2) * step
    gain, kept = swept_terms(
        pairs, pair, taps, centre, width, node, to_terms, first, step, count, only, tolerance,
        least,
    )  # fmt: skip
    terms, powers = kept[0], np.count_nonzero(kept)
    sums = np.zeros((channels, terms, 2 * powers))
    block = max(64, held // terms)
    for begin in range(low, high, block):
        paths = min(block, high - begin)
        term, value = np.empty((channels, terms, paths)), np.empty((channels, paths, 2 * powers))
        crossing_columns(
            term, value, own, k, sent, pairs, pair, lines, begin, middle, centre, width
        )
        for m in range(channels):
            sums[m] += np.dot(term[m], value[m])
    for m in range(channels):
        for q in range(powers):
            for r in range(kept[q]):
                factor = complex(sums[m, r, 2 * q], sums[m, r, 2 * q + 1])
                for n in range(count):
                    out[m, n] += factor * gain[q, r, n]
    for n in range(count):
        time = first + n * step
        turned = unit((centre + 0.5 * pairs.rate[pair] * time) * time)
        for m in range(channels):
            out[m, n] *= turned


@compiled
def corner_columns(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    term: FloatArray, value: FloatArray, own: Ramps, k: int, sent: Ramps, i: int, lines: Lines,
    low: int, side: int, centre: float, width: float, beat: float, beat_width: float,
) -> None:  # fmt: skip
    """What the lines from ``low`` on are at their corners.

    Corners are beginnings for side −1, endings for side 1. ``term`` (channel, term, path) are
    Chebyshev's polynomials of the corner's distance from ``centre``, in units of ``width``;
    ``value`` (channel, path, 2 × power) values times powers of the beat's distance there from
    ``beat``, in units of ``beat_width``.
    """
    since = own.start[k] - lines.reference_time[lines.chosen[k]]
    count = term.shape[2]
    x, z, cycles = np.empty(count), np.empty(count), np.empty(count)
    amplitude = np.empty(count, dtype=np.complex128)
    for m in range(term.shape[0]):
        for p in range(count):
            line = low + p
            drift = lines.delay_rate[line]
            delay = lines.delay[line] + drift * since + lines.element_delay[line, m]
            amplitude[p] = sent_amplitude(sent, i, lines, line)
            chirp = received(own, k, sent, i, delay, drift, amplitude[p], 0.0)
            corner = chirp.end if side > 0 else chirp.begin
            cycles[p] = phase_of(chirp, corner)
            x[p] = (corner - centre) / width
            z[p] = (chirp.beat + chirp.rate * corner - beat) / beat_width
        _fill(term[m], value[m], x, z, amplitude, cycles)


@compiled
def cut_sums(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    out: ComplexArray, own: Ramps, k: int, sent: Ramps, i: int, half: float, lines: Lines,
    low: int, high: int, side: int, time: float, corner_gain: ComplexArray,
    edge_gain: ComplexArray, scale: FloatArray,
) -> None:  # fmt: skip
    """Add to every channel the sample at ``time``, whose window has some of the lines' corners.

    A line gives what is at its corner or at the edge of the window, whichever is further in, and
    at the other edge. ``corner_gain`` (power, power) is in the beat's and the time's distances
    from ``scale[0]`` and ``scale[2]`` in units of ``scale[1]`` and ``scale[3]``; ``edge_gain`` in
    the beat's from ``scale[4]`` in units of ``scale[5]``.
    """
    since = own.start[k] - lines.reference_time[lines.chosen[k]]
    count = high - low
    x, z, y = np.empty(count), np.empty(count), np.empty(count)
    here, there, real, imag = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    amplitude = np.empty(count, dtype=np.complex128)
    far = time - side * half
    for m in range(out.size):
        for p in range(count):
            line = low + p
            drift = lines.delay_rate[line]
            delay = lines.delay[line] + drift * since + lines.element_delay[line, m]
            a = -side * sent_amplitude(sent, i, lines, line)
            chirp = received(own, k, sent, i, delay, drift, a, 0.0)
            if side > 0:
                corner = min(chirp.end, time + half)
                is_met = corner > far
            else:
                corner = max(chirp.begin, time - half)
                is_met = corner < far
            amplitude[p] = a if is_met else 0.0j
            here[p], there[p] = phase_of(chirp, corner), phase_of(chirp, far)
            z[p] = (chirp.beat + chirp.rate * corner - scale[0]) / scale[1]
            x[p] = (time - corner - scale[2]) / scale[3]
            y[p] = (chirp.beat + chirp.rate * far - scale[4]) / scale[5]
        units(here, real, imag, count)
        for p in range(count):
            gain = 0.0j
            for e in range(corner_gain.shape[0] - 1, -1, -1):
                inner = corner_gain[e, corner_gain.shape[1] - 1]
                for q in range(corner_gain.shape[1] - 2, -1, -1):
                    inner = inner * x[p] + corner_gain[e, q]
                gain = gain * z[p] + inner
            out[m] += amplitude[p] * complex(real[p], imag[p]) * gain
        units(there, real, imag, count)
        for p in range(count):
            gain = edge_gain[edge_gain.size - 1]
            for e in range(edge_gain.size - 2, -1, -1):
                gain = gain * y[p] + edge_gain[e]
            out[m] -= amplitude[p] * complex(real[p], imag[p]) * gain


@compiled
def alike(  # noqa: PLR0913, PLR0917 -- numba takes tables one by one
    real: FloatArray, imag: FloatArray, own: Ramps, k: int, sent: Ramps, pairs: Pairs, pair: int,
    taps: Taps, middle: float, beat: FloatArray, rate: FloatArray, first: float, step: float,
    is_own: tuple[bool, bool],
) -> None:  # fmt: skip
    """Samples of lines that have given beats and rates, and no phase, at the time ``middle``.

    ``real`` and ``imag`` are (rate, beat, sample). Which beginning and ending a line has follows
    from its rate and beat; ``is_own`` tells whether they are those of the victim's ramp.
    """
    i = pairs.sent[k] + pair - pairs.start[k]
    f, g = sent.frequency[i], sent.slope[i]
    for j in range(rate.size):
        stretched = math.sqrt((own.slope[k] - rate[j]) / g)
        for b in range(beat.size):
            start = beat[b] - rate[j] * middle
            into = (own.frequency[k] - stretched * f - start) / (stretched * g)
            begin, end = -into / stretched, (sent.duration[i] - into) / stretched
            turns = middle * (start + 0.5 * rate[j] * middle)
            chirp = Chirp(
                1.0 + 0.0j, 0.0, -turns, start, rate[j], 0.0 if is_own[0] else begin,
                own.duration[k] if is_own[1] else end,
            )  # fmt: skip
            add_chirp(real[j, b], imag[j, b], pairs, taps, pair, chirp, first, step)


@compiled
def end_weights(taps: Taps, beat: FloatArray, rate: float) -> ComplexArray:
    """Weights of h and its derivatives at an end, ``(beat, order)``."""
    out = np.zeros((beat.size, taps.bessel.shape[0]), dtype=np.complex128)
    for n in range(beat.size):
        end_series(taps, beat[n], rate, out[n])
    return out


@compiled
def derivatives(taps: Taps, time: FloatArray, orders: int) -> FloatArray:
    """The impulse response and its derivatives at times within its support, ``(order, time)``."""
    out = np.empty((orders, time.size))
    for n in range(time.size):
        s = min(max(time[n], -taps.half), taps.half)
        for j in range(orders):
            out[j, n] = derivative(taps, s, j)
    return out
