"""Compiled parts of `ramp_overlaps` and `path_batches`: sums over many links of a pair of ramps.

Complex numbers that BLAS multiplies are in real arrays, with real and imaginary parts in turn on
their last axis: ``2 × column``.
"""

import math
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.jit import compiled, inlined, inner
from polychirp.synthesis.stretch.chirp_kernels import STEADY_CHANGE, phase_of
from polychirp.synthesis.stretch.filter_kernels import edge_gain, tabulated_gain
from polychirp.synthesis.stretch.kernel_records import (
    EXPANSION_TOLERANCE,
    NUMBERS_PER_BLOCK,
    BandLimits,
    Batch,
    BeatExpansion,
    BeatRange,
    LinkTable,
    Overlap,
    RampPair,
    Response,
)
from polychirp.synthesis.stretch.path_kernels import beat_of, received, sent_amplitude
from polychirp.synthesis.unit_phasors import unit, units

SMALL_ANGLE: Final = 0.5
"""Largest angle for Taylor's polynomials of sine and cosine, rad; chosen: right to 5e-13."""

MOST_RATE_POWERS: Final = 8
"""Greatest number of powers of a rate's distance from the mean, power 0 included; chosen."""


@compiled
def overlap_of(pair: RampPair, links: LinkTable, low: int, high: int, band: BandLimits) -> Overlap:
    """Overlap of a pair of ramps: extremes over the links ``low:high`` and all channels."""
    least_rate, greatest_rate, lowest, highest = np.inf, -np.inf, np.inf, -np.inf
    first_begin, last_begin, first_end, last_end = np.inf, -np.inf, np.inf, -np.inf
    begin_beat, end_beat, power = np.inf, np.inf, 0.0
    for p in range(low, high):
        closest, rate = np.inf, 0.0
        for m in range(links.element_delay.shape[1]):
            beat, rate, _, into, stretched, _ = beat_of(pair, links, p, m)
            least_rate, greatest_rate = min(least_rate, rate), max(greatest_rate, rate)
            # when the overlap begins and ends at this channel
            begin = max(0.0, -into / stretched)
            end = min(pair.duration, (pair.sent_duration - into) / stretched)
            first_begin, last_begin = min(first_begin, begin), max(last_begin, begin)
            first_end, last_end = min(first_end, end), max(last_end, end)
            if end <= begin:
                continue
            # magnitudes of the beat while a window can meet the chirp
            begin_beat = min(begin_beat, abs(beat + rate * begin))
            end_beat = min(end_beat, abs(beat + rate * end))
            one, other = beat + rate * (begin - band.half), beat + rate * (end + band.half)
            highest = max(highest, abs(one), abs(other))
            lowest = min(lowest, 0.0 if one * other <= 0.0 else min(abs(one), abs(other)))
            # and while the converter samples
            begin, end = max(begin, band.from_time), min(end, band.until_time)
            if end > begin:
                one, other = beat + rate * begin, beat + rate * end
                closest = min(closest, 0.0 if one * other <= 0.0 else min(abs(one), abs(other)))
        if closest <= band.passband:
            height = min(1.0, band.peak * band.peak / max(abs(rate), 1e-300))
            a = sent_amplitude(pair, links, p)
            power += height * (a.real * a.real + a.imag * a.imag)
    return Overlap(
        pair.victim_ramp, pair.sent_ramp, least_rate, greatest_rate, lowest, highest,
        begin_beat, end_beat, first_begin, last_begin, first_end, last_end, power,
    )  # fmt: skip


@compiled
def find_beats(batch: Batch, time: float, frequency: FloatArray) -> BeatRange:
    """Range of all beats at ``time``; ``frequency`` gets the middle of each link's beats, Hz."""
    pair, links = batch.pair, batch.links
    least, greatest, apart = np.inf, -np.inf, 0.0
    for p in range(batch.low, batch.high):
        lowest, highest = np.inf, -np.inf
        for m in range(links.element_delay.shape[1]):
            start, rate, _, _, _, _ = beat_of(pair, links, p, m)
            beat = start + rate * time
            lowest, highest = min(lowest, beat), max(highest, beat)
        frequency[p - batch.low] = 0.5 * (lowest + highest)
        least, greatest = min(least, lowest), max(greatest, highest)
        apart = max(apart, 0.5 * (highest - lowest))
    return BeatRange(least, greatest, apart)


