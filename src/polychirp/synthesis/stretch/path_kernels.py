"""Compiled sums over paths, elements and samples; `stretch` prepares their tables.

Everything here is in the time of one victim ramp (zero at its start), frequencies in Hz, phases in
cycles. The signal of a piece is exp(j2π(φ + f t + ½ μ t²)) from one end of the piece to the other
and zero elsewhere; a sample is its integral with h over the window of ± half the filter's support.

No freedom of fast arithmetic is taken, not even that of fusing multiplications and additions: a
kernel is compiled into each of its callers, and what is fused would depend on which of these copies
runs, so that the run that compiles them would differ from all later ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple, TypeVar, cast

import numpy as np
from numba import njit

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.synthesis.stretch.chirp_response import NUM_TERMS, TAYLOR_ORDER

TAU: Final = 2.0 * math.pi
LANES: Final = 16
"""Samples that a recurrence advances together."""

LONGEST_BLOCK: Final = 4096
"""Samples after which a recurrence starts anew, for rounding."""

STEADY: Final = 0.05
"""Change of the beat within a block, in units of 1/S, that a cubic gain follows to 1e-9."""


CYCLES: Final = 9.0
"""In a panel of `NODES` nodes: Gauss's rule misses (9πe/128)⁶⁴ of such a wave, 1e-14."""

NODES: Final = 32
"""Of Gauss's rule."""


class Ramps(NamedTuple):
    """A schedule's columns, ``(ramp,)`` each, times in s from a common origin.

    ``weight`` is the conjugate of what each transmitting element is driven with, (ramp, element).
    """

    start: FloatArray
    duration: FloatArray
    frequency: FloatArray
    slope: FloatArray
    phase: FloatArray
    weight: ComplexArray


class Window(NamedTuple):
    """The victim's samples, ``(ramp,)``: the first from the ramp's start, their number, 1/rate."""

    first: FloatArray
    num_samples: IntArray
    step: float


class Visits(NamedTuple):
    """Where a pair of ramps is seen in a row of samples: ``(visit,)``.

    The samples of ``row`` meet lines ``low`` to before ``high``, of the part ``part``, of the
    victim's ramp ``ramp`` and the pair ``pair`` at samples from ``begin`` to before ``end``.
    """

    part: IntArray
    row: IntArray
    ramp: IntArray
    pair: IntArray
    low: IntArray
    high: IntArray
    begin: IntArray
    end: IntArray


class Lines(NamedTuple):
    """Links of all snapshots in one table: those of snapshot i are ``start[i]:start[i + 1]``.

    ``limit`` is the gain below which nothing of a path needs to be added. Those of a snapshot are
    in order of ``part``, ``is_weak`` and delay.
    """

    start: IntArray
    reference_time: FloatArray
    chosen: IntArray
    delay: FloatArray
    delay_rate: FloatArray
    element_delay: FloatArray
    amplitude: ComplexArray
    limit: FloatArray
    part: IntArray
    element: IntArray
    is_weak: BoolArray


class Pairs(NamedTuple):
    """Pairs of a victim's and a transmitted ramp: of ramp k, ``start[k]:start[k + 1]``.

    They are with the transmitted ramps ``sent[k]`` and following. Per pair: its table of G, the
    entries ``begin[pair]:end[pair]`` of ``moment`` (`ResponseTable`), about ``rate``, and
    the beat ``far`` above which the end-point series is right. Lines' rates are within ``spread``
    of ``rate``.
    """

    start: IntArray
    sent: IntArray
    begin: IntArray
    end: IntArray
    rate: FloatArray
    spread: FloatArray
    far: FloatArray
    step: float
    moment: ComplexArray
    envelope: FloatArray


class Chirp(NamedTuple):
    """A piece of a chirp: exp(j2π(φ + f t + ½ μ t²)) times ``amplitude`` from begin to end.

    A gain below ``limit`` need not be added.
    """

    amplitude: complex
    limit: float
    phase: float
    beat: float
    rate: float
    begin: float
    end: float


class Taps(NamedTuple):
    """The impulse response h, up to ``half`` = S/2 on both sides.

    ``taylor`` has its derivatives over order!, ``(node, order)``, at nodes ``step`` apart from
    −S/2 on; ``peak`` and ``edge`` are its magnitudes at most and at ±S/2.
    """

    half: float
    stopband: float
    step: float
    taylor: FloatArray
    peak: float
    edge: float
    bessel: FloatArray
    node: FloatArray
    weight: FloatArray


