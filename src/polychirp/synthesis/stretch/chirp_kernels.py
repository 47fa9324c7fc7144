"""Compiled samples of one chirp after the IF filter.

The signal of a piece of a chirp is exp(j2π(φ + f t + ½ μ t²)) from one end of the piece to the
other and zero elsewhere. A sample is the integral of the signal times the impulse response h over
the filter's window, which extends by half the support S to both sides.
"""

import math
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.jit import inlined, inner
from polychirp.synthesis.stretch.filter_kernels import (
    derivative,
    edge_gain,
    end_series,
    table_reach,
    tabulated_gain,
    tap,
)
from polychirp.synthesis.stretch.kernel_records import Chirp, Response, Samples, Taps
from polychirp.synthesis.unit_phasors import unit, units

NUM_LANES: Final = 16
"""Number of samples that a recurrence advances together, for vector instructions; chosen."""

LONGEST_BLOCK: Final = 4096
"""Number of samples after which a recurrence starts anew, as its rounding errors grow; chosen."""

STEADY_CHANGE: Final = 0.05
"""Most change of the beat in a block, in units of 1/S; chosen: a cubic gain is right to 1e-9."""

PANEL_CYCLES: Final = 9.0
"""Most cycles in a panel of 32 Gauss nodes; chosen: the rule's error is (9πe/128)⁶⁴, 1e-14."""

EDGE_TOLERANCE: Final = 1e-9
"""Least tolerance for the cubic gain of an edge, relative to the pass band's gain; chosen."""

_NODES: Final = 0.5 - 0.5 * np.cos(np.pi * (np.arange(4) + 0.5) / 4)
_TO_POWERS: Final = np.ascontiguousarray(np.linalg.inv(_NODES[:, None] ** np.arange(4)))
"""Chebyshev's nodes on [0, 1], and the matrix from values there to a cubic's coefficients."""


@inlined
def phase_of(chirp: Chirp, time: float) -> float:
    """Phase of the chirp at ``time``, cycles."""
    return chirp.phase + time * (chirp.beat + 0.5 * chirp.rate * time)


@inlined
def _run(samples: Samples, begin: int, end: int) -> Samples:
    """The samples ``begin:end``."""
    return Samples(
        samples.real[begin:end],
        samples.imag[begin:end],
        samples.first + begin * samples.step,
        samples.step,
    )


@inlined
def _add_value(samples: Samples, n: int, value: complex) -> None:
    samples.real[n] += value.real
    samples.imag[n] += value.imag


@inlined
def _num_before(time: float, samples: Samples, most: int) -> int:
    """Number of the samples that lie before ``time``, at most ``most``."""
    return math.ceil(min(max((time - samples.first) / samples.step, 0.0), float(most)))


@inner
def add_chirp(samples: Samples, response: Response, taps: Taps, chirp: Chirp) -> None:
    """Add a chirp to samples.

    A sample's window is [t − S/2, t + S/2]. If the chirp begins or ends in it at a low beat, the
    sample is integrated numerically. Every other sample is a sum of contributions: of the chirp's
    corners (its beginning and ending) in the window, and of the window's edges in the chirp. If a
    part of the window is near the band, G replaces the sum of both its edges.
    """
    half, size, far = taps.half, samples.real.size, response.far
    n0 = _num_before(chirp.begin - half, samples, size)
    n3 = _num_before(chirp.end + half, samples, size)
    if n3 <= n0:
        return
    # windows from whole_from on contain no beginning of the chirp, those before whole_until no end
    whole_from = min(max(_num_before(chirp.begin + half, samples, size), n0), n3)
    whole_until = min(max(_num_before(chirp.end - half, samples, size), n0), n3)
    begin_beat = chirp.beat + chirp.rate * chirp.begin
    end_beat = chirp.beat + chirp.rate * chirp.end
    # windows with a corner at a low beat
    low, high = n0, n3
    if abs(begin_beat) < far:
        low = whole_from
        _add_cut(_run(samples, n0, low), taps, chirp)
    if abs(end_beat) < far:
        high = max(whole_until, low)
        _add_cut(_run(samples, high, n3), taps, chirp)
    if high <= low:
        return
    # corners at a high beat
    if abs(begin_beat) >= far and whole_from > low:
        _add_corner(_run(samples, low, min(whole_from, high)), taps, chirp, chirp.begin)
    negative = Chirp(
        -chirp.amplitude, chirp.limit, chirp.phase, chirp.beat, chirp.rate, chirp.begin, chirp.end
    )
    if abs(end_beat) >= far and whole_until < high:
        _add_corner(_run(samples, max(whole_until, low), high), taps, negative, chirp.end)
    near_from, near_until = _near_samples(chirp, far, half, samples, low, high)
    if near_until > near_from:
        _add_near(_run(samples, near_from, near_until), response, taps, chirp)
    # the upper edge lies in the chirp from whole_from on, the lower one until whole_until; near the
    # band G includes both; a loop, because numba would compile `_add_edge` for each literal side
    for side in (1, -1):
        begin, end = (whole_from, high) if side > 0 else (low, whole_until)
        _add_edges(samples, taps, chirp, side, max(low, begin), min(near_from, end))
        _add_edges(samples, taps, chirp, side, max(near_until, begin), min(high, end))
        _add_edges(samples, taps, negative, side, near_from, min(near_until, begin))
        _add_edges(samples, taps, negative, side, max(near_from, end), near_until)