@compiled
def slow_weights(
    out: FloatArray, batch: Batch, low: int, time: float, frequency: FloatArray, apart: float,
    node: FloatArray,
) -> None:  # fmt: skip
    """Values of links, divided by their tones and with the filter's gain, at ``time + node``.

    The links are those from ``low`` on; ``frequency`` are their tones, Hz, from which the beat of
    no channel differs by more than ``apart``. ``out`` is (link, 2 × channel × node).
    """
    pair, response, links, half = batch.pair, batch.response, batch.links, batch.taps.half
    nodes = node.size
    reach = np.abs(node).max()
    angle, cosine, sine = np.empty(nodes), np.empty(nodes), np.empty(nodes)
    real, imag = np.empty(nodes), np.empty(nodes)
    gain = np.empty(4, dtype=np.complex128)
    for p in range(out.shape[0]):
        detune, span, is_cubic = complex(0.0, 0.0), 0.0, False
        for m in range(links.element_delay.shape[1]):
            chirp = received(pair, links, low + p, m)
            beat, rate = chirp.beat + chirp.rate * time, chirp.rate
            if m == 0:
                # one cubic in the beat serves all channels and times of the link
                detune = complex(0.0, math.pi * (rate - response.rate) * half**2)
                span = max(abs(rate) * reach + apart, 1e-9)
                is_cubic = 4.0 * span * half <= STEADY_CHANGE
                if is_cubic:
                    _cubic_gain(gain, response, frequency[p], span, detune)
            # the phase relative to the tone
            off, bend = math.tau * (beat - frequency[p]), math.pi * (rate - response.rate)
            for q in range(nodes):
                angle[q] = node[q] * (off + bend * node[q])
            _turn(angle, cosine, sine, reach * (abs(off) + abs(bend) * reach))
            value = chirp.amplitude * unit(phase_of(chirp, time))
            # the gain
            if is_cubic:
                scale, start = rate / span, (beat - frequency[p]) / span
                _cubic_values(real, imag, gain, start, scale, node)
            else:
                for q in range(nodes):
                    exact = tabulated_gain(response, beat + rate * node[q], detune)
                    real[q], imag[q] = exact.real, exact.imag
            # their product
            row = out[p, 2 * m * nodes : 2 * (m + 1) * nodes]
            for q in range(nodes):
                x = real[q] * value.real - imag[q] * value.imag
                y = real[q] * value.imag + imag[q] * value.real
                row[2 * q] = x * cosine[q] - y * sine[q]
                row[2 * q + 1] = x * sine[q] + y * cosine[q]


@inlined
def _turn(angle: FloatArray, cosine: FloatArray, sine: FloatArray, largest: float) -> None:
    """Cosines and sines of angles, rad, whose magnitude is ``largest`` at most."""
    if largest > SMALL_ANGLE:
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


_NODES: Final = np.cos(np.pi * (np.arange(4) + 0.5) / 4)
_TO_POWERS: Final = np.ascontiguousarray(np.linalg.inv(_NODES[:, None] ** np.arange(4)))
"""Chebyshev's nodes on [−1, 1], and the matrix from values there to a cubic's coefficients."""


@inlined
def _cubic_gain(
    out: ComplexArray, response: Response, centre: float, span: float, detune: complex
) -> None:
    """Coefficients of the gain in powers of (beat − centre)/span, from its values at four nodes."""
    out[:] = 0.0
    for i in range(4):
        value = tabulated_gain(response, centre + span * _NODES[i], detune)
        for j in range(4):
            out[j] += _TO_POWERS[j, i] * value