F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """Compile for one sample or one path; every such function is a leaf of `add_contribution`."""
    return cast("F", njit(cache=True, nogil=True)(function))


def inlined(function: F) -> F:
    """Compile into the caller: tables handed to a call would be counted references to them."""
    return cast("F", njit(cache=True, nogil=True, forceinline=True)(function))


@inlined
def phase_of(chirp: Chirp, time: float) -> float:
    """Cycles, at a time."""
    return chirp.phase + time * (chirp.beat + 0.5 * chirp.rate * time)


@inlined
def _turns(frequency: float, time: float) -> float:
    """The fraction of frequency × time in cycles, without the rounding of the product.

    Dekker's product: both factors are split into halves whose products are exact. Fusing would
    spoil the splitting.
    """
    product = frequency * time
    big = 134217729.0 * frequency
    f_high = big - (big - frequency)
    f_low = frequency - f_high
    big = 134217729.0 * time
    t_high = big - (big - time)
    t_low = time - t_high
    rest = ((f_high * t_high - product) + f_high * t_low + f_low * t_high) + f_low * t_low
    return (product - math.floor(product)) + rest


@inlined
def unit(cycles: float) -> complex:
    """The number of magnitude 1 with that phase."""
    angle = TAU * (cycles - math.floor(cycles))
    return complex(math.cos(angle), math.sin(angle))


@inlined
def units(cycles: FloatArray, real: FloatArray, imag: FloatArray, count: int) -> None:
    """Numbers of magnitude 1 with those phases: without branches, so that lanes go together.

    Sine and cosine of half the angle, which is π/2 at most, by Taylor's series, then doubled.
    """
    for c in range(count):
        x = math.pi * (cycles[c] - ((cycles[c] + _TO_INTEGER) - _TO_INTEGER))
        y = x * x
        cosine, sine = _COSINE[_HALVES - 1], _SINE[_HALVES - 1]
        for i in range(_HALVES - 2, -1, -1):
            cosine = cosine * y + _COSINE[i]
            sine = sine * y + _SINE[i]
        sine *= x
        real[c] = 1.0 - 2.0 * sine * sine
        imag[c] = 2.0 * sine * cosine


_HALVES: Final = 11
_TO_INTEGER: Final = 1.5 * 2.0**52
_COSINE: Final = tuple((-1.0) ** i / math.factorial(2 * i) for i in range(_HALVES))
_SINE: Final = tuple((-1.0) ** i / math.factorial(2 * i + 1) for i in range(_HALVES))


# ── the filter ────────────────────────────────────────────────────────────────────────────────


@inlined
def _tap(taps: Taps, s: float) -> float:
    """The impulse response h at s, by Taylor's series from the nearest node."""
    node = int((s + taps.half) / taps.step + 0.5)
    off = s + taps.half - node * taps.step
    value = 0.0
    for j in range(TAYLOR_ORDER - 1, -1, -1):
        value = value * off + taps.taylor[node, j]
    return value


@inlined
def derivative(taps: Taps, s: float, order: int) -> float:
    """A derivative of h at s."""
    node = int((s + taps.half) / taps.step + 0.5)
    off = s + taps.half - node * taps.step
    value = 0.0
    for j in range(order + TAYLOR_ORDER - 1, order - 1, -1):
        value = value * off + _FALLING[order, j] * taps.taylor[node, j]
    return value


_FALLING: Final = np.array(
    [
        [math.perm(j, order) if j >= order else 0 for j in range(NUM_TERMS + TAYLOR_ORDER)]
        for order in range(NUM_TERMS)
    ],
    dtype=np.float64,
)


