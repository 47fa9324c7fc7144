"""Compiled samples of coded ramps whose beats change while a ramp lasts (`coded_ramps`)."""

import math

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.jit import compiled, inlined, inner
from polychirp.synthesis.stretch import kernel_records
from polychirp.synthesis.stretch.chirp_kernels import phase_of
from polychirp.synthesis.stretch.filter_kernels import tap
from polychirp.synthesis.stretch.kernel_records import (
    Chips,
    CodedChirp,
    CodedRamps,
    CodeWork,
    SweptRule,
    Taps,
)
from polychirp.synthesis.stretch.path_kernels import beat_of, received, sent_amplitude
from polychirp.synthesis.stretch.steady_code_kernels import drifting
from polychirp.synthesis.unit_phasors import unit

ramp_pair = inlined(kernel_records.ramp_pair)


@compiled
def add_swept_code(
    samples: ComplexArray, tables: CodedRamps, work: CodeWork, chips: Chips, rule: SweptRule
) -> None:
    """Add all links to ``samples`` (part, channel, ramp, fast) by Filon's rule.

    Panels of cells follow each other from the start of the sent ramp. A sample is the sum over the
    panels within its window, and over the cells of the two panels that the window's edges cut.
    """
    links, window, own, taps = tables.links, tables.window, tables.own, tables.taps
    for u in range(work.row.size):
        row, ramp, sent = work.row[u], work.ramp[u], work.sent[u]
        pair = ramp_pair(own, ramp, tables.sent, sent, links)
        first = window.first[row] + (own.start[row] - own.start[ramp])
        last = first + (window.num_samples[row] - 1) * window.step
        snapshot = links.snapshot[ramp]
        code = chips.value[chips.row[sent]]
        cell = chips.duration[sent] / rule.cells_per_chip
        for p in range(links.start[snapshot], links.start[snapshot + 1]):
            if sent_amplitude(pair, links, p) == 0.0:
                continue
            for m in range(samples.shape[1]):
                chirp = received(pair, links, p, m)
                low = max(chirp.begin, first - taps.half)
                high = min(chirp.end, last + taps.half)
                if high <= low:
                    continue
                beat = beat_of(pair, links, p, m)
                # cell number c arrives at (c − into)/stretch
                into, stretch = beat.into / cell, beat.stretched / cell
                start = math.ceil((into + stretch * low) / rule.cells - 1e-9)
                stop = math.floor((into + stretch * high) / rule.cells + 1e-9)
                moment = np.zeros((max(stop - start, 0), rule.panel.size), dtype=np.complex128)
                coded = CodedChirp(chirp, code, into, stretch)
                for number in range(moment.shape[0]):
                    _fill_panel(moment[number], coded, rule, start + number)
                out = samples[links.part[p], m, row]
                for n in range(window.num_samples[row]):
                    time = first + n * window.step
                    begin = max(time - taps.half, chirp.begin)
                    end = min(time + taps.half, chirp.end)
                    if end <= begin:
                        continue
                    value = _sample(moment, taps, coded, rule, start, time, begin, end)
                    # the chirp has its own amplitude already
                    drift = drifting(tables, pair, p, chirp.amplitude, time) / chirp.amplitude
                    out[n] += value * drift


@inner
def _sample(
    moment: ComplexArray, taps: Taps, coded: CodedChirp, rule: SweptRule, start: int, time: float,
    begin: float, end: float,
) -> complex:  # fmt: skip
    """The sample at ``time``, from the moments of panels number ``start`` on and cut panels."""
    cells, into, stretch = rule.cells, coded.into, coded.stretch
    one = math.ceil((into + stretch * begin) / cells - 1e-9)
    other = math.floor((into + stretch * end) / cells + 1e-9)
    one, other = max(one, start), min(other, start + moment.shape[0])
    if other <= one:
        return _cut(taps, coded, rule, time, begin, end)
    total = 0.0j
    half = 0.5 * cells / stretch
    for number in range(one, other):
        middle = ((number + 0.5) * cells - into) / stretch
        for j in range(rule.panel.size):
            s = time - middle - half * rule.panel[j]
            s = min(max(s, -taps.half), taps.half)
            total += moment[number - start, j] * tap(taps, s)
    inner_begin, inner_end = (one * cells - into) / stretch, (other * cells - into) / stretch
    if inner_begin > begin:
        total += _cut(taps, coded, rule, time, begin, inner_begin)
    if end > inner_end:
        total += _cut(taps, coded, rule, time, inner_end, end)
    return total