@inlined
def _cubic_values(
    real: FloatArray, imag: FloatArray, gain: ComplexArray, start: float, scale: float,
    node: FloatArray,
) -> None:  # fmt: skip
    """Values of the cubic at ``start + scale·node``."""
    for q in range(node.size):
        x = start + scale * node[q]
        real[q] = gain[0].real + x * (gain[1].real + x * (gain[2].real + x * gain[3].real))
        imag[q] = gain[0].imag + x * (gain[1].imag + x * (gain[2].imag + x * gain[3].imag))


@compiled
def crossing_samples(
    out: ComplexArray, batch: Batch, beats: BeatExpansion, step: float, side: int, least: float
) -> None:
    """Fill in the batch's samples around the time ``beats.time``, ``(channel, sample)``.

    They are sums over the links by `crossing_columns`, times `swept_terms` (with its ``side`` and
    ``least``), times the chirp of the mean rate and the middle beat. ``step`` is in s.
    """
    channels, count = out.shape
    gain, kept = swept_terms(batch, beats, step, count, side, least)
    terms, powers = kept[0], np.count_nonzero(kept)
    # sums over links, a block of them at a time
    sums = np.zeros((channels, terms, 2 * powers))
    block = max(64, NUMBERS_PER_BLOCK // terms)
    for low in range(batch.low, batch.high, block):
        links = min(block, batch.high - low)
        term, value = np.empty((channels, terms, links)), np.empty((channels, links, 2 * powers))
        crossing_columns(term, value, batch, low, beats.time, beats.centre, beats.width)
        for m in range(channels):
            product = np.dot(term[m], value[m])
            for r in range(terms):
                for q in range(2 * powers):
                    sums[m, r, q] += product[r, q]
    # samples, from the terms of every power that are kept
    for m in range(channels):
        for q in range(powers):
            for r in range(kept[q]):
                factor = complex(sums[m, r, 2 * q], sums[m, r, 2 * q + 1])
                for n in range(count):
                    out[m, n] += factor * gain[q, r, n]
    first, rate = -(count // 2) * step, batch.response.rate
    for n in range(count):
        time = first + n * step
        turned = unit((beats.centre + 0.5 * rate * time) * time)
        for m in range(channels):
            out[m, n] *= turned


@compiled
def crossing_columns(
    term: FloatArray, value: FloatArray, batch: Batch, low: int, time: float, centre: float,
    width: float,
) -> None:  # fmt: skip
    """Fill in the columns of the links from ``low`` on, at ``time``.

    ``term`` (channel, term, link) are Chebyshev's polynomials of the beat's distance from
    ``centre``, in units of ``width``. ``value`` (channel, link, 2 × power) are the links' values
    times powers of their rates' distance from the pair's mean, in units of the pair's spread.
    """
    pair, links, mean_rate = batch.pair, batch.links, batch.response.rate
    count = term.shape[2]
    x, z, cycles = np.empty(count), np.empty(count), np.empty(count)
    amplitude = np.empty(count, dtype=np.complex128)
    scale = 1.0 / max(batch.response.spread, 1e-300)
    for m in range(term.shape[0]):
        for p in range(count):
            chirp = received(pair, links, low + p, m)
            amplitude[p] = chirp.amplitude
            cycles[p] = phase_of(chirp, time)
            x[p] = (chirp.beat + chirp.rate * time - centre) / width
            z[p] = (chirp.rate - mean_rate) * scale
        fill_columns(term[m], value[m], x, z, amplitude, cycles)


@inlined
def fill_columns(
    term: FloatArray, value: FloatArray, x: FloatArray, z: FloatArray, amplitude: ComplexArray,
    cycles: FloatArray,
) -> None:  # fmt: skip
    """Fill in Chebyshev's polynomials of x, ``(term, link)``, and values times powers of z.

    A value is ``amplitude`` with its phase advanced by ``cycles``; ``value`` is (link, 2 × power).
    """
    count = x.size
    real, imag = np.empty(count), np.empty(count)
    units(cycles, real, imag)
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


@inner
def swept_terms(
    batch: Batch, beats: BeatExpansion, step: float, count: int, side: int, least: float
) -> tuple[ComplexArray, IntArray]:
    """Chebyshev's coefficients of `_swept_gain` in the beat, for powers of the rate's distance.

    They are ``(power, term, sample)``. The second result is the number of terms to keep of every
    power: those left out are together below `EXPANSION_TOLERANCE` of the largest, or ``least``. A
    rate that differs from the mean by δ is a factor exp(jπδt²) before the filter, and t² is a
    second derivative by the beat.
    """
    most = beats.node.size
    gain = np.empty((most, count), dtype=np.complex128)
    _swept_gain(gain, batch, beats.centre, beats.width * beats.node, step, side)
    out = np.empty((MOST_RATE_POWERS, most, count), dtype=np.complex128)
    kept = np.zeros(MOST_RATE_POWERS, dtype=np.int64)
    np.dot(beats.to_terms, gain.view(np.float64), out[0].view(np.float64))
    enough = -1.0
    per_power = -0.5j * batch.response.spread / (math.tau * beats.width**2)
    for power in range(MOST_RATE_POWERS):
        # the largest squared magnitude of every term over the samples
        largest = np.zeros(most)
        for r in range(most):
            for n in range(count):
                value = out[power, r, n]
                largest[r] = max(largest[r], value.real * value.real + value.imag * value.imag)
        if enough < 0.0:
            enough = max(EXPANSION_TOLERANCE * math.sqrt(largest.max()), least)
        # leave out the last terms, as long as their sum is small enough
        beyond, term = 0.0, most
        while term > 0 and beyond + math.sqrt(largest[term - 1]) <= enough:
            term -= 1
            beyond += math.sqrt(largest[term])
        kept[power] = max(term, 2) if power == 0 else term
        if kept[power] == 0 or power == MOST_RATE_POWERS - 1:
            break
        second_derivative(out[power + 1], out[power], per_power / (power + 1))
    return out, kept


@inner
def _swept_gain(
    out: ComplexArray, batch: Batch, centre: float, off: FloatArray, step: float, side: int
) -> None:
    """G exp(j2π ``off`` t) of chirps of the pair's mean rate, ``(beat, sample)``.

    Beats are ``centre + off``, Hz, at the middle sample, where t = 0. Near the band G is tabulated;
    elsewhere it is the sum of the contributions of both edges of the filter's window. ``side``
    selects one edge, 1 the upper and −1 the lower; 0 is both.
    """
    response, taps = batch.response, batch.taps
    rate, half = response.rate, taps.half
    first = -(out.shape[1] // 2) * step
    has_table, near = response.envelope.size > 0, response.far + half * abs(rate)
    last = taps.taylor.shape[0] - 1
    # the chirp at both edges of the window, relative to its value in the middle
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
            if side == 0 and has_table and abs(f) <= near:
                gain = tabulated_gain(response, f, 0.0j)
            else:
                gain = 0.0j
                if side >= 0:
                    value = edge_gain(taps, last, f - rate * half, rate)
                    gain += bends[1, n] * lean.conjugate() * value
                if side <= 0:
                    value = edge_gain(taps, 0, f + rate * half, rate)
                    gain -= bends[0, n] * lean * value
            out[b, n] = turn * gain
            turn *= turning


@inlined
def second_derivative(out: ComplexArray, term: ComplexArray, factor: complex) -> None:
    """Chebyshev's coefficients of the second derivative, times a factor, ``(term, sample)``.

    Coefficients of a derivative are d_(r−1) = d_(r+1) + 2 r c_r, and half of that for d_0.
    """
    most, count = term.shape
    first = np.zeros((most + 1, count), dtype=np.complex128)
    second = np.zeros((most + 1, count), dtype=np.complex128)
    _derivative(first, term)
    _derivative(second, first)
    for r in range(most):
        for n in range(count):
            out[r, n] = factor * second[r, n]


@inlined
def _derivative(out: ComplexArray, term: ComplexArray) -> None:
    for r in range(out.shape[0] - 2, 0, -1):
        for n in range(out.shape[1]):
            out[r - 1, n] = out[r + 1, n] + 2.0 * r * term[r, n]
    for n in range(out.shape[1]):
        out[0, n] *= 0.5