@inlined
def from_table(pairs: Pairs, pair: int, beat: float, detune: complex) -> complex:
    """G from its table by Lagrange's polynomial through eight entries; G is even in the beat.

    ``detune`` is jπ(μ − μ₀)S²/4.
    """
    place = abs(beat) / pairs.step
    node = int(place)
    x = place - node
    low = pairs.begin[pair] + node + 1  # tables begin four entries below zero
    d0, d1, d2, d3 = x + 3.0, x + 2.0, x + 1.0, x
    d4, d5, d6, d7 = x - 1.0, x - 2.0, x - 3.0, x - 4.0
    lower, upper = d0 * d1 * d2 * d3, d4 * d5 * d6 * d7
    left, right = d0 * d1 * upper, d6 * d7 * lower
    inner_left, inner_right = d2 * d3 * upper, d4 * d5 * lower
    w0, w1 = _LAGRANGE[0] * (d1 * inner_left), _LAGRANGE[1] * (d0 * inner_left)
    w2, w3 = _LAGRANGE[2] * (d3 * left), _LAGRANGE[3] * (d2 * left)
    w4, w5 = _LAGRANGE[4] * (d5 * right), _LAGRANGE[5] * (d4 * right)
    w6, w7 = _LAGRANGE[6] * (d7 * inner_right), _LAGRANGE[7] * (d6 * inner_right)
    total = 0.0j
    for j in range(pairs.moment.shape[1] - 1, -1, -1):
        total = (
            total * detune
            + (w0 * pairs.moment[low, j] + w1 * pairs.moment[low + 1, j])
            + (w2 * pairs.moment[low + 2, j] + w3 * pairs.moment[low + 3, j])
            + (w4 * pairs.moment[low + 4, j] + w5 * pairs.moment[low + 5, j])
            + (w6 * pairs.moment[low + 6, j] + w7 * pairs.moment[low + 7, j])
        )
    return total


_LAGRANGE: Final = tuple(
    (-1.0) ** (7 - i) / (math.factorial(i) * math.factorial(7 - i)) for i in range(8)
)


# ── ends of a window or of a chirp, where the beat is far out of band ─────────────────────────


@inlined
def _num_terms(taps: Taps, beat: float, rate: float) -> int:
    """Terms that the end-point series needs: the first one left out is below 1e-10."""
    most: int = taps.bessel.shape[0]
    q = 1.0 / abs(beat)
    size, per_order = taps.peak / TAU * q, 2.0 / TAU * abs(rate) * q
    for j in range(1, most):
        size *= (taps.stopband + j * per_order) * q
        if size < 1e-10:
            return j
    return most


@inlined
def end_series(taps: Taps, beat: float, rate: float, weight: ComplexArray) -> int:
    """Weights of h and its derivatives in the value of an end, and their number.

    Repeated partial integration of ∫h(s) exp(j2πψ) ds, where −dψ/ds is the beat f − μs: with q
    its inverse and c = j/2π, an upper end at s contributes Σ_j (−1)^j c^(j+1) D_j times the
    exponential there, D_0 = hq, D_(j+1) = q D_j', or D_j = Σ_i B_ji μ^i h^(j−i) q^(j+1+i) with
    the coefficients B of Bessel's polynomials. ``beat`` is the one at the end.
    """
    count = _num_terms(taps, beat, rate)
    q = 1.0 / beat
    weight[:count] = 0.0
    c = complex(0.0, q / TAU)
    for j in range(count):
        chirping = 1.0
        for i in range(j + 1):
            weight[j - i] += c * (chirping * taps.bessel[j, i])
            chirping *= rate * q
        c *= complex(0.0, -q / TAU)
    return count


@compiled
def _add_corner(
    real: FloatArray,
    imag: FloatArray,
    taps: Taps,
    chirp: Chirp,
    corner: float,
    time: float,
    step: float,
) -> None:
    """Add what a beginning (or, with negative amplitude, an ending) of the chirp contributes.

    The chirp's value and beat at the corner are the same for all samples; only h differs.
    """
    beat = chirp.beat + chirp.rate * corner
    if taps.peak < chirp.limit * TAU * abs(beat):
        return
    weight = np.empty(taps.bessel.shape[0], dtype=np.complex128)
    count = end_series(taps, beat, chirp.rate, weight)
    value = chirp.amplitude * unit(phase_of(chirp, corner))
    for n in range(real.size):
        s = min(max(time + n * step - corner, -taps.half), taps.half)
        total = weight[0] * _tap(taps, s)
        for j in range(1, count):
            total += weight[j] * derivative(taps, s, j)
        total *= value
        real[n] += total.real
        imag[n] += total.imag