@inner
def _near_samples(
    chirp: Chirp, far: float, half: float, samples: Samples, low: int, high: int
) -> tuple[int, int]:
    """Samples from low to high whose windows meet the chirp where its beat is below ``far``."""
    if chirp.rate == 0.0:
        begin, end = (chirp.begin, chirp.end) if abs(chirp.beat) < far else (0.0, 0.0)
    else:
        one, other = (-far - chirp.beat) / chirp.rate, (far - chirp.beat) / chirp.rate
        begin, end = max(chirp.begin, min(one, other)), min(chirp.end, max(one, other))
    if end <= begin:
        return low, low
    near_from = max(_num_before(begin - half, samples, high), low)
    return near_from, max(_num_before(end + half, samples, high), near_from)


@inner
def _add_corner(samples: Samples, taps: Taps, chirp: Chirp, corner: float) -> None:
    """Add the contribution of a beginning (or, with negative amplitude, an ending) of the chirp.

    The chirp's value and beat at the corner are the same for all samples; only h differs.
    """
    beat = chirp.beat + chirp.rate * corner
    if taps.peak < chirp.limit * math.tau * abs(beat):
        return
    weight = np.empty(taps.bessel.shape[0], dtype=np.complex128)
    count = end_series(taps, beat, chirp.rate, weight)
    value = chirp.amplitude * unit(phase_of(chirp, corner))
    for n in range(samples.real.size):
        s = min(max(samples.first + n * samples.step - corner, -taps.half), taps.half)
        total = weight[0] * tap(taps, s)
        for j in range(1, count):
            total += weight[j] * derivative(taps, s, j)
        _add_value(samples, n, total * value)


@inner
def _add_cut(samples: Samples, taps: Taps, chirp: Chirp) -> None:
    """Add samples whose windows have a corner at a low beat, by `quadrature`."""
    for n in range(samples.real.size):
        t = samples.first + n * samples.step
        low, high = max(-taps.half, t - chirp.end), min(taps.half, t - chirp.begin)
        if high > low:
            value = quadrature(taps, low, high, chirp.beat + chirp.rate * t, chirp.rate)
            value *= chirp.amplitude * unit(phase_of(chirp, t))
            _add_value(samples, n, value)


@inner
def quadrature(taps: Taps, low: float, high: float, beat: float, rate: float) -> complex:
    """∫h(s) exp(j2π(−f s + ½ μ s²)) ds from low to high, in panels of at most `PANEL_CYCLES`."""
    fastest = max(abs(beat - rate * low), abs(beat - rate * high)) + taps.stopband
    panels = math.ceil(fastest * (high - low) / PANEL_CYCLES)
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
        units(cycles, real, imag)
        for i in range(count):
            height = taps.weight[i] * tap(taps, place[i])
            x += height * real[i]
            y += height * imag[i]
    return complex(width * x, width * y)


@inner
def _add_edges(samples: Samples, taps: Taps, chirp: Chirp, side: int, begin: int, end: int) -> None:
    if end > begin:
        _add_edge(_run(samples, begin, end), taps, chirp, side)


