r"""Samples of many links at once, with a common quadratic phase, gain and Fourier transform.

For one pair of ramps, link p and channel m have the amplitude :math:`c_{pm}`, the beat's rate
:math:`\mu_p` and, at t = 0 near the middle of the samples, the beat :math:`f_{pm}`; G is the IF
filter's gain (`chirp_response`). With one frequency :math:`\nu_p` of a link for all channels, and
the mean rate :math:`\bar\mu` of all links,

.. math:: y_m(t) = e^{j\pi\bar\mu t^2} \sum_p e^{j2\pi\nu_p t}\; c_{pm}
    e^{j2\pi(f_{pm}-\nu_p)t + j\pi(\mu_p-\bar\mu)t^2}\, G(f_{pm} + \mu_p t; \mu_p)

If the product of the factors after :math:`e^{j2\pi\nu_p t}` changes little, it is a polynomial of
low degree in t. Its values at a few Chebyshev nodes are the weights of one sum of tones (`nufft`)
per node. If the beats sweep through the band, G changes much; zones of few samples have the sum

.. math:: e^{j2\pi d t}\, G(\bar f + \bar\mu t + d; \bar\mu) = \sum_r g_r(t)\, T_r(d/w)

of Chebyshev polynomials of d, the beat's distance from the middle beat :math:`\bar f`, with
:math:`|d| \le w`; links are summed before samples are computed. A rate that differs by δ from the
mean is a factor :math:`e^{j\pi\delta t^2}` before the filter. In its power series, :math:`t^2` is a
second derivative by d, so that the same :math:`g_r` apply, with one sum over links per power of δ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.synthesis.stretch.kernel_records import (
    EXPANSION_TOLERANCE,
    Batch,
    BeatExpansion,
    Response,
    Tables,
    ramp_pair,
    response_of,
)
from polychirp.synthesis.stretch.nufft import GriddedTones, MakeTones
from polychirp.synthesis.stretch.work_units import WorkUnit

MOST_TIME_NODES: Final = 24
"""Most nodes in time for which sums of tones are used (chosen)."""

MOST_RATE_ORDERS: Final = 6
"""Most powers of δ, the power 0 included, for which the expansion in d is used (chosen)."""

MOST_NODES: Final = 48
"""Most nodes that `num_nodes` counts; a function that needs as many may need more (chosen)."""

MOST_DETUNING: Final = 5e-4
"""Largest π|μ − μ̄|S²/4, rad, of the links of a batch; S is the length of the filter's window. G is
then linear in the rate. The error of a linear G is half the square of this number, times the fourth
moment of the filter's taps in units of (S/2)⁴, which is at most 1e-2."""

WEIGHTS_PER_BLOCK: Final = 1 << 16
"""Most complex weights of tones that are held at once: 1 MiB (chosen)."""

FEWEST_LINKS: Final = 24
"""Fewest links of a unit for a batch. Smaller batches do not repay their fixed cost (chosen)."""

ZONE_SIZES: Final = (16, 32, 64, 128, 256)
"""Numbers of samples that a zone may have (chosen); the one with the least CPU time is taken."""

SECONDS_PER_SAMPLE: Final = (2e-9, 1.2e-8)
"""CPU time per link, channel and sample, s, where links are added one by one (on Zen 4): for beats
that stay in the band, and for beats that cross it."""

SECONDS_PER_CORNER: Final = 1.5e-6
"""CPU time per link, channel and ramp end in windows, s, of links added one by one (on Zen 4)."""


def batch_of(unit: WorkUnit, tables: Tables) -> Batch:
    """Arguments of the batch kernels for a unit."""
    pair = ramp_pair(tables.own, unit.ramp, tables.sent, unit.sent, tables.links)
    response = response_of(tables.pairs, unit.pair)
    return Batch(pair, response, tables.taps, tables.links, unit.low, unit.high)


