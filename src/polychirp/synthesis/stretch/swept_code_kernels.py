"""Compiled samples of coded ramps whose beats change while a ramp lasts (`coded_ramps`).

All links are summed before the filter, in panels between two samples as in `near_corners`. A cell
is a chip or a part of it, cut where panels and windows end.
"""

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
    WindowSeries,
)
from polychirp.synthesis.stretch.near_corner_kernels import Moments, Panels
from polychirp.synthesis.stretch.path_kernels import beat_of, received, sent_amplitude
from polychirp.synthesis.unit_phasors import units

ramp_pair = inlined(kernel_records.ramp_pair)


@compiled
def add_swept_code(
    samples: ComplexArray, tables: CodedRamps, work: CodeWork, chips: Chips, rule: SweptRule,
    series: WindowSeries,
) -> None:  # fmt: skip
    """Add all links to ``samples`` (part, channel, ramp, fast) by their moments."""
    links, window, own, taps = tables.links, tables.window, tables.own, tables.taps
    columns = series.gain.shape[1]
    gain = series.gain.reshape(series.gain.size)
    for u in range(work.row.size):
        row, ramp, sent = work.row[u], work.ramp[u], work.sent[u]
        pair = ramp_pair(own, ramp, tables.sent, sent, links)
        start = window.first[row] + (own.start[row] - own.start[ramp])
        count, snapshot = window.num_samples[row], links.snapshot[ramp]
        number = count + series.num_steps
        panels = Panels(start - taps.half, window.step, number, 1, np.inf)
        cell = chips.duration[sent] / rule.cells_per_chip
        low = links.start[snapshot]
        while low < links.start[snapshot + 1]:
            part, high = links.part[low], low
            while high < links.start[snapshot + 1] and links.part[high] == part:
                high += 1
            for m in range(samples.shape[1]):
                real, imag = np.zeros((number, columns)), np.zeros((number, columns))
                for p in range(low, high):
                    amplitude = sent_amplitude(pair, links, p)
                    if amplitude == 0.0:
                        continue
                    chirp = received(pair, links, p, m)
                    beat = beat_of(pair, links, p, m)
                    drift = links.amplitude_rate[p] * pair.weight[links.element[p]]
                    coded = CodedChirp(
                        chirp, amplitude + drift * pair.since, drift,
                        chips.value[chips.row[sent]], beat.into / cell, beat.stretched / cell,
                    )  # fmt: skip
                    _add_link(Moments(real, imag), coded, panels, rule, series, taps)
                x, y = real.reshape(number * columns), imag.reshape(number * columns)
                out = samples[part, m, row]
                for n in range(count):
                    held = slice(n * columns, n * columns + gain.size)
                    out[n] += complex(np.dot(gain, x[held]), np.dot(gain, y[held]))
            low = high


@inner
def _add_link(
    moments: Moments, coded: CodedChirp, panels: Panels, rule: SweptRule, series: WindowSeries,
    taps: Taps,
) -> None:  # fmt: skip
    """Add a link's moments of all panels that meet its chirp."""
    chirp, step, nodes = coded.chirp, panels.step, rule.node.size
    # cells of a panel, of which the panel's and the window's ends cut some
    most = nodes * (math.ceil(step * coded.stretch) + 4)
    place, cycles, factor = np.empty(most), np.empty(most), np.empty(most, dtype=np.complex128)
    whole, cut = np.empty(nodes, dtype=np.complex128), np.empty(nodes, dtype=np.complex128)
    begin = max(math.floor((chirp.begin - panels.first) / step), 0)
    end = min(math.ceil((chirp.end - panels.first) / step), panels.number)
    half_cell = 0.5 / coded.stretch
    for k in range(begin, end):
        first = panels.first + k * step
        low, high = max(chirp.begin, first), min(chirp.end, first + step)
        split = first + series.share * step
        tangent = chirp.beat + chirp.rate * 0.5 * (low + high)
        _fill_weights(whole, rule, math.tau * tangent * half_cell)
        cell = math.floor(coded.into + coded.stretch * low)
        size = 0
        while low < high:
            after = min((cell + 1 - coded.into) / coded.stretch, high)
            if low < split < after:
                after = split
            else:
                cell += 1
            half, centre = 0.5 * (after - low), 0.5 * (low + after)
            number = (cell if after == split else cell - 1) // rule.cells_per_chip
            chip = coded.code[number % coded.code.size]
            low = after
            if half <= 0.0 or chip == 0.0:
                continue
            weight = whole
            if abs(half - half_cell) > 1e-9 * half_cell:
                weight = cut
                _fill_weights(cut, rule, math.tau * tangent * half)
            for q in range(nodes):
                off = half * rule.node[q]
                place[size] = (centre + off - first) / step
                cycles[size] = phase_of(chirp, centre + off) - tangent * off
                amplitude = coded.amplitude + coded.drift * (centre + off)
                factor[size] = half * chip * weight[q] * amplitude
                size += 1
        _add_nodes(moments, k, place[:size], cycles[:size], factor[:size], series, taps, step)


@inner
def _add_nodes(
    moments: Moments, k: int, place: FloatArray, cycles: FloatArray, factor: ComplexArray,
    series: WindowSeries, taps: Taps, step: float,
) -> None:  # fmt: skip
    """Add nodes of panel k to its moments: Legendre's polynomials, and the last one, with h."""
    size, orders = place.size, moments.real.shape[1] - 1
    real, imag = np.empty(size), np.empty(size)
    before, value = np.zeros(size), np.ones(size)
    units(cycles, real, imag)
    x, y = 0.0, 0.0
    for i in range(size):
        z = factor[i] * complex(real[i], imag[i])
        real[i], imag[i] = z.real, z.imag
        if place[i] < series.share:
            # the last panel of a window ends here
            s = taps.half - step * (series.num_steps + place[i])
            height = tap(taps, max(s, -taps.half))
            x += height * z.real
            y += height * z.imag
        place[i] = 2.0 * place[i] - 1.0
    moments.real[k, orders] += x
    moments.imag[k, orders] += y
    for j in range(orders):
        x, y = 0.0, 0.0
        rise, fall = (2 * j + 1) / (j + 1), j / (j + 1)
        for i in range(size):
            x += value[i] * real[i]
            y += value[i] * imag[i]
            before[i], value[i] = value[i], rise * place[i] * value[i] - fall * before[i]
        moments.real[k, j] += x
        moments.imag[k, j] += y


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
