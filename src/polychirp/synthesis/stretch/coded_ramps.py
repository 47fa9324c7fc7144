r"""Ramps with a code: dechirped samples of a transmitter whose signal has chips within its ramps.

On link p the mixer's output is a chirp (`path_kernels.received`) times the conjugate chip
:math:`\bar a_m` that was sent one delay earlier. A sample is the sum over the chips

.. math:: \sum_m \bar a_m \int_{t_m}^{t_{m+1}} h(t - s)\,
          e^{j2\pi(\varphi + f s + \frac12\mu s^2)}\,ds

with the instants :math:`t_m` at which chips arrive. Two kernels compute it:

- Where the beat is nearly constant, as of a radar's own echoes, each chip is the difference of two
  values of the integral :math:`E(x) = \int_{-S/2}^x h(s)\,e^{-j2\pi f s}\,ds`, which is tabulated
  once for all links at a few beats f (`steady_code_kernels`).
- Elsewhere the chips are integrated in panels by Filon's rule (`swept_code_kernels`): between nodes
  h is a polynomial, and the integrals of polynomials times the beat are exact, however fast it is.

Both are right to 1e-7 of the strongest samples. A delay's acceleration bends the chirp as in
`path_kernels.beat_of`; what `slow_changes` would add, below 1e-8 on a ramp of 30 µs, is left out.
An amplitude's drift is that at the sample's time.
"""

import math
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.synthesis.stretch.kernel_records import (
    Chips,
    CodedRamps,
    CodeTable,
    CodeWork,
    LinkTable,
    SweptRule,
)
from polychirp.synthesis.stretch.ramp_overlaps import sent_during

STEADY_TURN: Final = 2e-4
"""Greatest change of the beat over a ramp's samples, in units of 1/S, that counts as steady.
Chosen: the table's linear change over the ramp then has an error of 1e-8."""

ENTRIES_PER_CYCLE: Final = 64
"""Entries of the table of E per cycle of the highest frequency in it; chosen: its cubic is right to
1e-8."""

BEAT_TOLERANCE: Final = 1e-9
"""Error of the table's polynomial in the beat, relative to the pass band; chosen."""

CELL_SHARE: Final = 0.1
"""Greatest duration of a cell of the swept rule, in periods of the filter's stop edge. Chosen: with
`CELL_NODES` nodes the error is 4e-8 of the cell's greatest contribution."""

CELL_NODES: Final = 6
"""Nodes of a cell; chosen together with `CELL_SHARE`."""

PANEL_SHARE: Final = 0.25
"""Greatest duration of a panel, in periods of the stop edge; with `PANEL_NODES` nodes the error is
3e-8. Chosen."""

PANEL_NODES: Final = 8
"""Nodes of a panel, by which h is interpolated over its cells; chosen together with
`PANEL_SHARE`."""

INAUDIBLE_SHARE: Final = 1e-3
"""Greatest rms of all links of another radar that are left out, over the victim's rms noise. Chosen
as for signals out of band (`engine.NEGLIGIBLE_OUT_OF_BAND`)."""


def add_coded(
    samples: ComplexArray,
    radar: Radar,
    own: RampSchedule,
    sent: RampSchedule,
    tables: CodedRamps,
    *,
    is_own: bool,
) -> None:
    """Add all links of a coded schedule to ``samples``, V ``(part, channel, ramp, fast)``.

    Of another radar, the weakest links are left out, whose rms
    together is below `INAUDIBLE_SHARE` of the noise.
    """
    from polychirp.synthesis.stretch.steady_code_kernels import add_steady_code, beat_extremes
    from polychirp.synthesis.stretch.swept_code_kernels import add_swept_code

    work = _work(own, sent, tables)
    if not work.row.size:
        return
    chips = _chips(sent)
    if not is_own:
        tables = tables._replace(links=_audible(radar, sent, tables.links))
    least, greatest, steepest = beat_extremes(tables, work)
    turn = steepest * float(own.duration.max()) * radar.if_filter.support
    if turn <= STEADY_TURN:
        code_table = _code_table(radar.if_filter, least, greatest)
        add_steady_code(samples, tables, work, chips, code_table)
    else:
        rule = _swept_rule(radar.if_filter, float(np.min(chips.duration)), steepest)
        add_swept_code(samples, tables, work, chips, rule)


def _work(own: RampSchedule, sent: RampSchedule, tables: CodedRamps) -> CodeWork:
    """Rows of samples, with each ramp of the victim and sent ramp that their windows may meet."""
    half, window, ramps = tables.taps.half, tables.window, tables.own
    first = ramps.start + window.first - half
    last = ramps.start + window.first + (window.num_samples - 1) * window.step + half
    low = np.searchsorted(ramps.start + ramps.duration, first)
    high = np.searchsorted(ramps.start, last)
    arriving = [sent_during(own, sent, tables.links, k) for k in range(own.num_ramps)]
    rows = [
        (row, ramp, other)
        for row in range(own.num_ramps)
        for ramp in range(int(low[row]), int(high[row]))
        for other in arriving[ramp]
    ]
    return CodeWork(*np.array(rows, dtype=np.int64).reshape(-1, 3).T.copy())