def batched_samples(
    unit: WorkUnit, batch: Batch, make_tones: MakeTones = GriddedTones
) -> list[tuple[slice, ComplexArray]] | None:
    """Runs of the samples ``unit.whole``, and the links' sum ``(channel, sample)`` of each run.

    Windows of these samples lie within every link's chirp. The error is below ``unit.limit`` times
    the root of the links' power. None: links one by one cost less, or exceed `MOST_DETUNING`.
    """
    if math.pi * batch.response.spread * batch.taps.half**2 > MOST_DETUNING:
        return None
    beats = beats_at(unit, batch, (unit.whole.start + unit.whole.stop) // 2)
    part = _in_reach(unit, batch, beats)
    count = part.stop - part.start
    if not count:
        return []
    nodes = _num_time_nodes(unit, batch, beats, part)
    slow_cost = _slow_cost(unit, batch, nodes, count)
    crossing_cost, zone = _cheapest_zone(unit, batch, beats, part)
    cuts = sum(run.stop > run.start for run in (unit.cut_by_begin, unit.cut_by_end))
    each = SECONDS_PER_SAMPLE[nodes > MOST_TIME_NODES] * count + SECONDS_PER_CORNER * cuts
    if unit.num_links * num_channels(batch) * each < min(slow_cost, crossing_cost):
        return None
    if slow_cost <= crossing_cost:
        return [(part, _slow_samples(unit, batch, part, nodes, make_tones))]
    zones = range(part.start, part.stop, zone)
    runs = [slice(low, min(low + zone, part.stop)) for low in zones]
    return [(run, swept_samples(unit, batch, beats, run)) for run in runs]


def num_channels(batch: Batch) -> int:
    """Number of the victim's channels."""
    return int(batch.links.element_delay.shape[1])


def _num_time_nodes(unit: WorkUnit, batch: Batch, beats: Beats, part: slice) -> int:
    """Number of nodes in time; more than `MOST_TIME_NODES` if sums of tones cannot be used."""
    count = part.stop - part.start
    beats = beats.at(unit.first + (part.start + count // 2) * unit.step)
    time = half_time(count, unit.step)
    fastest = abs(beats.rate) + beats.spread
    turn = math.tau * time * (beats.apart + batch.taps.half * fastest)
    is_in_table = _in_table(batch.response, abs(beats.centre) + beats.width + fastest * time)
    if turn >= MOST_TIME_NODES or not is_in_table:
        return MOST_TIME_NODES + 1
    return num_nodes(turn, math.pi * beats.spread * time**2)


def _slow_cost(unit: WorkUnit, batch: Batch, nodes: int, count: int) -> float:
    """CPU time of sums of tones, s (about, measured on Zen 4)."""
    if nodes > MOST_TIME_NODES:
        return math.inf
    return 2e-4 + num_channels(batch) * nodes * (20e-9 * count + 4e-9 * unit.num_links)


def _slow_samples(
    unit: WorkUnit, batch: Batch, part: slice, nodes: int, make_tones: MakeTones
) -> ComplexArray:
    """The samples ``part`` by sums of tones, ``(channel, sample)``."""
    from polychirp.synthesis.stretch.batch_kernels import slow_weights

    count, channels = part.stop - part.start, num_channels(batch)
    columns = channels * nodes
    beats = beats_at(unit, batch, part.start + count // 2)
    node, basis = _time_basis(count, nodes, unit.step)
    tones = make_tones(count, columns)
    block = max(16, WEIGHTS_PER_BLOCK // columns)
    for low in range(unit.low, unit.high, block):
        some = slice(low - unit.low, min(low + block, unit.high) - unit.low)
        frequency = beats.frequency[some]
        weight = np.empty((frequency.size, columns), dtype=np.complex128)
        numbers = weight.view(np.float64)
        slow_weights(numbers, batch, low, beats.time, frequency, beats.apart, node)
        tones.add(frequency * unit.step, weight)
    wave = tones.sums().reshape(count, channels, nodes)
    return _joined(wave, basis, batch.response.rate, unit.step)


def _cheapest_zone(unit: WorkUnit, batch: Batch, beats: Beats, part: slice) -> tuple[float, int]:
    """Least CPU time over all zone sizes, s (about, on Zen 4), and that zone size in samples."""
    count, spread = part.stop - part.start, batch.response.spread
    width = beats.at(unit.first + part.start * unit.step).width
    choices = []
    for zone in sorted({min(zone, count) for zone in ZONE_SIZES}):
        time = batch.taps.half + half_time(zone, unit.step)
        terms, orders = num_terms(time, width), num_orders(math.pi * spread * time**2)
        per_link = num_channels(batch) * (8e-9 + 2e-10 * terms * (1 + orders))
        per_zone = 8e-5 + unit.num_links * per_link + 6e-8 * terms * zone
        cost = -(-count // zone) * per_zone if orders <= MOST_RATE_ORDERS else math.inf
        choices.append((cost, zone))
    return min(choices)


def swept_samples(
    unit: WorkUnit, batch: Batch, beats: Beats, run: slice, *, side: int = 0
) -> ComplexArray:
    """Samples of one run by an expansion in the beat, ``(channel, sample)``.

    ``side`` is the edge of the filter's window that lies within the chirps: 1 is S/2 before the
    sample, −1 is S/2 after it, 0 is both.
    """
    from polychirp.synthesis.stretch.batch_kernels import crossing_samples

    count, half = run.stop - run.start, batch.taps.half
    beats = beats.at(unit.first + (run.start + count // 2) * unit.step)
    # in a narrower range of beats, derivatives by the beat would lose digits
    width = max(beats.width, 1.0 / (math.tau * (half + half_time(count, unit.step))))
    terms = num_terms(half + count // 2 * unit.step, width)
    expansion = BeatExpansion(beats.time, beats.centre, width, *chebyshev(terms))
    out = np.zeros((num_channels(batch), count), dtype=np.complex128)
    crossing_samples(out, batch, expansion, unit.step, side, 0.05 * unit.limit)
    return out


def num_orders(bend: float) -> int:
    """Terms of exp(ju) for |u| ≤ ``bend``: the first omitted one is below `EXPANSION_TOLERANCE`.

    >>> num_orders(0.0), num_orders(1e-3)
    (1, 3)
    """
    order, size = 1, bend
    while size > EXPANSION_TOLERANCE and order <= MOST_RATE_ORDERS:
        order += 1
        size *= bend / order
    return order


def _joined(wave: ComplexArray, basis: FloatArray, rate: float, step: float) -> ComplexArray:
    """Sum of ``wave`` times ``basis`` over nodes, times the mean chirp, ``(channel, sample)``."""
    count = len(wave)
    time = (np.arange(count) - count // 2) * step
    y = np.einsum("nmq,nq->mn", wave, basis)
    return np.asarray(y * np.exp(1j * np.pi * rate * time**2))


def half_time(count: int, step: float) -> float:
    """Half the time of ``count`` + 1 steps, s: no sample is further from sample ``count // 2``."""
    return 0.5 * (count + 1) * step


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Beats:
    """Beats of a unit's links, Hz, at the time ``time``, s: all are within ``width`` of ``centre``.

    A channel's beat differs from its link's ``frequency`` by ``apart`` at most. ``rate`` is the
    mean rate, Hz/s, from which the links' rates differ by ``spread`` at most.
    """

    time: float
    frequency: FloatArray
    centre: float
    width: float
    apart: float
    rate: float
    spread: float

    def at(self, time: float) -> Beats:
        """Beats at another time; ``frequency`` keeps the values of the old time."""
        later = time - self.time
        return replace(
            self,
            time=time,
            centre=self.centre + self.rate * later,
            width=self.width + self.spread * abs(later),
        )


def beats_at(unit: WorkUnit, batch: Batch, sample: int) -> Beats:
    """Beats of the unit's links at one sample of its row."""
    from polychirp.synthesis.stretch.batch_kernels import find_beats

    time = unit.first + sample * unit.step
    frequency = np.empty(unit.num_links)
    found = find_beats(batch, time, frequency)
    return Beats(
        time=time,
        frequency=frequency,
        centre=0.5 * (found.least + found.greatest),
        width=max(0.5 * (found.greatest - found.least), 1e-3),
        apart=found.apart,
        rate=batch.response.rate,
        spread=batch.response.spread,
    )


def _in_reach(unit: WorkUnit, batch: Batch, beats: Beats) -> slice:
    """Samples of ``unit.whole`` at which the gain of some link may be above ``unit.limit``."""
    time = unit.first - beats.time + unit.step * np.arange(unit.whole.start, unit.whole.stop)
    far = np.abs(beats.centre + beats.rate * time) - beats.width - beats.spread * np.abs(time)
    near = np.flatnonzero(far <= _reach(batch, unit.limit))
    if not near.size:
        return slice(0, 0)
    return slice(unit.whole.start + int(near[0]), unit.whole.start + int(near[-1]) + 1)


def _reach(batch: Batch, limit: float) -> float:
    """Beat above which no gain is above ``limit``, Hz."""
    response, taps = batch.response, batch.taps
    if response.envelope.size and response.envelope[-1] < limit:
        # the envelope falls: search its negative
        first = int(np.searchsorted(-response.envelope, -limit, side="right"))
        return max(first - 4, 0) * response.step
    edge = 2.0 * taps.edge / (math.tau * limit) if limit > 0.0 else math.inf
    return max(edge, response.far) + taps.half * abs(response.rate)


def _in_table(response: Response, beat: float) -> bool:
    size = response.envelope.size
    return size > 0 and beat <= (size - 10) * response.step


@lru_cache(maxsize=64)
def chebyshev(count: int) -> tuple[FloatArray, FloatArray]:
    """Chebyshev nodes, and the matrix from values at nodes to coefficients."""
    angle = np.pi * (np.arange(count) + 0.5) / count
    to_terms = (2.0 / count) * np.cos(np.arange(count)[:, None] * angle)
    to_terms[0] *= 0.5
    return np.cos(angle), to_terms


@lru_cache(maxsize=256)
def num_nodes(turn: float, bend: float) -> int:
    """Number of nodes for exp(j(``turn`` u + ``bend`` u²)), |u| ≤ 1, to `EXPANSION_TOLERANCE`.

    From `MOST_NODES` on, the tolerance is not kept.

    >>> num_nodes(0.0, 0.0), num_nodes(0.01, 0.4)
    (2, 13)
    """
    node, to_terms = chebyshev(MOST_NODES)
    size = np.abs(to_terms @ np.exp(1j * node * (turn + bend * node)))
    beyond = np.cumsum(size[::-1])[::-1]
    return max(2, int(np.count_nonzero(beyond > 0.5 * EXPANSION_TOLERANCE)))


def num_terms(half: float, width: float) -> int:
    """Number of Chebyshev terms for exp(j2π ``half`` f), |f| ≤ ``width`` Hz, with ``half`` in s.

    The coefficients are Bessel functions of x = 2π ``half`` ``width``, which fall beyond the order
    x within a few times its cube root (https://dlmf.nist.gov/10.19.iii).
    """
    turn = math.tau * half * width
    return math.ceil(turn + max(16.0, 6.0 * math.cbrt(turn)))


def _time_basis(count: int, nodes: int, step: float) -> tuple[FloatArray, FloatArray]:
    """Nodes, s from sample ``count // 2``, and their polynomials' values ``(sample, node)``."""
    node, to_terms = chebyshev(nodes)
    time = half_time(count, step)
    place = (np.arange(count) - count // 2) * (step / time)
    return node * time, np.polynomial.chebyshev.chebvander(place, nodes - 1) @ to_terms