@inner
def _add_edge(samples: Samples, taps: Taps, chirp: Chirp, side: int) -> None:
    """Add the contribution of the window's upper (side 1) or lower (−1) edge, far out of band.

    It is the chirp half a support earlier (side 1) or later, times a gain of about h/2πf. Samples
    share a cubic gain as long as it is right to `EDGE_TOLERANCE` or a tenth of the limit. Between
    f(1 − κ) and f(1 + κ) a cubic at Chebyshev's nodes has an error of κ⁴/8 of 1/f.
    """
    step, rate, change = samples.step, chirp.rate, chirp.rate * samples.step
    node = 0 if side < 0 else taps.taylor.shape[0] - 1
    amplitude = side * chirp.amplitude
    gain = np.empty(4, dtype=np.complex128)
    time = samples.first - side * taps.half
    start = chirp.beat + rate * time
    reach = np.inf if chirp.limit <= 0.0 else taps.edge / (math.tau * chirp.limit)
    n, end = _range_of_beats(start, change, reach, samples.real.size - 1)
    while n <= end:
        beat = start + change * n
        phase = phase_of(chirp, time + step * n)
        # number of samples over which the beat stays within ±κ = span of its middle value
        height = taps.edge / (math.tau * abs(beat))
        span = min((8.0 * max(EDGE_TOLERANCE, 0.1 * chirp.limit) / height) ** 0.25, 0.33)
        receding = math.copysign(span, beat * change)
        most = 2.0 * span / (1.0 - receding) * abs(beat) / max(abs(change), 1e-300)
        count = min(int(min(most, LONGEST_BLOCK)), end + 1 - n)
        if 2 * count >= NUM_LANES:
            gain[:] = 0.0
            for i in range(4):
                value = edge_gain(taps, node, beat + change * count * _NODES[i], rate)
                for j in range(4):
                    gain[j] += _TO_POWERS[j, i] * value
            _add_steady(_run(samples, n, n + count), amplitude, phase, beat, rate, gain)
            n += count
        else:
            _add_value(samples, n, amplitude * unit(phase) * edge_gain(taps, node, beat, rate))
            n += 1


@inner
def _add_near(samples: Samples, response: Response, taps: Taps, chirp: Chirp) -> None:
    """Add the chirp times G, as if it had no ends; the samples' beats are in the table."""
    half, rate, step = taps.half, chirp.rate, samples.step
    start, change = chirp.beat + rate * samples.first, rate * step
    reach = table_reach(response, chirp.limit)
    n, end = _range_of_beats(start, change, reach, samples.real.size - 1)
    detune = complex(0.0, math.pi * (rate - response.rate) * half * half)
    block = int(min(STEADY_CHANGE / (2.0 * half * max(abs(change), 1e-300)), LONGEST_BLOCK))
    gain = np.empty(4, dtype=np.complex128)
    while n <= end:
        beat = start + change * n
        phase = phase_of(chirp, samples.first + step * n)
        count = min(block, end + 1 - n)
        if count >= NUM_LANES:
            gain[:] = 0.0
            for i in range(4):
                value = tabulated_gain(response, beat + change * count * _NODES[i], detune)
                for j in range(4):
                    gain[j] += _TO_POWERS[j, i] * value
            _add_steady(_run(samples, n, n + count), chirp.amplitude, phase, beat, rate, gain)
            n += count
        else:
            value = chirp.amplitude * unit(phase) * tabulated_gain(response, beat, detune)
            _add_value(samples, n, value)
            n += 1


@inlined
def _range_of_beats(beat: float, change: float, reach: float, last: int) -> tuple[int, int]:
    """First and last n from 0 to ``last`` with |beat + change·n| ≤ reach; empty: last < first."""
    if change == 0.0 or reach == np.inf:
        return (0, last) if abs(beat) <= reach else (0, -1)
    one, other = (-reach - beat) / change, (reach - beat) / change
    begin = max(min(one, other), 0.0)
    end = min(max(one, other), float(last))
    return (math.ceil(begin), math.floor(end)) if begin <= end else (0, -1)


@inner
def _add_steady(
    samples: Samples, amplitude: complex, phase: float, beat: float, rate: float, gain: ComplexArray
) -> None:
    """Add a chirp with a cubic gain; `NUM_LANES` samples advance by complex multiplications.

    ``phase`` and ``beat`` are those at the first sample; ``gain`` is in powers of n/size.
    """
    real, imag, count = samples.real, samples.imag, samples.real.size
    # every lane has a value z and a factor w, by which z changes over NUM_LANES samples
    zr, zi = np.empty(NUM_LANES), np.empty(NUM_LANES)
    wr, wi = np.empty(NUM_LANES), np.empty(NUM_LANES)
    f, mu = beat * samples.step, rate * samples.step * samples.step
    z = amplitude * unit(phase)
    one = unit(f + 0.5 * mu)
    bend = unit(mu)
    many = unit(NUM_LANES * (f + 0.5 * mu * NUM_LANES))
    bends = unit(mu * NUM_LANES)
    for lane in range(NUM_LANES):
        zr[lane], zi[lane], wr[lane], wi[lane] = z.real, z.imag, many.real, many.imag
        z *= one
        one *= bend
        many *= bends
    turn = unit(mu * NUM_LANES * NUM_LANES)
    qr, qi = turn.real, turn.imag
    a0, a1, a2, a3 = gain[0].real, gain[1].real, gain[2].real, gain[3].real
    b0, b1, b2, b3 = gain[0].imag, gain[1].imag, gain[2].imag, gain[3].imag
    scale = 1.0 / count
    # real arithmetic, so that the compiler can use vector instructions
    whole = count // NUM_LANES * NUM_LANES
    for n in range(0, whole, NUM_LANES):
        for lane in range(NUM_LANES):
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
        _add_value(samples, n, z)