@inlined
def edge_gain(taps: Taps, node: int, beat: float, rate: float) -> complex:
    """What an edge of the filter's window gives, relative to the chirp's value there.

    It is `end_series` with h and its derivatives at a node, its powers of j sorted by hand.
    """
    q = 1.0 / beat
    e, lean = q / TAU, rate * q
    real, imag, c = 0.0, 0.0, e
    for j in range(_num_terms(taps, beat, rate)):
        total, chirping = 0.0, 1.0
        for i in range(j + 1):
            order = j - i
            total += chirping * taps.bessel[j, i] * (_FACTORIAL[order] * taps.taylor[node, order])
            chirping *= lean
        total *= -c if j & 2 else c
        if j & 1:
            real += total
        else:
            imag += total
        c *= e
    return complex(real, imag)


_FACTORIAL: Final = tuple(float(math.factorial(j)) for j in range(NUM_TERMS))


@compiled
def _add_edge(
    real: FloatArray,
    imag: FloatArray,
    taps: Taps,
    chirp: Chirp,
    side: int,
    time: float,
    step: float,
) -> None:
    """Add what the upper (side 1) or lower (−1) edge of the window gives to far samples.

    It is the chirp, ±half a support earlier, times a gain h/2πf: samples share a cubic where that
    is right to 1e-9, or a tenth of the limit. Between f(1 − κ) and f(1 + κ) a cubic at Chebyshev
    nodes misses 1/f by κ⁴/8 of it.
    """
    rate, change = chirp.rate, chirp.rate * step
    node = 0 if side < 0 else taps.taylor.shape[0] - 1
    amplitude = side * chirp.amplitude
    gain = np.empty(4, dtype=np.complex128)
    time -= side * taps.half
    start = chirp.beat + rate * time
    reach = np.inf if chirp.limit <= 0.0 else taps.edge / (TAU * chirp.limit)
    n, end = _range_of_beats(start, change, reach, real.size - 1)
    while n <= end:
        beat = start + change * n
        phase = phase_of(chirp, time + step * n)
        height = taps.edge / (TAU * abs(beat))
        span = min((8.0 * max(1e-9, 0.1 * chirp.limit) / height) ** 0.25, 0.33)
        receding = math.copysign(span, beat * change)
        most = 2.0 * span / (1.0 - receding) * abs(beat) / max(abs(change), 1e-300)
        count = min(int(min(most, LONGEST_BLOCK)), end + 1 - n)
        if 2 * count >= LANES:
            gain[:] = 0.0
            for i in range(4):
                here = beat + change * count * _CHEBYSHEV[i]
                value = edge_gain(taps, node, here, rate)
                for j in range(4):
                    gain[j] += _TO_POWERS[j, i] * value
            part = slice(n, n + count)
            _add_steady(real[part], imag[part], amplitude, phase, beat, rate, step, gain)
            n += count
        else:
            value = amplitude * unit(phase) * edge_gain(taps, node, beat, rate)
            real[n] += value.real
            imag[n] += value.imag
            n += 1


# ── samples that meet the chirp where it is near the band ─────────────────────────────────────


@compiled
def _quadrature(taps: Taps, low: float, high: float, beat: float, rate: float) -> complex:
    """∫h(s) exp(j2π(−f s + ½ μ s²)) ds from low to high, in panels of at most `CYCLES`."""
    fastest = max(abs(beat - rate * low), abs(beat - rate * high)) + taps.stopband
    panels = math.ceil(fastest * (high - low) / CYCLES)
    width = (high - low) / panels
    count = taps.node.size
    place, cycles = np.empty(count), np.empty(count)
    real, imag = np.empty(count), np.empty(count)
    x, y = 0.0, 0.0
    for panel in range(panels):
        begin = low + panel * width
        for i in range(count):
            s = begin + width * taps.node[i]
            place[i], cycles[i] = s, s * (0.5 * rate * s - beat)
        units(cycles, real, imag, count)
        for i in range(count):
            height = taps.weight[i] * _tap(taps, place[i])
            x += height * real[i]
            y += height * imag[i]
    return complex(width * x, width * y)


@compiled
def _add_cut(
    real: FloatArray, imag: FloatArray, taps: Taps, chirp: Chirp, time: float, step: float
) -> None:
    """Add the samples, from ``time`` on, whose windows are cut where the beat is low."""
    for n in range(real.size):
        t = time + n * step
        low, high = max(-taps.half, t - chirp.end), min(taps.half, t - chirp.begin)
        if high > low:
            value = _quadrature(taps, low, high, chirp.beat + chirp.rate * t, chirp.rate)
            value *= chirp.amplitude * unit(phase_of(chirp, t))
            real[n] += value.real
            imag[n] += value.imag


