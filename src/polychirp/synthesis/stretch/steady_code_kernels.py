r"""Compiled samples of coded ramps whose beats are nearly constant (`coded_ramps`).

The code of a link is a sum of jumps: one where its chirp begins, one from chip to chip, one where
it ends. A jump by Δ at the time :math:`t_e` adds, to the sample at t, Δ times the integral

.. math:: E(s) = \int_{-S/2}^{s} h(s')\,e^{-j2\pi f s'}\,ds', \qquad s = t - t_e ,

and E(S/2) from half a window after it on. E is tabulated at a beat near that of the link with its
derivatives by the beat, for all ramps and channels of the link. Samples are a whole number of
entries apart, so that one set of Lagrange's weights interpolates E at all samples of a jump.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.jit import compiled, inlined, inner
from polychirp.synthesis.stretch import kernel_records
from polychirp.synthesis.stretch.chirp_kernels import phase_of
from polychirp.synthesis.stretch.kernel_records import (
    Chips,
    Chirp,
    CodedRamps,
    CodeTaps,
    CodeWork,
    RampPair,
)
from polychirp.synthesis.stretch.path_kernels import beat_of, received, sent_amplitude
from polychirp.synthesis.unit_phasors import unit, units

ramp_pair = inlined(kernel_records.ramp_pair)

NUM_WEIGHTS: Final = 8
"""Number of entries that Lagrange's polynomial passes through; chosen with `ENTRIES_PER_CYCLE`."""

FIRST_WEIGHT: Final = 3
"""Number of entries before the place at which the polynomial is taken; half of its entries."""

FARTHEST_BEAT: Final = 1e-3
"""Greatest distance from the table's beat, in units of 1/S; chosen: the cube left out is 5e-9."""

SWEPT_CHANGE: Final = 1e-7
"""Change of the beat over the samples, in units of 1/S, below which it is left out; chosen."""

_INVERSE: Final = tuple(
    (-1.0) ** (NUM_WEIGHTS - 1 - i) / (math.factorial(i) * math.factorial(NUM_WEIGHTS - 1 - i))
    for i in range(NUM_WEIGHTS)
)


class Integrals(NamedTuple):
    r"""Real and imaginary parts of the integrals :math:`\int h\,s^k e^{-j2\pi f s} ds`.

    They are of order k = 0, 1, 2 up to each entry of a table, ``(order, entry)``.
    """

    real: FloatArray
    imag: FloatArray


class Grid(NamedTuple):
    """The samples of a row: time of the first and between two, s; their number; half of a window.

    ``orders`` is 2 if the beat changes from the first to the last sample, else 1.
    """

    first: float
    step: float
    num: int
    half: float
    orders: int


class Envelope(NamedTuple):
    """E at the middle beat, and its derivative by the beat, with what they add to the samples.

    ``real`` and ``imag`` are ``(order, entry modulo entries per sample, sample)``, so that a row
    has what a jump adds to samples that follow each other; ``sum_real`` and ``sum_imag`` (order,
    sample) are the samples, without their phase; ``jumped`` (sample,) are the jumps whose windows
    end before the sample. ``lanes`` (3, sample) is work space.
    """

    real: FloatArray
    imag: FloatArray
    sum_real: FloatArray
    sum_imag: FloatArray
    jumped: ComplexArray
    lanes: FloatArray


@inlined
def drifting(
    tables: CodedRamps, pair: RampPair, p: int, amplitude: complex, time: float
) -> complex:
    """The amplitude of link p, with its drift, at ``time`` from the start of the victim's ramp."""
    drift = tables.links.amplitude_rate[p] * pair.weight[tables.links.element[p]]
    value: complex = amplitude + drift * (pair.since + time)
    return value


