r"""Many paths at once: beats that are alike share quadratic phase, gain and Fourier transform.

For one pair of ramps, path p and channel m give the beat :math:`f_{pm}` at a time near the middle
of the samples, from where t counts, and the rate :math:`\mu_p`. With one frequency
:math:`\nu_p` for all channels and the mean rate :math:`\bar\mu`,

.. math:: y_m(t) = e^{j\pi\bar\mu t^2} \sum_p e^{j2\pi\nu_p t}\; c_{pm}
    e^{j2\pi(f_{pm}-\nu_p)t + j\pi(\mu_p-\bar\mu)t^2}\, G(f_{pm} + \mu_p t; \mu_p)

What follows :math:`e^{j2\pi\nu_p t}` changes little: it is a polynomial of low degree in t, given
by its values at a few Chebyshev nodes, which are the weights of as many columns of a sum of tones
(`tones`). Where the beats sweep through the band, G does not change little. There, in zones of few
samples,

.. math:: e^{j2\pi d t}\, G(\bar f + \bar\mu t + d; \bar\mu) = \sum_r g_r(t)\, T_r(d/w)

in Chebyshev's polynomials of the beat's distance d from the middle beat: paths are summed before
samples are made. A rate that is off the mean by δ is a factor :math:`e^{j\pi\delta t^2}` in front
of the filter; its powers are second derivatives by d, so that the same :math:`g_r` give them too,
each with sums of its own, weighted with powers of δ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.synthesis.stretch.nufft import GriddedTones, MakeTones

if TYPE_CHECKING:
    from polychirp.synthesis.stretch.kernel_tables import Tables
    from polychirp.synthesis.stretch.work_units import Visit

TOLERANCE: Final = 3e-9
"""Of every expansion, relative to the greatest that it stands for."""

MOST_NODES: Final = 24
"""Nodes in time; a pair of ramps that needs more is added path by path."""

MOST_ORDERS: Final = 6
"""Powers of the rates' distances from their mean."""

PATHS: Final = 1 << 15
"""Paths times terms of one channel that are held at once."""

MOST_DETUNING: Final = 5e-4
"""π(μ − μ̄)S²/4: half its square, times the taps' fourth moment in units of (S/2)⁴ (1e-2 and less),
is what the linear change of G with the rate leaves out."""

WEIGHTS: Final = 1 << 16
"""Weights, complex numbers, that are held at once."""

FEWEST: Final = 24
"""Paths, below which nothing is tried."""

ZONES: Final = (16, 32, 64, 128, 256)
"""Samples that share an expansion in the beat: the cheapest is taken."""

PER_SAMPLE: Final = (2e-9, 1.2e-8)
"""s per path, channel and sample, path by path: within the band and crossing it (Zen 4)."""

PER_CORNER: Final = 1.5e-6
"""S per path, channel and corner of a ramp that windows meet, path by path (Zen 4)."""

TAU: Final = 2.0 * math.pi


