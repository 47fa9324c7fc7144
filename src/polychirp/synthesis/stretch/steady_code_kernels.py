"""Compiled samples of coded ramps whose beats are nearly constant (`coded_ramps`)."""

import math

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.jit import compiled, inlined, inner
from polychirp.synthesis.stretch import kernel_records
from polychirp.synthesis.stretch.chirp_kernels import phase_of
from polychirp.synthesis.stretch.kernel_records import (
    Chips,
    Chirp,
    CodedRamps,
    CodeTable,
    CodeWork,
    RampPair,
)
from polychirp.synthesis.stretch.path_kernels import beat_of, received, sent_amplitude
from polychirp.synthesis.unit_phasors import unit

ramp_pair = inlined(kernel_records.ramp_pair)


@inlined
def drifting(
    tables: CodedRamps, pair: RampPair, p: int, amplitude: complex, time: float
) -> complex:
    """The amplitude of link p, with its drift, at ``time`` from the start of the victim's ramp."""
    drift = tables.links.amplitude_rate[p] * pair.weight[tables.links.element[p]]
    value: complex = amplitude + drift * (pair.since + time)
    return value


@compiled
def beat_extremes(tables: CodedRamps, work: CodeWork) -> tuple[float, float, float]:
    """Least and greatest beat, Hz, of all links in the work's samples, and steepest rate, Hz/s.

    Without a link that meets the victim's ramps, they are ∞, −∞ and 0.
    """
    least, greatest, steepest = np.inf, -np.inf, 0.0
    links, window = tables.links, tables.window
    for u in range(work.row.size):
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
    return least, greatest, steepest


@compiled
def add_steady_code(
    samples: ComplexArray, tables: CodedRamps, work: CodeWork, chips: Chips, table: CodeTable
) -> None:
    """Add all links to ``samples`` (part, channel, ramp, fast) by the table of E."""
    links, window, own = tables.links, tables.window, tables.own
    entries = table.value.shape[2]
    here = np.empty((entries, 2), dtype=np.complex128)
    change = np.empty((entries, 2), dtype=np.complex128)
    for u in range(work.row.size):
        row, ramp, sent = work.row[u], work.ramp[u], work.sent[u]
        pair = ramp_pair(own, ramp, tables.sent, sent, links)
        first = window.first[row] + (own.start[row] - own.start[ramp])
        last = first + (window.num_samples[row] - 1) * window.step
        snapshot = links.snapshot[ramp]
        code = chips.value[chips.row[sent]]
        for p in range(links.start[snapshot], links.start[snapshot + 1]):
            if sent_amplitude(pair, links, p) == 0.0:
                continue
            for m in range(samples.shape[1]):
                chirp = received(pair, links, p, m)
                if chirp.end <= chirp.begin:
                    continue
                is_swept = _prepare(here, change, table, chirp, first, last)
                beat = beat_of(pair, links, p, m)
                stretch = beat.stretched / chips.duration[sent]
                out = samples[links.part[p], m, row]
                for n in range(window.num_samples[row]):
                    time = first + n * window.step
                    low = max(time - tables.taps.half, chirp.begin)
                    high = min(time + tables.taps.half, chirp.end)
                    if high <= low:
                        continue
                    value = _sum_of_chips(
                        here, table.step, code, beat.into / chips.duration[sent], stretch,
                        low, high, time + tables.taps.half,
                    )  # fmt: skip
                    if is_swept:
                        share = (time - first) / (last - first)
                        value += share * _sum_of_chips(
                            change, table.step, code, beat.into / chips.duration[sent], stretch,
                            low, high, time + tables.taps.half,
                        )  # fmt: skip
                    amplitude = drifting(tables, pair, p, chirp.amplitude, time)
                    out[n] += value * amplitude * unit(phase_of(chirp, time))


@inner
def _prepare(
    here: ComplexArray, change: ComplexArray, table: CodeTable, chirp: Chirp, first: float,
    last: float,
) -> bool:  # fmt: skip
    """Fill in E at the beat of the first sample, and its change to the last; True if it changes."""
    count = table.node.size
    one, other = chirp.beat + chirp.rate * first, chirp.beat + chirp.rate * last
    width = table.node[0] - table.node[count - 1]
    is_swept: bool = abs(other - one) > 1e-7 * width
    entries = here.shape[0]
    for e in range(entries):
        here[e, 0], here[e, 1], change[e, 0], change[e, 1] = 0.0j, 0.0j, 0.0j, 0.0j
    for i in range(count):
        a, b = 1.0, 1.0
        for j in range(count):
            if j != i:
                apart = table.node[i] - table.node[j]
                a *= (one - table.node[j]) / apart
                b *= (other - table.node[j]) / apart
        for order in range(2 if is_swept else 1):
            factor = a if order == 0 else a * chirp.rate
            for e in range(entries):
                here[e, 0] += factor * table.value[order, i, e, 0]
                here[e, 1] += factor * table.value[order, i, e, 1]
        if is_swept:
            for e in range(entries):
                change[e, 0] += (b - a) * table.value[0, i, e, 0]
                change[e, 1] += (b - a) * table.value[0, i, e, 1]
    return is_swept


@inner
def _sum_of_chips(
    table: ComplexArray, step: float, code: ComplexArray, into: float, stretch: float, low: float,
    high: float, top: float,
) -> complex:  # fmt: skip
    """Σ over the chips between low and high of chip·(E at its beginning − E at its end).

    The instant s is at ``top − s`` in the table. ``into + stretch·s`` counts chips.
    """
    size = code.size
    number = math.floor(into + stretch * low)
    at_low = _entry(table, (top - low) / step)
    total, chip = 0.0j, code[number % size]
    while True:
        end = (number + 1 - into) / stretch
        if end >= high:
            break
        number += 1
        after = code[number % size]
        if after != chip:
            at_end = _entry(table, (top - end) / step)
            total += chip * (at_low - at_end)
            at_low, chip = at_end, after
    total += chip * (at_low - _entry(table, (top - high) / step))
    return complex(total)


@inlined
def _entry(table: ComplexArray, place: float) -> complex:
    """The table between its entries, by a cubic with the values and derivatives there."""
    e = min(max(int(place), 0), table.shape[0] - 2)
    x = place - e
    y = 1.0 - x
    value: complex = (
        (y * y * (1.0 + 2.0 * x)) * table[e, 0]
        + (x * x * (1.0 + 2.0 * y)) * table[e + 1, 0]
        + (x * y * y) * table[e, 1]
        - (x * x * y) * table[e + 1, 1]
    )
    return value
