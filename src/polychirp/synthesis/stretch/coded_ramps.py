r"""Ramps with a code: dechirped samples of a transmitter whose signal has chips within its ramps.

On link p the mixer's output is a chirp (`path_kernels.received`) times the conjugate chip
:math:`\bar a_m` that was sent one delay earlier. A sample is the sum over the chips

.. math:: \sum_m \bar a_m \int_{t_m}^{t_{m+1}} h(t - s)\,
          e^{j2\pi(\varphi + f s + \frac12\mu s^2)}\,ds

with the instants :math:`t_m` at which chips arrive. There are three ways to compute it:

- Where the beat is nearly constant, as of a radar's own echoes and of parallel ramps, samples are
  sums of jumps from chip to chip (`steady_code_kernels`).
- Where it is not, and chips are short against the filter's response, all links are summed before
  the filter, as in `near_corners`. A chip is integrated by Filon's rule: polynomials times the beat
  are exact, however fast the beat (`swept_code_kernels`).
- Long chips of other radars are ramps of their own otherwise (`sub_ramps`), for which the engine
  needs no code. So are they where a steady beat is far out of band, where only their ends matter.

All are right to 3e-7 of the strongest samples. A delay's acceleration bends the chirp as in
`path_kernels.beat_of`; what `slow_changes` would add, below 1e-8 on a ramp of 30 µs, is left out by
the first two.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.synthesis.stretch.chirp_response import far_beat
from polychirp.synthesis.stretch.kernel_records import (
    Chips,
    CodedRamps,
    CodeTaps,
    CodeWork,
    LinkTable,
    SweptRule,
)
from polychirp.synthesis.stretch.near_corners import window_series
from polychirp.synthesis.stretch.ramp_overlaps import sent_during

STEADY_TURN: Final = 1e-3
"""Greatest change of the beat over a ramp, in units of 1/S, that counts as steady. Chosen above
that of echoes at 70 m/s on 30 MHz/µs; the table's linear change over the ramp has an error of
1e-7."""

ENTRIES_PER_CYCLE: Final = 24
"""Entries of the table of E per cycle of the highest frequency in it; chosen: a polynomial through
eight of them is right to 6e-8."""

ENTRIES_BEYOND: Final = 6
"""Entries of the table on either side of the filter's support; chosen above half of a polynomial's
eight."""

CELL_SHARE: Final = 0.1
"""Greatest duration of a cell of Filon's rule, in periods of the filter's stop edge; chosen: six
nodes suffice."""

CELL_TURN: Final = 0.03
"""Most cycles by which the beat turns away from its tangent in a cell; chosen."""

CELL_TOLERANCE: Final = 1e-7
"""Error of the polynomial through a cell's nodes, relative to the cell; chosen."""

LONG_CHIP: Final = 2.0
"""Duration of chips, in periods of the stop edge, from which on they are ramps of their own;
chosen: a chip is then about as expensive either way."""

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
) -> list[tuple[int, int]]:
    """Add the links of a coded schedule to ``samples``, V ``(part, channel, ramp, fast)``.

    Return the pairs of a victim's and a transmitted ramp that are not added, as their chips are
    ramps of their own. Of another radar, the weakest links are left out, whose rms together is
    below `INAUDIBLE_SHARE` of the noise.
    """
    from polychirp.synthesis.stretch.steady_code_kernels import add_steady_code, beat_extremes
    from polychirp.synthesis.stretch.swept_code_kernels import add_swept_code

    work = _work(own, sent, tables)
    if not work.row.size:
        return []
    chips = _chips(sent)
    if not is_own:
        tables = tables._replace(links=_audible(radar, sent, tables.links))
    beats = beat_extremes(tables, work)
    divided = not is_own and has_long_chips(radar, sent)
    steady = _steady_units(radar.if_filter, own, work, beats, within_reach=divided)
    some = _in_order_of_beats(tables, _units(work, steady))
    if some.row.size:
        highest = float(np.max(np.abs(beats[steady, :2])))
        code_taps = _code_taps(radar.if_filter, highest, tables.window.step)
        add_steady_code(samples, tables, some, chips, code_taps)
    met = beats[:, 1] >= beats[:, 0]
    rest = _units(work, met & ~steady)
    if divided:
        return sorted(set(zip(rest.ramp.tolist(), rest.sent.tolist(), strict=True)))
    if rest.row.size:
        step = tables.window.step
        change = float(np.max(beats[met & ~steady, 2])) * step
        rule = _swept_rule(radar.if_filter, float(np.min(chips.duration)), change)
        series = window_series(radar.if_filter, step)
        add_swept_code(samples, tables, rest, chips, rule, series)
    return []


def _steady_units(
    if_filter: IfFilter, own: RampSchedule, work: CodeWork, beats: FloatArray, *, within_reach: bool
) -> BoolArray:
    """True for the units whose pair of ramps has a steady beat, ``(unit,)``.

    With ``within_reach``, a beat that is far out of band on all links does not count.
    """
    least, greatest, steepest = beats.T
    turn = steepest * own.duration[work.ramp] * if_filter.support
    fits = (turn <= STEADY_TURN) & (greatest >= least)
    if within_reach:
        closest = np.maximum(np.maximum(least, -greatest), 0.0)
        fits &= closest < far_beat(if_filter, 0.0)
    fits |= greatest < least
    pair = np.unique(np.stack([work.ramp, work.sent]), axis=1, return_inverse=True)[1].ravel()
    all_fit = np.ones(int(pair.max()) + 1, dtype=bool)
    np.logical_and.at(all_fit, pair, fits)
    return np.asarray(all_fit[pair] & (greatest >= least))


