"""Compiled parts of `near_corners`: moments of many links, and samples from them.

A panel is the interval between two samples. It is divided into pieces of `NUM_PANEL_NODES` nodes.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.jit import compiled, inlined, inner
from polychirp.synthesis.stretch.chirp_kernels import add_chirp, phase_of
from polychirp.synthesis.stretch.filter_kernels import tap
from polychirp.synthesis.stretch.kernel_records import (
    NUM_PANEL_NODES,
    Batch,
    Chirp,
    Samples,
    Tables,
    Taps,
    WindowSeries,
    WorkTable,
)
from polychirp.synthesis.stretch.path_kernels import received, sent_amplitude, unit_span
from polychirp.synthesis.unit_phasors import unit, units

PIECE_CYCLES: Final = 2.5
"""Most cycles in a piece; chosen: Gauss's rule of 16 nodes has an error of (2.5πe/64)³², 4e-16, and
the polynomial through them, which is used where windows end, one of 5e-9."""

FASTEST: Final = 2.0
"""Greatest beat, relative to that above which the end-point series holds, up to which chirps are
taken as a whole; chosen. Of faster ones, the parts near the band are taken."""

FAR_OFF: Final = 1.001
"""Beat at which fast chirps are divided, relative to the same beat; chosen just above 1, so that
the series holds for the rest of the chirp."""

LONGEST_RUN: Final = 1024
"""Number of panels after which a recurrence starts anew, as its rounding errors grow; chosen."""


class Panels(NamedTuple):
    """Panels of duration ``step``, s, from ``first`` on; each has ``pieces``.

    They hold the parts of chirps whose beats are up to ``highest``, Hz.
    """

    first: float
    step: float
    number: int
    pieces: int
    highest: float


class Sums(NamedTuple):
    """Real and imaginary parts of sums over links, ``(panel, node of a piece)``."""

    real: FloatArray
    imag: FloatArray


class Moments(NamedTuple):
    """Real and imaginary parts of moments, ``(panel, order)``; the last is that with h."""

    real: FloatArray
    imag: FloatArray


class Lanes(NamedTuple):
    """Work space ``(node,)``: phases, cycles; values at nodes, and their factors per panel."""

    cycles: FloatArray
    real: FloatArray
    imag: FloatArray
    turn_real: FloatArray
    turn_imag: FloatArray


@compiled
def add_near_corners(
    samples: ComplexArray, tables: Tables, work: WorkTable, series: WindowSeries
) -> None:
    """Add the links of work units to ``samples`` (part, channel, ramp, fast), by their moments."""
    taps, columns = tables.taps, series.gain.shape[1]
    gain = series.gain.reshape(series.gain.size)
    for u in range(work.row.size):
        pair, response, start, count = unit_span(tables, work, u)
        step = tables.window.step
        first, num_panels = start - taps.half, count + series.num_steps
        batch = Batch(pair, response, taps, tables.links, work.low[u], work.high[u])
        fastest = _fastest_beat(batch, first, first + num_panels * step)
        if fastest < 0.0:
            continue
        highest = FAR_OFF * response.far if fastest > FASTEST * response.far else np.inf
        cycles = (min(fastest, highest) + taps.stopband) * step
        panels = Panels(first, step, num_panels, math.ceil(cycles / PIECE_CYCLES), highest)
        channels, shape = samples.shape[1], (num_panels, columns)
        real, imag = np.zeros((channels, *shape)), np.zeros((channels, *shape))
        for piece in range(panels.pieces):
            weight = np.zeros((NUM_PANEL_NODES, columns))
            _fill_weights(weight, panels, piece, series, taps)
            for m in range(channels):
                _add_links(Moments(real[m], imag[m]), weight, batch, m, panels, piece, series)
        for m in range(channels):
            x, y = real[m].reshape(num_panels * columns), imag[m].reshape(num_panels * columns)
            out = samples[work.part[u], m, work.row[u], work.begin[u] : work.end[u]]
            for n in range(count):
                window = slice(n * columns, n * columns + gain.size)
                out[n] += complex(np.dot(gain, x[window]), np.dot(gain, y[window]))
            if highest < np.inf:
                held = Samples(np.zeros(count), np.zeros(count), start, step)
                _add_far_parts(held, batch, m, highest)
                for n in range(count):
                    out[n] += complex(held.real[n], held.imag[n])


@inner
def _fastest_beat(batch: Batch, begin: float, end: float) -> float:
    """Greatest magnitude of all links' beats between two times, Hz; −1 if there is no chirp."""
    pair, links, fastest = batch.pair, batch.links, -1.0
    for p in range(batch.low, batch.high):
        for m in range(links.element_delay.shape[1]):
            chirp = received(pair, links, p, m)
            one, other = max(chirp.begin, begin), min(chirp.end, end)
            if other > one:
                fastest = max(fastest, abs(chirp.beat + chirp.rate * one))
                fastest = max(fastest, abs(chirp.beat + chirp.rate * other))
    return fastest