@compiled
def beat_extremes(tables: CodedRamps, work: CodeWork) -> FloatArray:
    """Least and greatest beat, Hz, and steepest rate, Hz/s, of each unit of work, ``(unit, 3)``.

    They are those of all links in the unit's samples: ∞, −∞ and 0 where no link meets them.
    """
    links, window = tables.links, tables.window
    out = np.empty((work.row.size, 3))
    for u in range(work.row.size):
        least, greatest, steepest = np.inf, -np.inf, 0.0
        row, ramp = work.row[u], work.ramp[u]
        pair = ramp_pair(tables.own, ramp, tables.sent, work.sent[u], links)
        first = window.first[row] + (tables.own.start[row] - tables.own.start[ramp])
        last = first + (window.num_samples[row] - 1) * window.step
        snapshot = links.snapshot[ramp]
        for p in range(links.start[snapshot], links.start[snapshot + 1]):
            for m in range(links.element_delay.shape[1]):
                chirp = received(pair, links, p, m)
                if chirp.end <= chirp.begin:
                    continue
                beat = beat_of(pair, links, p, m)
                one, other = beat.frequency + beat.rate * first, beat.frequency + beat.rate * last
                least, greatest = min(least, one, other), max(greatest, one, other)
                steepest = max(steepest, abs(beat.rate))
        out[u, 0], out[u, 1], out[u, 2] = least, greatest, steepest
    return out


