"""Compiled sums over links, channels and samples, link by link."""

import math

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.jit import compiled, inlined
from polychirp.synthesis.stretch import kernel_records
from polychirp.synthesis.stretch.chirp_kernels import add_chirp
from polychirp.synthesis.stretch.kernel_records import (
    Beat,
    Chirp,
    LinkTable,
    RampPair,
    Response,
    Samples,
    Tables,
    WorkTable,
)

ramp_pair = inlined(kernel_records.ramp_pair)
response_of = inlined(kernel_records.response_of)


@compiled
def add_contribution(samples: ComplexArray, tables: Tables, work: WorkTable) -> None:
    """Add the links of the work units one by one to ``samples`` (part, channel, ramp, fast).

    The links of a unit are of one part. Their sum is made in two small arrays, of real and of
    imaginary parts, which stay in the cache. The kernel uses one thread and frees Python's lock, so
    that several victims and trials can run at once.
    """
    links, step, taps = tables.links, tables.window.step, tables.taps
    channels, most = samples.shape[1], samples.shape[3]
    held_real, held_imag = np.empty((channels, most)), np.empty((channels, most))
    for u in range(work.row.size):
        pair, response, start, count = unit_span(tables, work, u)
        for m in range(channels):
            held_real[m, :count], held_imag[m, :count] = 0.0, 0.0
        for p in range(work.low[u], work.high[u]):
            if sent_amplitude(pair, links, p) == 0.0:
                continue
            for m in range(channels):
                chirp = received(pair, links, p, m)
                if chirp.end > chirp.begin:
                    held = Samples(held_real[m, :count], held_imag[m, :count], start, step)
                    add_chirp(held, response, taps, chirp)
        for m in range(channels):
            out = samples[work.part[u], m, work.row[u], work.begin[u] : work.end[u]]
            for n in range(count):
                out[n] += complex(held_real[m, n], held_imag[m, n])


@inlined
def unit_span(tables: Tables, work: WorkTable, u: int) -> tuple[RampPair, Response, float, int]:
    """Pair of ramps and response of work unit u, time of its first sample, s, and their number."""
    own, pairs, window = tables.own, tables.pairs, tables.window
    row, ramp, number = work.row[u], work.ramp[u], work.pair[u]
    first = window.first[row] + (own.start[row] - own.start[ramp])
    return (
        ramp_pair(own, ramp, tables.sent, pairs.sent[number], tables.links),
        response_of(pairs, number),
        first + work.begin[u] * window.step,
        work.end[u] - work.begin[u],
    )


@inlined
def received(pair: RampPair, links: LinkTable, p: int, m: int) -> Chirp:
    """The beat of the victim's ramp with the transmitted one, received by link p at channel m."""
    f, g = pair.sent_frequency, pair.sent_slope
    beat = beat_of(pair, links, p, m)
    into = beat.into
    turns = pair.phase - pair.sent_phase + (_turns(f, beat.delay) - _turns(f, pair.ahead))
    return Chirp(
        sent_amplitude(pair, links, p),
        links.limit[p],
        turns - 0.5 * g * into * into + beat.phase,
        beat.frequency,
        beat.rate,
        max(0.0, -into / beat.stretched),
        min(pair.duration, (pair.sent_duration - into) / beat.stretched),
    )


@inlined
def beat_of(pair: RampPair, links: LinkTable, p: int, m: int) -> Beat:
    r"""The beat of the victim's ramp with the transmitted one, received by link p at channel m.

    With the delay's acceleration :math:`\ddot\tau`, the time into the transmitted ramp of slope g
    is :math:`u_0 + \dot u_0 t - \tfrac12\ddot\tau t^2`, and the beat's phase has the cubic term
    :math:`\tfrac12 g \dot u_0\ddot\tau\,t^3`. The quadratic nearest to :math:`t^3` over a ramp of
    the duration 2h is :math:`3ht^2 - \tfrac94 h^2 t + \tfrac14 h^3`; `slow_changes` has the rest.
    """
    since, bend = pair.since, links.delay_acceleration[p]
    f, g, half = pair.sent_frequency, pair.sent_slope, 0.5 * pair.duration
    steady = links.delay_rate[p] + links.element_delay_rate[p, m]
    delay = links.delay[p] + links.element_delay[p, m] + since * (steady + 0.5 * bend * since)
    drift = steady + bend * since
    stretched = 1.0 - drift
    into = pair.ahead - delay
    cubic = 0.5 * g * stretched * bend
    return Beat(
        (pair.frequency - f) + drift * f - stretched * g * into - 2.25 * cubic * half * half,
        pair.slope - stretched * stretched * g + bend * (f + g * into) + 6.0 * cubic * half,
        delay,
        into,
        stretched,
        0.25 * cubic * half * half * half,
    )


@inlined
def sent_amplitude(pair: RampPair, links: LinkTable, p: int) -> complex:
    """Amplitude of link p times the weight of its element on the transmitted ramp."""
    driven: complex = links.amplitude[p] * pair.weight[links.element[p]]
    return driven


@inlined
def _turns(frequency: float, time: float) -> float:
    """The fraction of frequency × time in cycles, without the rounding of the product.

    This is Dekker's product: both factors are split into halves whose products are exact. Fused
    multiplications and additions would make the halves wrong.
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