@compiled
def _add_steady(
    real: FloatArray,
    imag: FloatArray,
    amplitude: complex,
    phase: float,
    beat: float,
    rate: float,
    step: float,
    gain: ComplexArray,
) -> None:
    """Add a chirp with a cubic gain: lanes of samples advance by complex multiplications.

    ``phase`` and ``beat`` are those at the first sample; ``gain`` is in powers of n/size.
    """
    count = real.size
    zr, zi = np.empty(LANES), np.empty(LANES)
    wr, wi = np.empty(LANES), np.empty(LANES)
    f, mu = beat * step, rate * step * step
    z = amplitude * unit(phase)
    one = unit(f + 0.5 * mu)
    bend = unit(mu)
    many = unit(LANES * (f + 0.5 * mu * LANES))
    bends = unit(mu * LANES)
    for lane in range(LANES):
        zr[lane], zi[lane], wr[lane], wi[lane] = z.real, z.imag, many.real, many.imag
        z *= one
        one *= bend
        many *= bends
    turn = unit(mu * LANES * LANES)
    qr, qi = turn.real, turn.imag
    a0, a1, a2, a3 = gain[0].real, gain[1].real, gain[2].real, gain[3].real
    b0, b1, b2, b3 = gain[0].imag, gain[1].imag, gain[2].imag, gain[3].imag
    scale = 1.0 / count
    whole = count // LANES * LANES
    for n in range(0, whole, LANES):
        for lane in range(LANES):
            u = (n + lane) * scale
            g = a0 + u * (a1 + u * (a2 + u * a3))
            h = b0 + u * (b1 + u * (b2 + u * b3))
            x, y = zr[lane], zi[lane]
            p, q = wr[lane], wi[lane]
            real[n + lane] += x * g - y * h
            imag[n + lane] += x * h + y * g
            zr[lane] = x * p - y * q
            zi[lane] = x * q + y * p
            wr[lane] = p * qr - q * qi
            wi[lane] = p * qi + q * qr
    for n in range(whole, count):
        u = n * scale
        z = complex(zr[n - whole], zi[n - whole])
        z *= gain[0] + u * (gain[1] + u * (gain[2] + u * gain[3]))
        real[n] += z.real
        imag[n] += z.imag


_CHEBYSHEV: Final = 0.5 - 0.5 * np.cos(np.pi * (np.arange(4) + 0.5) / 4)
_TO_POWERS: Final = np.ascontiguousarray(np.linalg.inv(_CHEBYSHEV[:, None] ** np.arange(4)))


@compiled
def _add_near(
    real: FloatArray,
    imag: FloatArray,
    pairs: Pairs,
    taps: Taps,
    pair: int,
    chirp: Chirp,
    time: float,
    step: float,
) -> None:
    """Add, from ``time`` on, the chirp times G, as if it had no ends; beats are in the table."""
    half, rate = taps.half, chirp.rate
    start, change = chirp.beat + rate * time, rate * step
    reach = _reach(pairs, pair, chirp.limit)
    n, end = _range_of_beats(start, change, reach, real.size - 1)
    detune = complex(0.0, math.pi * (rate - pairs.rate[pair]) * half * half)
    block = int(min(STEADY / (2.0 * half * max(abs(change), 1e-300)), LONGEST_BLOCK))
    gain = np.empty(4, dtype=np.complex128)
    while n <= end:
        beat = start + change * n
        phase = phase_of(chirp, time + step * n)
        count = min(block, end + 1 - n)
        if count >= LANES:
            gain[:] = 0.0
            for i in range(4):
                value = from_table(pairs, pair, beat + change * count * _CHEBYSHEV[i], detune)
                for j in range(4):
                    gain[j] += _TO_POWERS[j, i] * value
            part = slice(n, n + count)
            _add_steady(real[part], imag[part], chirp.amplitude, phase, beat, rate, step, gain)
            n += count
        else:
            value = chirp.amplitude * unit(phase) * from_table(pairs, pair, beat, detune)
            real[n] += value.real
            imag[n] += value.imag
            n += 1