@inlined
def _near_part(chirp: Chirp, highest: float) -> Chirp:
    """The part of the chirp with beats up to ``highest``; without one it ends before it begins."""
    one, other = (-highest - chirp.beat) / chirp.rate, (highest - chirp.beat) / chirp.rate
    begin, end = max(chirp.begin, min(one, other)), min(chirp.end, max(one, other))
    return _part(chirp, begin, end)


@inlined
def _part(chirp: Chirp, begin: float, end: float) -> Chirp:
    """The chirp from ``begin`` to ``end``, of which nothing may be left out."""
    return Chirp(chirp.amplitude, 0.0, chirp.phase, chirp.beat, chirp.rate, begin, end)


@inner
def _add_far_parts(samples: Samples, batch: Batch, m: int, highest: float) -> None:
    """Add the parts of chirps with beats above ``highest``, link by link."""
    for p in range(batch.low, batch.high):
        if sent_amplitude(batch.pair, batch.links, p) != 0.0:
            chirp = received(batch.pair, batch.links, p, m)
            near = _near_part(chirp, highest)
            before = _part(chirp, chirp.begin, min(near.begin, chirp.end))
            after = _part(chirp, max(near.end, chirp.begin), chirp.end)
            for part in (before, after):
                if part.end > part.begin:
                    add_chirp(samples, batch.response, batch.taps, part)


@inner
def _add_links(
    moments: Moments, weight: FloatArray, batch: Batch, m: int, panels: Panels, piece: int,
    series: WindowSeries,
) -> None:  # fmt: skip
    """Add one piece of every panel, and with the first piece the panels that hold a corner."""
    pair, links, taps = batch.pair, batch.links, batch.taps
    sums = Sums(
        np.zeros((panels.number, NUM_PANEL_NODES)), np.zeros((panels.number, NUM_PANEL_NODES))
    )
    lanes = Lanes(
        np.empty(NUM_PANEL_NODES), np.empty(NUM_PANEL_NODES), np.empty(NUM_PANEL_NODES),
        np.empty(NUM_PANEL_NODES), np.empty(NUM_PANEL_NODES),
    )  # fmt: skip
    for p in range(batch.low, batch.high):
        if sent_amplitude(pair, links, p) == 0.0:
            continue
        chirp = _near_part(received(pair, links, p, m), panels.highest)
        # the panels from `begin` to before `end` lie within the chirp
        begin = math.ceil((chirp.begin - panels.first) / panels.step)
        end = math.floor((chirp.end - panels.first) / panels.step)
        begin = min(max(begin, 0), panels.number)
        end = min(max(end, begin), panels.number)
        for k in range(begin, end, LONGEST_RUN):
            _add_values(sums, chirp, k, min(k + LONGEST_RUN, end), panels, piece, series, lanes)
        if piece == 0 and begin > 0:
            _add_cut_panel(moments, chirp, begin - 1, panels, series, taps, lanes)
        if piece == 0 and end < panels.number:
            _add_cut_panel(moments, chirp, end, panels, series, taps, lanes)
    moments.real[:, :] += np.dot(sums.real, weight)
    moments.imag[:, :] += np.dot(sums.imag, weight)


@inlined
def _add_values(
    sums: Sums, chirp: Chirp, begin: int, end: int, panels: Panels, piece: int,
    series: WindowSeries, lanes: Lanes,
) -> None:  # fmt: skip
    """Add the chirp's values at the nodes of a piece of the panels ``begin:end``.

    From panel to panel, a node's value is multiplied by a factor, and the factor by another.
    """
    real, imag = sums
    cycles, zr, zi, wr, wi = lanes
    step, rate = panels.step, chirp.rate
    since = panels.first + begin * step
    for i in range(NUM_PANEL_NODES):
        time = since + step * ((piece + series.node[i]) / panels.pieces)
        cycles[i] = step * (chirp.beat + rate * (time + 0.5 * step))
    units(cycles, wr, wi)
    for i in range(NUM_PANEL_NODES):
        cycles[i] = phase_of(chirp, since + step * ((piece + series.node[i]) / panels.pieces))
    units(cycles, zr, zi)
    a, b = chirp.amplitude.real, chirp.amplitude.imag
    for i in range(NUM_PANEL_NODES):
        zr[i], zi[i] = zr[i] * a - zi[i] * b, zr[i] * b + zi[i] * a
    bend = unit(rate * step * step)
    p, q = bend.real, bend.imag
    for k in range(begin, end):
        for i in range(NUM_PANEL_NODES):
            x, y, c, s = zr[i], zi[i], wr[i], wi[i]
            real[k, i] += x
            imag[k, i] += y
            zr[i], zi[i] = x * c - y * s, x * s + y * c
            wr[i], wi[i] = c * p - s * q, c * q + s * p