def bundled(
    visit: Visit, tables: Tables, make_tones: MakeTones = GriddedTones
) -> list[tuple[slice, ComplexArray]] | None:
    """Samples that the lines make together: runs of them, and ``(channel, sample)`` of each.

    Every window of ``visit.whole`` lies within every line's chirp. What is left out is below
    ``visit.limit`` times the root of the lines' power. None where path by path is cheaper.
    """
    spread = float(tables.pairs.spread[visit.pair])
    if visit.num_lines < FEWEST or math.pi * spread * tables.taps.half**2 > MOST_DETUNING:
        return None
    tuned = tune(visit, tables, (visit.whole.start + visit.whole.stop) // 2)
    part = _in_reach(visit, tables, tuned)
    count = part.stop - part.start
    if not count:
        return []
    slow = _slow(visit, tables, tuned, part)
    crossing = _crossing(visit, tables, tuned, part)
    cuts = sum(run.stop > run.start for run in (visit.cut_by_begin, visit.cut_by_end))
    each = PER_SAMPLE[slow.nodes > MOST_NODES] * count + PER_CORNER * cuts
    if visit.num_lines * slow.channels * each < min(slow.cost, crossing.cost):
        return None
    if slow.cost <= crossing.cost:
        return [(part, slow.samples(make_tones))]
    zones = range(part.start, part.stop, crossing.zone)
    runs = [slice(low, min(low + crossing.zone, part.stop)) for low in zones]
    return [(run, crossing.samples(run)) for run in runs]


# ── beats that change little ──────────────────────────────────────────────────────────────────


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Slow:
    """Sums of tones with ``nodes`` in time; more than `MOST_NODES` where it does not converge."""

    visit: Visit
    tables: Tables
    tuned: Tuning
    count: int
    channels: int
    nodes: int

    @property
    def cost(self) -> float:
        """S of CPU time, about (measured on Zen 4)."""
        if self.nodes > MOST_NODES:
            return math.inf
        columns = self.channels * self.nodes
        return 2e-4 + columns * (20e-9 * self.count + 4e-9 * self.visit.num_lines)

    def samples(self, make_tones: MakeTones) -> ComplexArray:
        from polychirp.synthesis.stretch.batch_kernels import slow_weights

        visit, t, tuned = self.visit, self.tables, self.tuned
        columns = self.channels * self.nodes
        node, basis = _time_basis(self.count, self.nodes, visit.step)
        tones = make_tones(self.count, columns)
        block = max(16, WEIGHTS // columns)
        for low in range(visit.low, visit.high, block):
            some = slice(low - visit.low, min(low + block, visit.high) - visit.low)
            frequency = tuned.frequency[some]
            weight = np.empty((frequency.size, columns), dtype=np.complex128)
            slow_weights(
                weight.view(np.float64), t.own, visit.ramp, t.sent, t.pairs, visit.pair, t.taps,
                t.lines, low, tuned.middle, frequency, tuned.apart, node,
            )  # fmt: skip
            tones.add(frequency * visit.step, weight)
        wave = tones.sums().reshape(self.count, self.channels, self.nodes)
        return _joined(wave, basis, t.pairs.rate[visit.pair], visit.step)


def _slow(visit: Visit, tables: Tables, tuned: Tuning, part: slice) -> _Slow:
    count = part.stop - part.start
    middle = part.start + count // 2
    tuned = tuned.at(visit.first + middle * visit.step)
    time = half_time(count, visit.step)
    fastest = abs(tuned.rate) + tuned.spread
    turn = TAU * time * (tuned.apart + tables.taps.half * fastest)
    nodes = MOST_NODES + 1
    is_in_table = _in_table(tables, visit.pair, abs(tuned.centre) + tuned.width + fastest * time)
    if turn < MOST_NODES and is_in_table:
        tuned = tune(visit, tables, middle)
        nodes = num_nodes(turn, math.pi * tuned.spread * time**2)
    channels = tables.lines.element_delay.shape[1]
    return _Slow(
        visit=visit, tables=tables, tuned=tuned, count=count, channels=channels, nodes=nodes
    )


# ── beats that sweep ──────────────────────────────────────────────────────────────────────────


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Crossing:
    """Zones of ``zone`` samples, each with ``terms`` in the beat and ``orders`` in the rate.

    ``side`` is the edge of the filter's window that is within the chirps, 1 for the upper one, −1
    for the lower; 0 is both.
    """

    visit: Visit
    tables: Tables
    tuned: Tuning
    count: int
    zone: int
    terms: int
    orders: int
    side: int = 0

    @property
    def cost(self) -> float:
        """S of CPU time, about (measured on Zen 4)."""
        if self.orders > MOST_ORDERS:
            return math.inf
        zones = -(-self.count // self.zone)
        channels = self.tables.lines.element_delay.shape[1]
        per_line = channels * (8e-9 + 2e-10 * self.terms * (1 + self.orders))
        per_zone = 8e-5 + self.visit.num_lines * per_line + 6e-8 * self.terms * self.zone
        return float(zones * per_zone)

    def samples(self, run: slice) -> ComplexArray:
        """Those of one run, ``(channel, sample)``."""
        from polychirp.synthesis.stretch.batch_kernels import crossing_samples

        visit, t = self.visit, self.tables
        count = run.stop - run.start
        tuned = self.tuned.at(visit.first + (run.start + count // 2) * visit.step)
        # in a narrower range, derivatives by the beat would lose digits
        reach = t.taps.half + half_time(count, visit.step)
        tuned.width = max(tuned.width, 1.0 / (TAU * reach))
        node, to_terms = cosines(num_terms(t.taps.half + count // 2 * visit.step, tuned.width))
        out = np.zeros((t.lines.element_delay.shape[1], count), dtype=np.complex128)
        crossing_samples(
            out, t.own, visit.ramp, t.sent, t.pairs, visit.pair, t.taps, t.lines, visit.low,
            visit.high, tuned.middle, tuned.centre, tuned.width, node, to_terms, visit.step,
            self.side, TOLERANCE, 0.05 * visit.limit, PATHS,
        )  # fmt: skip
        return out


def _crossing(visit: Visit, tables: Tables, tuned: Tuning, part: slice) -> Crossing:
    """The zones that cost least."""
    choices = []
    for zone in sorted({min(zone, part.stop - part.start) for zone in ZONES}):
        time = tables.taps.half + half_time(zone, visit.step)
        width = tuned.at(visit.first + part.start * visit.step).width
        choices.append(
            Crossing(
                visit=visit,
                tables=tables,
                tuned=tuned,
                count=part.stop - part.start,
                zone=zone,
                terms=num_terms(time, width),
                orders=num_orders(math.pi * float(tables.pairs.spread[visit.pair]) * time**2),
            )
        )
    return min(choices, key=lambda choice: choice.cost)


def num_orders(bend: float) -> int:
    """Orders for exp(ju), |u| up to ``bend``: the first one left out is below `TOLERANCE`.

    >>> num_orders(0.0), num_orders(1e-3)
    (1, 3)
    """
    order, size = 1, bend
    while size > TOLERANCE and order <= MOST_ORDERS:
        order += 1
        size *= bend / order
    return order


# ── what both have in common ──────────────────────────────────────────────────────────────────


def _joined(wave: ComplexArray, basis: FloatArray, rate: float, step: float) -> ComplexArray:
    """(channel, sample) of (sample, channel, node), with the mean chirp."""
    count = len(wave)
    time = (np.arange(count) - count // 2) * step
    y = np.einsum("nmq,nq->mn", wave, basis)
    return np.asarray(y * np.exp(1j * np.pi * rate * time**2))


def half_time(count: int, step: float) -> float:
    """S, that ``count`` samples reach to each side of their middle, and a little more."""
    return 0.5 * (count + 1) * step


@dataclass(slots=True, kw_only=True, eq=False)
class Tuning:
    """Beats at the time ``middle``: of every line, and Hz around their middle.

    ``apart`` is the most that a channel's differs from its line's; ``rate`` and ``spread`` are
    those of the pair.
    """

    middle: float
    frequency: FloatArray
    centre: float
    width: float
    apart: float
    rate: float
    spread: float

    def at(self, time: float) -> Tuning:
        """At another time, with the lines' frequencies as they are."""
        later = time - self.middle
        return Tuning(
            middle=time,
            frequency=self.frequency,
            centre=self.centre + self.rate * later,
            width=self.width + self.spread * abs(later),
            apart=self.apart,
            rate=self.rate,
            spread=self.spread,
        )


def tune(visit: Visit, tables: Tables, sample: int) -> Tuning:
    """Beats of the visit's lines at one sample of its row."""
    from polychirp.synthesis.stretch.batch_kernels import tune

    middle = visit.first + sample * visit.step
    frequency = np.empty(visit.num_lines)
    least, greatest, apart = tune(
        tables.own, visit.ramp, tables.sent, visit.sent, tables.lines, visit.low, visit.high,
        middle, frequency,
    ).tolist()  # fmt: skip
    return Tuning(
        middle=middle,
        frequency=frequency,
        centre=0.5 * (least + greatest),
        width=max(0.5 * (greatest - least), 1e-3),
        apart=apart,
        rate=float(tables.pairs.rate[visit.pair]),
        spread=float(tables.pairs.spread[visit.pair]),
    )


def _in_reach(visit: Visit, tables: Tables, tuned: Tuning) -> slice:
    """Samples at which the gain of some line may be above the limit, counted in the row."""
    time = visit.first - tuned.middle + visit.step * np.arange(visit.whole.start, visit.whole.stop)
    far = np.abs(tuned.centre + tuned.rate * time) - tuned.width - tuned.spread * np.abs(time)
    near = np.flatnonzero(far <= _reach(tables, visit.pair, visit.limit))
    if not near.size:
        return slice(0, 0)
    return slice(visit.whole.start + int(near[0]), visit.whole.start + int(near[-1]) + 1)


def _reach(tables: Tables, pair: int, limit: float) -> float:
    """Hz, the beat from which on nothing is above ``limit``."""
    pairs, taps = tables.pairs, tables.taps
    begin, end = int(pairs.begin[pair]), int(pairs.end[pair])
    if end > begin and pairs.envelope[end - 1] < limit:
        # the envelope falls
        first = int(np.searchsorted(-pairs.envelope[begin:end], -limit, side="right"))
        return max(first - 4, 0) * pairs.step
    edge = 2.0 * taps.edge / (TAU * limit) if limit > 0.0 else math.inf
    return max(edge, float(pairs.far[pair])) + taps.half * abs(float(pairs.rate[pair]))


def _in_table(tables: Tables, pair: int, beat: float) -> bool:
    size = int(tables.pairs.end[pair] - tables.pairs.begin[pair])
    return size > 0 and beat <= (size - 10) * tables.pairs.step


@lru_cache(maxsize=64)
def cosines(count: int) -> tuple[FloatArray, FloatArray]:
    """Chebyshev's nodes, and what makes coefficients of values at them."""
    angle = np.pi * (np.arange(count) + 0.5) / count
    to_terms = (2.0 / count) * np.cos(np.arange(count)[:, None] * angle)
    to_terms[0] *= 0.5
    return np.cos(angle), to_terms


@lru_cache(maxsize=256)
def num_nodes(turn: float, bend: float) -> int:
    """Nodes for exp(j(a u + b u²)) over |u| ≤ 1: what is beyond them is below `TOLERANCE`.

    >>> num_nodes(0.0, 0.0), num_nodes(0.01, 0.4)
    (2, 13)
    """
    node, to_terms = cosines(2 * MOST_NODES)
    size = np.abs(to_terms @ np.exp(1j * node * (turn + bend * node)))
    beyond = np.cumsum(size[::-1])[::-1]
    return max(2, int(np.count_nonzero(beyond > 0.5 * TOLERANCE)))


def num_terms(half: float, width: float) -> int:
    """Terms for what turns by ``half`` s times the beat, within ``width`` Hz."""
    return math.ceil(TAU * half * width) + 16


def _time_basis(count: int, nodes: int, step: float) -> tuple[FloatArray, FloatArray]:
    """Nodes in s about the middle sample, and their polynomials there, ``(sample, node)``."""
    node, to_terms = cosines(nodes)
    time = half_time(count, step)
    place = (np.arange(count) - count // 2) * (step / time)
    return node * time, np.polynomial.chebyshev.chebvander(place, nodes - 1) @ to_terms