def _units(work: CodeWork, chosen: BoolArray) -> CodeWork:
    return CodeWork(*(column[chosen] for column in work))


def _in_order_of_beats(tables: CodedRamps, work: CodeWork) -> CodeWork:
    """The units such that those with about the same beat follow each other."""
    own, sent = tables.own, tables.sent
    ahead = own.start[work.ramp] - sent.start[work.sent]
    beat = own.frequency[work.ramp] - sent.frequency[work.sent] - sent.slope[work.sent] * ahead
    order = np.argsort(beat, kind="stable")
    return CodeWork(*(column[order] for column in work))


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


def _code_taps(if_filter: IfFilter, highest: float, sample_step: float) -> CodeTaps:
    """The table's impulse response for beats up to ``highest``, Hz; samples are so far apart."""
    fastest = if_filter.stopband + highest
    per_sample = math.ceil(ENTRIES_PER_CYCLE * sample_step * fastest)
    step = sample_step / per_sample
    size = math.ceil(if_filter.support / step) + 2 * ENTRIES_BEYOND
    node, weight = np.polynomial.legendre.leggauss(4)
    entry = np.arange(size)[:, None] - ENTRIES_BEYOND
    time = step * (entry + 0.5 * (node + 1.0)) - 0.5 * if_filter.support
    height = if_filter.impulse_response(time)
    outside = np.abs(time) >= 0.5 * if_filter.support
    height[outside] = if_filter.derivatives(time[outside], 0)[0]
    return CodeTaps(
        step=step,
        per_sample=per_sample,
        begin=ENTRIES_BEYOND,
        time=time,
        height=height * (0.5 * step * weight),
    )


def _swept_rule(if_filter: IfFilter, chip: float, change: float) -> SweptRule:
    """The rule for chips of this duration, s, and beats that ``change`` by so much, Hz, a panel."""
    longest = min(CELL_SHARE / if_filter.stopband, CELL_TURN / max(change, 1e-300))
    per_chip = math.ceil(chip / longest)
    turn = math.pi * if_filter.stopband * chip / per_chip
    count = 3
    while turn**count / (2.0 ** (count - 1) * math.factorial(count)) > CELL_TOLERANCE:
        count += 1
    node, weight = np.polynomial.legendre.leggauss(count)
    order = np.arange(count)
    legendre = np.polynomial.legendre.legvander(node, count - 1)
    # the integral of P_n(z) exp(jθz) over [−1, 1] is 2 j^n j_n(θ)
    to_node = weight[:, None] * legendre * (2 * order + 1) * 1j**order
    return SweptRule(cells_per_chip=per_chip, node=node, to_node=np.ascontiguousarray(to_node))


def has_long_chips(radar: Radar, sent: RampSchedule) -> bool:
    """True if chips are so long against the victim's filter that they are ramps of their own."""
    code = sent.code
    assert code is not None
    return float(np.min(code.chip_duration)) * radar.if_filter.stopband > LONG_CHIP


def sub_ramps(sent: RampSchedule) -> tuple[RampSchedule, IntArray]:
    """The same signal as ramps without a code, one for each run of equal chips.

    The second result is the number of the coded ramp of which each is a part.

    >>> from polychirp.model.ramp_code import RampCode
    >>> code = RampCode(value=[[1, 1, -1]], row=[0], chip_duration=[1e-6])
    >>> ramps = RampSchedule(start_time=[0.0], duration=[3e-6], start_frequency=[79e9],
    ...     slope=[1e12], start_phase=[0.0], sweep=[0], code=code)
    >>> parts, whole = sub_ramps(ramps)
    >>> (parts.duration * 1e6).round(6), parts.transmit_weight[:, 0].real
    (array([2., 1.]), array([ 1., -1.]))
    """
    code = sent.code
    assert code is not None
    ramps, begins, values = [], [], []
    for number in range(sent.num_ramps):
        chip = float(code.chip_duration[number])
        count = math.ceil(float(sent.duration[number]) / chip - 1e-9)
        value = np.resize(code.value[code.row[number]], count)
        first = np.flatnonzero(np.diff(value, prepend=np.nan) != 0.0)
        ramps.append(np.full(first.size, number))
        begins.append(first * chip)
        values.append(value[first])
    k, into, value = np.concatenate(ramps), np.concatenate(begins), np.concatenate(values)
    start = sent.start_time[k] + into
    is_last = np.diff(k, append=-1) != 0
    after = np.where(is_last, sent.end_time[k], np.roll(start, -1))
    phase = (sent.start_frequency[k] * into) % 1.0 + 0.5 * sent.slope[k] * into**2
    parts = RampSchedule(
        start_time=start,
        duration=after - start,
        start_frequency=sent.start_frequency[k] + sent.slope[k] * into,
        slope=sent.slope[k],
        start_phase=(sent.start_phase[k] + phase) % 1.0,
        sweep=sent.sweep[k],
        transmit_weight=sent.transmit_weight[k] * value[:, None],
    )
    return parts, k


def parts_of_pairs(pairs: Sequence[tuple[int, int]], whole: IntArray) -> set[tuple[int, int]]:
    """The pairs of a victim's ramp and each part (`sub_ramps`) of the coded ramp.

    >>> sorted(parts_of_pairs([(7, 0), (8, 1)], np.array([0, 0, 1])))
    [(7, 0), (7, 1), (8, 2)]
    """
    first = np.searchsorted(whole, np.arange(int(whole[-1]) + 2))
    return {
        (ramp, part)
        for ramp, sent in pairs
        for part in range(int(first[sent]), int(first[sent + 1]))
    }