@inlined
def _reach(pairs: Pairs, pair: int, limit: float) -> float:
    """Hz, the beat from which on the table's gain is below ``limit``, or its end."""
    low, high = pairs.begin[pair] + 4, pairs.end[pair] - 1
    if pairs.envelope[high] >= limit:
        return np.inf
    while high - low > 1:
        middle = (low + high) // 2
        if pairs.envelope[middle] < limit:
            high = middle
        else:
            low = middle
    return float(high - pairs.begin[pair] - 4) * pairs.step


@inlined
def _range_of_beats(beat: float, change: float, reach: float, last: int) -> tuple[int, int]:
    """First and last n from 0 to ``last`` with |beat + change·n| ≤ reach; empty: last < first."""
    if change == 0.0 or reach == np.inf:
        return (0, last) if abs(beat) <= reach else (0, -1)
    one, other = (-reach - beat) / change, (reach - beat) / change
    begin = max(min(one, other), 0.0)
    end = min(max(one, other), float(last))
    return (math.ceil(begin), math.floor(end)) if begin <= end else (0, -1)


# ── one chirp, all samples ────────────────────────────────────────────────────────────────────


@inlined
def _behind(time: float, first: float, step: float, count: int) -> int:
    """Number of the samples at ``first + n·step`` that lie before ``time``, at most ``count``."""
    return math.ceil(min(max((time - first) / step, 0.0), float(count)))


@compiled
def add_chirp(
    real: FloatArray,
    imag: FloatArray,
    pairs: Pairs,
    taps: Taps,
    pair: int,
    chirp: Chirp,
    first: float,
    step: float,
) -> None:
    """Add a chirp to samples at ``first + n·step``.

    A sample's window is [t − S/2, t + S/2]. Where it is cut and the beat at the cut is low, it is
    integrated. Every other sample is the sum of its ends: corners of the chirp that lie in the
    window, and edges of the window that lie in the chirp. Where some of the window is near the
    band, G replaces the sum of both its edges.
    """
    half, size, far = taps.half, real.size, pairs.far[pair]
    n0 = _behind(chirp.begin - half, first, step, size)
    n3 = _behind(chirp.end + half, first, step, size)
    if n3 <= n0:
        return
    # the samples whose windows have no beginning, and no ending, in them
    whole_from = min(max(_behind(chirp.begin + half, first, step, size), n0), n3)
    whole_until = min(max(_behind(chirp.end - half, first, step, size), n0), n3)
    begin_beat = chirp.beat + chirp.rate * chirp.begin
    end_beat = chirp.beat + chirp.rate * chirp.end
    low, high = n0, n3
    if abs(begin_beat) < far:
        low = whole_from
        part = slice(n0, low)
        _add_cut(real[part], imag[part], taps, chirp, first + n0 * step, step)
    if abs(end_beat) < far:
        high = max(whole_until, low)
        part = slice(high, n3)
        _add_cut(real[part], imag[part], taps, chirp, first + high * step, step)
    if high <= low:
        return
    if abs(begin_beat) >= far and whole_from > low:
        part = slice(low, min(whole_from, high))
        _add_corner(real[part], imag[part], taps, chirp, chirp.begin, first + low * step, step)
    negative = Chirp(
        -chirp.amplitude, chirp.limit, chirp.phase, chirp.beat, chirp.rate, chirp.begin, chirp.end
    )
    if abs(end_beat) >= far and whole_until < high:
        n = max(whole_until, low)
        part = slice(n, high)
        _add_corner(real[part], imag[part], taps, negative, chirp.end, first + n * step, step)
    near_from, near_until = _near_samples(chirp, far, half, first, step, low, high)
    if near_until > near_from:
        part = slice(near_from, near_until)
        time = first + near_from * step
        _add_near(real[part], imag[part], pairs, taps, pair, chirp, time, step)
    # upper edge: in the chirp from whole_from on; G has it too early
    _add_edges(real, imag, taps, chirp, 1, first, step, max(low, whole_from), near_from)
    _add_edges(real, imag, taps, chirp, 1, first, step, max(near_until, whole_from), high)
    _add_edges(real, imag, taps, negative, 1, first, step, near_from, min(near_until, whole_from))
    # lower edge: in the chirp until whole_until
    _add_edges(real, imag, taps, chirp, -1, first, step, low, min(near_from, whole_until))
    _add_edges(real, imag, taps, chirp, -1, first, step, near_until, min(high, whole_until))
    _add_edges(real, imag, taps, negative, -1, first, step, max(near_from, whole_until), near_until)


