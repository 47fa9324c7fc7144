"""Compiled sums over links, channels and samples, link by link."""

import math

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.jit import compiled, inlined
from polychirp.synthesis.stretch import kernel_records
from polychirp.synthesis.stretch.chirp_kernels import add_chirp
from polychirp.synthesis.stretch.kernel_records import (
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
    sent_ramp = pairs.sent[ramp] + number - pairs.start[ramp]
    first = window.first[row] + (own.start[row] - own.start[ramp])
    return (
        ramp_pair(own, ramp, tables.sent, sent_ramp, tables.links),
        response_of(pairs, number),
        first + work.begin[u] * window.step,
        work.end[u] - work.begin[u],
    )


@inlined
def received(pair: RampPair, links: LinkTable, p: int, m: int) -> Chirp:
    """The beat of the victim's ramp with the transmitted one, received by link p at channel m."""
    drift = links.delay_rate[p]
    delay = links.delay[p] + drift * pair.since + links.element_delay[p, m]
    f, g = pair.sent_frequency, pair.sent_slope
    stretched = 1.0 - drift
    into = pair.ahead - delay  # time since the start of the transmitted ramp, at time 0
    turns = pair.phase - pair.sent_phase + (_turns(f, delay) - _turns(f, pair.ahead))
    return Chirp(
        sent_amplitude(pair, links, p),
        links.limit[p],
        turns - 0.5 * g * into * into,
        (pair.frequency - f) + drift * f - stretched * g * into,
        pair.slope - stretched * stretched * g,
        max(0.0, -into / stretched),
        min(pair.duration, (pair.sent_duration - into) / stretched),
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