@compiled
def add_steady_code(
    samples: ComplexArray, tables: CodedRamps, work: CodeWork, chips: Chips, code_taps: CodeTaps
) -> None:
    """Add all links to ``samples`` (part, channel, ramp, fast), link by link."""
    links, window, own = tables.links, tables.window, tables.own
    entries, per_sample = code_taps.height.shape[0] + 1, code_taps.per_sample
    integrals = Integrals(np.empty((3, entries)), np.empty((3, entries)))
    shape, most = (2, per_sample, entries // per_sample + 1), samples.shape[3]
    envelope = Envelope(
        np.zeros(shape), np.zeros(shape), np.empty((2, most)), np.empty((2, most)),
        np.empty(most + 1, dtype=np.complex128), np.empty((3, most)),
    )  # fmt: skip
    reach = FARTHEST_BEAT / (2.0 * tables.taps.half)
    for p in range(links.delay.size):
        centre = np.inf
        for u in range(work.row.size):
            row, ramp, sent = work.row[u], work.ramp[u], work.sent[u]
            snapshot = links.snapshot[ramp]
            if p < links.start[snapshot] or p >= links.start[snapshot + 1]:
                continue
            pair = ramp_pair(own, ramp, tables.sent, sent, links)
            if sent_amplitude(pair, links, p) == 0.0:
                continue
            first = window.first[row] + (own.start[row] - own.start[ramp])
            count = window.num_samples[row]
            middle = first + 0.5 * (count - 1) * window.step
            for m in range(samples.shape[1]):
                chirp, beat = received(pair, links, p, m), beat_of(pair, links, p, m)
                if chirp.end <= chirp.begin:
                    continue
                here = chirp.beat + chirp.rate * middle
                if not abs(here - centre) < reach:
                    centre = here
                    _integrate(integrals, code_taps, centre)
                orders = 2 if abs(chirp.rate) * (count * window.step) > SWEPT_CHANGE * reach else 1
                grid = Grid(first, window.step, count, tables.taps.half, orders)
                _fill_envelope(envelope, integrals, here - centre, chirp.rate, per_sample, orders)
                code, duration = chips.value[chips.row[sent]], chips.duration[sent]
                into, stretch = beat.into / duration, beat.stretched / duration
                _sum_jumps(envelope, chirp, code, into, stretch, code_taps, grid)
                amplitude = drifting(tables, pair, p, chirp.amplitude, first)
                change = links.amplitude_rate[p] * pair.weight[links.element[p]] * window.step
                _turn(envelope, chirp, grid, middle)
                out = samples[links.part[p], m, row]
                for n in range(count):
                    value = complex(envelope.sum_real[0, n], envelope.sum_imag[0, n])
                    out[n] += value * (amplitude + n * change)


@inner
def _turn(envelope: Envelope, chirp: Chirp, grid: Grid, middle: float) -> None:
    """Complete the samples of order 0 by those of order 1 and the chirp's phase."""
    first, step, count = grid.first, grid.step, grid.num
    x, y = envelope.sum_real[0], envelope.sum_imag[0]
    cycles, c, s = envelope.lanes[0], envelope.lanes[1], envelope.lanes[2]
    if grid.orders == 2:
        for n in range(count):
            away = chirp.rate * (first + n * step - middle)
            x[n] += away * envelope.sum_real[1, n]
            y[n] += away * envelope.sum_imag[1, n]
    for n in range(count):
        cycles[n] = phase_of(chirp, first + n * step)
    units(cycles[:count], c, s)
    for n in range(count):
        x[n], y[n] = x[n] * c[n] - y[n] * s[n], x[n] * s[n] + y[n] * c[n]


@inner
def _integrate(integrals: Integrals, code_taps: CodeTaps, beat: float) -> None:
    """Fill in the integrals at a beat; they are 0 at the entry ``begin``."""
    height, time, step = code_taps.height, code_taps.time, code_taps.step
    real, imag = integrals
    nodes = height.shape[1]
    turn = unit(-beat * step)
    wave = np.empty(nodes, dtype=np.complex128)
    for i in range(nodes):
        wave[i] = unit(-beat * time[0, i])
    sum_0, sum_1, sum_2 = 0.0j, 0.0j, 0.0j
    for e in range(height.shape[0] + 1):
        real[0, e], imag[0, e] = sum_0.real, sum_0.imag
        real[1, e], imag[1, e] = sum_1.real, sum_1.imag
        real[2, e], imag[2, e] = sum_2.real, sum_2.imag
        if e < height.shape[0]:
            for i in range(nodes):
                value = height[e, i] * wave[i]
                s = time[e, i]
                sum_0 += value
                sum_1 += s * value
                sum_2 += (s * s) * value
                wave[i] *= turn
    for k in range(3):
        x, y = real[k, code_taps.begin], imag[k, code_taps.begin]
        for e in range(height.shape[0] + 1):
            real[k, e] -= x
            imag[k, e] -= y


@inner
def _fill_envelope(
    envelope: Envelope, integrals: Integrals, off: float, rate: float, per_sample: int, orders: int
) -> None:
    r"""Fill in E at the table's beat + ``off`` for chirps of ``rate``, and its derivative.

    With :math:`a = -2\pi\,\mathrm{off}`, E is :math:`I_0 + jaI_1 - \frac12 a^2 I_2 + j\pi\mu I_2`
    and its derivative by the beat :math:`-j2\pi I_1 + 2\pi a I_2`.
    """
    real, imag = integrals
    a = -math.tau * off
    bend, curve = math.pi * rate, -0.5 * a * a
    for e in range(real.shape[1]):
        n, r = e // per_sample, e % per_sample
        envelope.real[0, r, n] = (
            real[0, e] - a * imag[1, e] + curve * real[2, e] - bend * imag[2, e]
        )
        envelope.imag[0, r, n] = (
            imag[0, e] + a * real[1, e] + curve * imag[2, e] + bend * real[2, e]
        )
        if orders == 2:
            envelope.real[1, r, n] = math.tau * (imag[1, e] + a * real[2, e])
            envelope.imag[1, r, n] = math.tau * (-real[1, e] + a * imag[2, e])


@inner
def _sum_jumps(
    envelope: Envelope, chirp: Chirp, code: ComplexArray, into: float, stretch: float,
    code_taps: CodeTaps, grid: Grid,
) -> None:  # fmt: skip
    """Fill in the sums of all jumps from the beginning of the chirp to its end.

    ``into + stretch·t`` counts chips.
    """
    count, half, orders = grid.num, grid.half, grid.orders
    for n in range(count):
        envelope.jumped[n] = 0.0j
        for k in range(orders):
            envelope.sum_real[k, n], envelope.sum_imag[k, n] = 0.0, 0.0
    low = max(chirp.begin, grid.first - half)
    high = min(chirp.end, grid.first + (count - 1) * grid.step + half)
    if high <= low:
        return
    number = math.floor(into + stretch * low)
    chip = code[number % code.size]
    _add_jump(envelope, low, chip, code_taps, grid)
    while True:
        end = (number + 1 - into) / stretch
        if end >= high:
            break
        number += 1
        after = code[number % code.size]
        if after != chip:
            _add_jump(envelope, end, after - chip, code_taps, grid)
            chip = after
    _add_jump(envelope, high, -chip, code_taps, grid)
    total = code_taps.begin + 2.0 * half / code_taps.step
    jumped = 0.0j
    ends = np.empty(orders, dtype=np.complex128)
    for k in range(orders):
        ends[k] = _entry(envelope, k, total, code_taps.per_sample)
    for n in range(count):
        jumped += envelope.jumped[n]
        for k in range(orders):
            value = jumped * ends[k]
            envelope.sum_real[k, n] += value.real
            envelope.sum_imag[k, n] += value.imag


@inner
def _add_jump(
    envelope: Envelope, time: float, jump: complex, code_taps: CodeTaps, grid: Grid
) -> None:
    """Add a jump of the code at ``time`` to all samples whose windows contain it or follow it."""
    first, step, count, half, orders = grid
    begin = max(math.ceil((time - half - first) / step), 0)
    end = min(max(math.ceil((time + half - first) / step), begin), count)
    if end < count:
        envelope.jumped[end] += jump
    if end <= begin:
        return
    per_sample = code_taps.per_sample
    place = code_taps.begin + (first + begin * step - time + half) / code_taps.step
    whole = math.floor(place)
    weight = _weights(place - whole)
    for i in range(NUM_WEIGHTS):
        entry = whole - FIRST_WEIGHT + i
        r, n = entry % per_sample, entry // per_sample
        a, b = weight[i] * jump.real, weight[i] * jump.imag
        for k in range(orders):
            x, y = envelope.real[k, r, n:], envelope.imag[k, r, n:]
            u, v = envelope.sum_real[k, begin:end], envelope.sum_imag[k, begin:end]
            if b == 0.0:
                for s in range(end - begin):
                    u[s] += a * x[s]
                    v[s] += a * y[s]
            else:
                for s in range(end - begin):
                    u[s] += a * x[s] - b * y[s]
                    v[s] += a * y[s] + b * x[s]


@inlined
def _weights(x: float) -> tuple[float, float, float, float, float, float, float, float]:
    """Weights of Lagrange's polynomial at x, from 0 to 1, through −3, −2, …, 4."""
    d0, d1, d2, d3 = x + 3.0, x + 2.0, x + 1.0, x
    d4, d5, d6, d7 = x - 1.0, x - 2.0, x - 3.0, x - 4.0
    lower, upper = d0 * d1 * d2 * d3, d4 * d5 * d6 * d7
    left, right = d0 * d1 * upper, d6 * d7 * lower
    inner_left, inner_right = d2 * d3 * upper, d4 * d5 * lower
    return (
        _INVERSE[0] * (d1 * inner_left), _INVERSE[1] * (d0 * inner_left),
        _INVERSE[2] * (d3 * left), _INVERSE[3] * (d2 * left),
        _INVERSE[4] * (d5 * right), _INVERSE[5] * (d4 * right),
        _INVERSE[6] * (d7 * inner_right), _INVERSE[7] * (d6 * inner_right),
    )  # fmt: skip


@inlined
def _entry(envelope: Envelope, order: int, place: float, per_sample: int) -> complex:
    """E, or its derivative, between the entries."""
    whole = math.floor(place)
    weight = _weights(place - whole)
    total = 0.0j
    for i in range(NUM_WEIGHTS):
        entry = whole - FIRST_WEIGHT + i
        r, n = entry % per_sample, entry // per_sample
        total += weight[i] * complex(envelope.real[order, r, n], envelope.imag[order, r, n])
    return total