@compiled
def _near_samples(
    chirp: Chirp, far: float, half: float, first: float, step: float, low: int, high: int
) -> tuple[int, int]:
    """Samples from low to high whose windows meet the chirp where its beat is below ``far``."""
    if chirp.rate == 0.0:
        begin, end = (chirp.begin, chirp.end) if abs(chirp.beat) < far else (0.0, 0.0)
    else:
        one, other = (-far - chirp.beat) / chirp.rate, (far - chirp.beat) / chirp.rate
        begin, end = max(chirp.begin, min(one, other)), min(chirp.end, max(one, other))
    if end <= begin:
        return low, low
    near_from = max(_behind(begin - half, first, step, high), low)
    return near_from, max(_behind(end + half, first, step, high), near_from)


@compiled
def _add_edges(
    real: FloatArray,
    imag: FloatArray,
    taps: Taps,
    chirp: Chirp,
    side: int,
    first: float,
    step: float,
    begin: int,
    end: int,
) -> None:
    if end > begin:
        part = slice(begin, end)
        _add_edge(real[part], imag[part], taps, chirp, side, first + begin * step, step)


@inlined
def received(
    own: Ramps,
    k: int,
    sent: Ramps,
    i: int,
    delay: float,
    delay_rate: float,
    amplitude: complex,
    limit: float,
) -> Chirp:
    """The product of the victim's ramp k and the transmitted ramp i, ``delay`` late at time 0."""
    f, g = sent.frequency[i], sent.slope[i]
    stretched = 1.0 - delay_rate
    ahead = own.start[k] - sent.start[i]
    into = ahead - delay  # time into the transmitted ramp at time 0
    turns = own.phase[k] - sent.phase[i] + (_turns(f, delay) - _turns(f, ahead))
    return Chirp(
        amplitude,
        limit,
        turns - 0.5 * g * into * into,
        (own.frequency[k] - f) + delay_rate * f - stretched * g * into,
        own.slope[k] - stretched * stretched * g,
        max(0.0, -into / stretched),
        min(own.duration[k], (sent.duration[i] - into) / stretched),
    )


@inlined
def sent_amplitude(sent: Ramps, i: int, lines: Lines, p: int) -> complex:
    """A line's amplitude on the transmitted ramp i: times what its element is driven with."""
    driven: complex = lines.amplitude[p] * sent.weight[i, lines.element[p]]
    return driven


@compiled
def add_contribution(
    samples: ComplexArray,
    own: Ramps,
    sent: Ramps,
    window: Window,
    lines: Lines,
    pairs: Pairs,
    taps: Taps,
    visits: Visits,
) -> None:
    """Add to ``(part, channel, ramp, fast)`` what the visits' lines make, one by one.

    The lines of a visit are of one part. What they make is summed by itself, real and imaginary
    parts apart, where it stays near the processor.

    One thread, but without Python's lock: victims and trials are what runs side by side.
    """
    channels, most = samples.shape[1], samples.shape[3]
    held_real, held_imag = np.empty((channels, most)), np.empty((channels, most))
    for v in range(visits.row.size):
        r, k, pair = visits.row[v], visits.ramp[v], visits.pair[v]
        i = pairs.sent[k] + pair - pairs.start[k]
        first = window.first[r] + (own.start[r] - own.start[k])
        since = own.start[k] - lines.reference_time[lines.chosen[k]]
        begin, end = visits.begin[v], visits.end[v]
        start = first + begin * window.step
        count = end - begin
        for m in range(channels):
            held_real[m, :count], held_imag[m, :count] = 0.0, 0.0
        for p in range(visits.low[v], visits.high[v]):
            amplitude = sent_amplitude(sent, i, lines, p)
            if amplitude == 0.0:
                continue
            drift = lines.delay_rate[p]
            for m in range(channels):
                delay = lines.delay[p] + drift * since + lines.element_delay[p, m]
                chirp = received(own, k, sent, i, delay, drift, amplitude, lines.limit[p])
                if chirp.end > chirp.begin:
                    real, imag = held_real[m, :count], held_imag[m, :count]
                    add_chirp(real, imag, pairs, taps, pair, chirp, start, window.step)
        for m in range(channels):
            row = samples[visits.part[v], m, r, begin:end]
            for n in range(count):
                row[n] += complex(held_real[m, n], held_imag[m, n])