@inner
def _fill_panel(moment: ComplexArray, coded: CodedChirp, rule: SweptRule, number: int) -> None:
    """Fill in the integrals over a panel of the signal times Lagrange's polynomials."""
    chirp, code = coded.chirp, coded.code
    cells, nodes = rule.cells, rule.node.size
    half = 0.5 / coded.stretch
    middle = ((number + 0.5) * cells - coded.into) / coded.stretch
    tangent = chirp.beat + chirp.rate * middle
    weight = np.empty(nodes, dtype=np.complex128)
    _fill_weights(weight, rule, math.tau * tangent * half)
    for c in range(cells):
        cell = number * cells + c
        chip = code[(cell // rule.cells_per_chip) % code.size]
        if chip == 0.0:
            continue
        centre = (cell + 0.5 - coded.into) / coded.stretch
        chip *= half * chirp.amplitude
        for q in range(nodes):
            off = half * rule.node[q]
            turned = phase_of(chirp, centre + off) - tangent * off
            value = chip * weight[q] * unit(turned)
            for j in range(moment.size):
                moment[j] += rule.spread[c, q, j] * value


@inner
def _cut(
    taps: Taps, coded: CodedChirp, rule: SweptRule, time: float, begin: float, end: float
) -> complex:
    """∫ h(time − s) times the signal from begin to end, cell by cell, of which two may be cut."""
    chirp, code, nodes = coded.chirp, coded.code, rule.node.size
    weight = np.empty(nodes, dtype=np.complex128)
    total = 0.0j
    cell = math.floor(coded.into + coded.stretch * begin + 1e-9)
    low, last_half, tangent = begin, -1.0, 0.0
    while low < end:
        high = min((cell + 1 - coded.into) / coded.stretch, end)
        half, centre = 0.5 * (high - low), 0.5 * (low + high)
        chip = code[(cell // rule.cells_per_chip) % code.size]
        if half > 0.0 and chip != 0.0:
            # neighbouring whole cells share the weights of the first one's beat
            if abs(half - last_half) > 1e-9 * half:
                tangent, last_half = chirp.beat + chirp.rate * centre, half
                _fill_weights(weight, rule, math.tau * tangent * half)
            for q in range(nodes):
                off = half * rule.node[q]
                turned = phase_of(chirp, centre + off) - tangent * off
                s = min(max(time - centre - off, -taps.half), taps.half)
                total += (half * chip * tap(taps, s)) * weight[q] * unit(turned)
        low = high
        cell += 1
    return total * chirp.amplitude


@inner
def _fill_weights(weight: ComplexArray, rule: SweptRule, theta: float) -> None:
    """Weights of the nodes in ∫g(z) exp(jθz) dz over [−1, 1], exact for polynomials g."""
    orders = rule.to_node.shape[1]
    bessel = np.empty(orders)
    _spherical_bessel(bessel, theta)
    for q in range(weight.size):
        total = 0.0j
        for n in range(orders):
            total += rule.to_node[q, n] * bessel[n]
        weight[q] = total


@inner
def _spherical_bessel(out: FloatArray, x: float) -> None:
    """Spherical Bessel functions of the orders 0, 1, … at x.

    The series in x² is used below the highest order plus one, where the recurrence is unstable.
    """
    size = out.size
    if abs(x) >= size:
        out[0] = math.sin(x) / x
        out[1] = out[0] / x - math.cos(x) / x
        for n in range(2, size):
            out[n] = (2 * n - 1) / x * out[n - 1] - out[n - 2]
        return
    scale = 1.0
    for n in range(size):
        term, total = 1.0, 1.0
        for k in range(1, 60):
            term *= -0.5 * x * x / (k * (2 * n + 2 * k + 1))
            total += term
            if abs(term) < 1e-17:
                break
        out[n] = scale * total
        scale *= x / (2 * n + 3)