@inner
def _add_cut_panel(
    moments: Moments, chirp: Chirp, k: int, panels: Panels, series: WindowSeries, taps: Taps,
    lanes: Lanes,
) -> None:  # fmt: skip
    """Add the part of panel k that lies within the chirp, on both sides of where a window ends."""
    begin = panels.first + k * panels.step
    low = max((chirp.begin - begin) / panels.step, 0.0)
    high = min((chirp.end - begin) / panels.step, 1.0)
    _add_part(moments, chirp, k, low, min(high, series.share), panels, series, taps, lanes)
    _add_part(moments, chirp, k, max(low, series.share), high, panels, series, taps, lanes)


@inner
def _add_part(
    moments: Moments, chirp: Chirp, k: int, low: float, high: float, panels: Panels,
    series: WindowSeries, taps: Taps, lanes: Lanes,
) -> None:  # fmt: skip
    """Add the chirp from ``low`` to ``high`` of panel k, in units of the panel."""
    if high <= low:
        return
    pieces = math.ceil(panels.pieces * (high - low))
    width = (high - low) / pieces
    orders = moments.real.shape[1] - 1
    cycles, real, imag, place, value = lanes
    before = np.empty(NUM_PANEL_NODES)
    for piece in range(pieces):
        for i in range(NUM_PANEL_NODES):
            place[i] = low + width * (piece + series.node[i])
            cycles[i] = phase_of(chirp, panels.first + panels.step * (k + place[i]))
        units(cycles, real, imag)
        x, y = 0.0, 0.0
        for i in range(NUM_PANEL_NODES):
            weight = panels.step * width * series.weight[i]
            z = weight * chirp.amplitude * complex(real[i], imag[i])
            real[i], imag[i] = z.real, z.imag
            if place[i] < series.share:
                height = _height_at_end(place[i], panels.step, series, taps)
                x += height * z.real
                y += height * z.imag
            place[i] = 2.0 * place[i] - 1.0
            before[i], value[i] = 0.0, 1.0
        moments.real[k, orders] += x
        moments.imag[k, orders] += y
        for j in range(orders):
            x, y = 0.0, 0.0
            rise, fall = (2 * j + 1) / (j + 1), j / (j + 1)
            for i in range(NUM_PANEL_NODES):
                x += value[i] * real[i]
                y += value[i] * imag[i]
                before[i], value[i] = value[i], rise * place[i] * value[i] - fall * before[i]
            moments.real[k, j] += x
            moments.imag[k, j] += y


@inlined
def _height_at_end(place: float, step: float, series: WindowSeries, taps: Taps) -> float:
    """The impulse response in the last panel of a window, of which ``place`` is the part before."""
    return tap(taps, max(taps.half - step * (series.num_steps + place), -taps.half))


@inner
def _fill_weights(
    weight: FloatArray, panels: Panels, piece: int, series: WindowSeries, taps: Taps
) -> None:
    """Weights that make moments of values at the nodes of a piece, ``(node, order)``."""
    orders, step, width = weight.shape[1] - 1, panels.step, 1.0 / panels.pieces
    row = np.empty(max(orders, NUM_PANEL_NODES))
    for i in range(NUM_PANEL_NODES):
        _legendre(row, (piece + series.node[i]) * width)
        for j in range(orders):
            weight[i, j] = step * width * series.weight[i] * row[j]
    # the part of the piece before the end of the window has nodes of its own, at which Lagrange's
    # polynomials give the values; they are written in Legendre's
    part = min(series.share * panels.pieces - piece, 1.0)
    if part <= 0.0:
        return
    here = np.empty((NUM_PANEL_NODES, NUM_PANEL_NODES))
    for i in range(NUM_PANEL_NODES):
        _legendre(here[i], series.node[i])
    for n in range(NUM_PANEL_NODES):
        place = part * series.node[n]
        height = _height_at_end((piece + place) * width, step, series, taps)
        height *= step * width * part * series.weight[n]
        _legendre(row, place)
        for i in range(NUM_PANEL_NODES):
            total = 0.0
            for j in range(NUM_PANEL_NODES):
                total += (2 * j + 1) * here[i, j] * row[j]
            weight[i, orders] += height * series.weight[i] * total


@inlined
def _legendre(out: FloatArray, place: float) -> None:
    """Legendre's polynomials at ``place`` from 0 to 1."""
    x = 2.0 * place - 1.0
    last, value = 0.0, 1.0
    for j in range(out.size):
        out[j] = value
        last, value = value, ((2 * j + 1) * x * value - j * last) / (j + 1)