def _chips(sent: RampSchedule) -> Chips:
    """The code of the sent ramps; the mixer conjugates the received signal."""
    code = sent.code
    assert code is not None
    return Chips(
        value=np.ascontiguousarray(np.conj(code.value)),
        row=np.array(code.row),
        duration=np.array(code.chip_duration),
    )


def _audible(radar: Radar, sent: RampSchedule, links: LinkTable) -> LinkTable:
    r"""The links with amplitude 0 for the weakest of them.

    The estimate of a link's rms is that of random chips of the duration :math:`T_c` whose spectrum
    is flat over the filter's noise bandwidth B: :math:`|a|\sqrt{\min(T_c B, 1)}`.
    """
    code = sent.code
    assert code is not None
    share = min(float(np.max(code.chip_duration)) * radar.if_filter.noise_bandwidth, 1.0)
    noise = noise_density(radar) * radar.if_filter.noise_bandwidth
    amplitude = links.amplitude.copy()
    for low, high in zip(links.start[:-1], links.start[1:], strict=True):
        power = share * np.abs(amplitude[low:high]) ** 2
        order = np.argsort(power, kind="stable")
        together = np.cumsum(power[order])
        count = int(np.searchsorted(together, INAUDIBLE_SHARE**2 * noise, side="right"))
        amplitude[low:high][order[:count]] = 0.0
    return links._replace(amplitude=amplitude)


def _code_table(if_filter: IfFilter, least: float, greatest: float) -> CodeTable:
    """E and its derivative at Chebyshev's nodes of the beats from least to greatest, Hz."""
    centre, width = 0.5 * (least + greatest), max(0.5 * (greatest - least), 1e-3)
    turn = 0.5 * math.pi * width * if_filter.support
    count = 2
    while 2.0 * (0.5 * turn) ** count / math.factorial(count) > BEAT_TOLERANCE:
        count += 1
    node = centre + width * np.cos(np.pi * (np.arange(count) + 0.5) / count)
    fastest = if_filter.stopband + max(abs(least), abs(greatest))
    size = math.ceil(ENTRIES_PER_CYCLE * if_filter.support * fastest)
    step = if_filter.support / size
    inner, weight = np.polynomial.legendre.leggauss(4)
    edge = (np.arange(size + 1) / size - 0.5) * if_filter.support
    within = edge[:-1, None] + 0.5 * step * (inner + 1.0)
    height = if_filter.impulse_response(within) * (0.5 * step * weight)
    # at the ends of its support h is that of inside
    at_edge = if_filter.impulse_response(edge * (1.0 - 1e-12))
    value = np.empty((count, size + 1, 2), dtype=np.complex128)
    for number, beat in enumerate(node):
        pieces = np.sum(height * np.exp(-2j * np.pi * beat * within), axis=1)
        value[number, :, 0] = np.concatenate([[0.0], np.cumsum(pieces)])
        value[number, :, 1] = step * at_edge * np.exp(-2j * np.pi * beat * edge)
    return CodeTable(node=node, step=step, value=value)


def _swept_rule(if_filter: IfFilter, chip: float, steepest: float) -> SweptRule:
    """The rule for chips of this duration, s, and beats that change by ``steepest`` Hz/s."""
    period = 1.0 / if_filter.stopband
    # within a panel the chirp turns by at most π/4 against its tangent
    longest = min(PANEL_SHARE * period, 1.0 / math.sqrt(max(steepest, 1e-300)))
    per_chip = math.ceil(chip / min(CELL_SHARE * period, longest))
    cell = chip / per_chip
    cells = max(1, math.floor(longest / cell * (1 + 1e-9)))
    node, weight = np.polynomial.legendre.leggauss(CELL_NODES)
    legendre = np.polynomial.legendre.legvander(node, CELL_NODES - 1)
    # weight of node q in the integral of P_n(z) exp(jθz) over [−1, 1], which is 2 j^n j_n(θ)
    order = np.arange(CELL_NODES)
    to_node = (weight[:, None] * legendre * (2 * order + 1)) * 1j**order
    panel = np.cos(np.pi * (np.arange(PANEL_NODES) + 0.5) / PANEL_NODES)
    place = (2.0 * np.arange(cells)[:, None] + 1.0 + node) / cells - 1.0
    return SweptRule(
        cells_per_chip=per_chip,
        cells=cells,
        node=node,
        to_node=np.ascontiguousarray(to_node),
        panel=panel,
        spread=np.ascontiguousarray(_lagrange(panel, place.ravel()).reshape(cells, -1, panel.size)),
    )


def _lagrange(node: FloatArray, place: FloatArray) -> FloatArray:
    """Lagrange's polynomials of the nodes at places: ``(place, node)``."""
    out = np.ones((place.size, node.size))
    for j in range(node.size):
        for i in range(node.size):
            if i != j:
                out[:, j] *= (place - node[i]) / (node[j] - node[i])
    return out
