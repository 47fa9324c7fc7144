"""Records that the kernels take, and the constants that tables and kernels share.

All times are in s, frequencies and beats in Hz, rates and slopes in Hz/s, phases in cycles. The
time of a pair of ramps is zero where the victim's ramp starts. Records are named tuples of arrays
and scalars because numba compiles these. Nothing here imports numba.
"""

from typing import Final, NamedTuple

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray

NUM_END_TERMS: Final = 6
"""Greatest number of terms of the end-point series (`filter_kernels.end_series`); chosen."""

NUM_TAYLOR_TERMS: Final = 6
"""Number of Taylor terms by which a derivative of h is continued between its nodes; chosen."""

EXPANSION_TOLERANCE: Final = 2e-10
"""Greatest error of each expansion over many links, relative to the largest value in it. Chosen:
the errors of hundreds of links may add up to 5e-8 of the strongest sample."""

NUM_PANEL_NODES: Final = 16
"""Number of Gauss nodes in a piece of a panel (`near_corner_kernels`), for vector instructions."""

NUMBERS_PER_BLOCK: Final = 1 << 15
"""Greatest size of an array of links times terms of one channel: 256 KiB, chosen to fit a cache."""


class Ramps(NamedTuple):
    """Columns of a schedule, ``(ramp,)``; times count from an origin that both schedules share.

    ``weight`` is the conjugate of each transmitting element's weight, ``(ramp, element)``.
    """

    start: FloatArray
    duration: FloatArray
    frequency: FloatArray
    slope: FloatArray
    phase: FloatArray
    weight: ComplexArray


class Window(NamedTuple):
    """The victim's samples, ``(ramp,)``: time of the first in the ramp, their number, 1/rate."""

    first: FloatArray
    num_samples: IntArray
    step: float


class LinkTable(NamedTuple):
    """Links of all snapshots, ``(link,)``: those of snapshot i are ``start[i]:start[i + 1]``.

    A link is a path from one transmitting element. ``limit`` is the gain below which it need not be
    added. The links of a snapshot are in order of ``part``, ``is_weak`` and delay. ``snapshot``
    (ramp,) is the one that each ramp of the victim uses; ``reference_time`` is (snapshot,).
    """

    start: IntArray
    reference_time: FloatArray
    snapshot: IntArray
    delay: FloatArray
    delay_rate: FloatArray
    delay_acceleration: FloatArray
    element_delay: FloatArray
    element_delay_rate: FloatArray
    amplitude: ComplexArray
    amplitude_rate: ComplexArray
    limit: FloatArray
    part: IntArray
    element: IntArray
    is_weak: BoolArray


class PairTable(NamedTuple):
    """Pairs of a victim's and a transmitted ramp, the latter ``sent``, ``(pair,)``.

    A pair's table of G is the entries ``begin:end`` of ``moment`` and ``envelope``
    (`ResponseTable`). The links' rates are within ``spread`` of ``rate``. Above the beat ``far``
    the end-point series holds.
    """

    sent: IntArray
    begin: IntArray
    end: IntArray
    rate: FloatArray
    spread: FloatArray
    far: FloatArray
    step: float
    moment: ComplexArray
    envelope: FloatArray


class Taps(NamedTuple):
    """The impulse response h, up to ``half`` = S/2 on both sides.

    ``taylor`` has its derivatives over order!, ``(node, order)``, at nodes ``step`` apart from
    −S/2 on; ``peak`` is the largest magnitude of h, ``edge`` that at ±S/2. ``bessel`` are the
    coefficients of the end-point series; ``node`` and ``weight`` are Gauss's rule on [0, 1].
    """

    half: float
    stopband: float
    step: float
    taylor: FloatArray
    peak: float
    edge: float
    bessel: FloatArray
    node: FloatArray
    weight: FloatArray


class Tables(NamedTuple):
    """All tables of one contribution: both schedules, samples, links, pairs of ramps, filter."""

    own: Ramps
    sent: Ramps
    window: Window
    links: LinkTable
    pairs: PairTable
    taps: Taps


class WorkTable(NamedTuple):
    """Work units (`WorkUnit`) as columns, ``(unit,)``: samples ``begin:end`` of ``row``."""

    part: IntArray
    row: IntArray
    ramp: IntArray
    pair: IntArray
    low: IntArray
    high: IntArray
    begin: IntArray
    end: IntArray


class RampPair(NamedTuple):
    """A ramp of the victim and a transmitted one.

    ``since`` is the time from the links' reference time, ``ahead`` that from the transmitted ramp's
    start, to the start of the victim's ramp. ``weight`` is `Ramps.weight` of the transmitted ramp.
    """

    victim_ramp: int
    sent_ramp: int
    since: float
    ahead: float
    duration: float
    frequency: float
    slope: float
    phase: float
    sent_duration: float
    sent_frequency: float
    sent_slope: float
    sent_phase: float
    weight: ComplexArray


class Beat(NamedTuple):
    """Beat of a ramp of the victim with a link's signal, as a chirp.

    ``frequency``, Hz, and ``delay``, s, are those where the victim's ramp starts, ``rate`` is in
    Hz/s; ``into`` is the time since the start of the transmitted ramp, s, that arrives there, and
    ``stretched`` its derivative by time. ``phase``, cycles, is what the delay's curvature adds.
    """

    frequency: float
    rate: float
    delay: float
    into: float
    stretched: float
    phase: float


def ramp_pair(own: Ramps, k: int, sent: Ramps, i: int, links: LinkTable) -> RampPair:
    """The pair of the victim's ramp k and the transmitted ramp i."""
    return RampPair(
        k, i,
        float(own.start[k] - links.reference_time[links.snapshot[k]]),
        float(own.start[k] - sent.start[i]),
        float(own.duration[k]), float(own.frequency[k]), float(own.slope[k]), float(own.phase[k]),
        float(sent.duration[i]), float(sent.frequency[i]), float(sent.slope[i]),
        float(sent.phase[i]), sent.weight[i],
    )  # fmt: skip


class Overlap(NamedTuple):
    """A ramp of the victim and a transmitted ramp that arrives during it on at least one path.

    Rates of the beat are between ``least_rate`` and ``greatest_rate``, and its magnitudes between
    ``lowest`` and ``highest`` on every path, during the overlap and half a filter's support around
    it; ∞ and −∞ without an overlap. ``begin_beat`` and ``end_beat`` are the least magnitudes where
    a path's overlap begins and where it ends; ∞ without an overlap. From the start of the victim's
    ramp, the overlap begins between ``first_begin`` and ``last_begin`` and ends between
    ``first_end`` and ``last_end``.
    ``power``, W, is the estimate of what all paths together bring into the band.
    """

    victim_ramp: int
    sent_ramp: int
    least_rate: float
    greatest_rate: float
    lowest: float
    highest: float
    begin_beat: float
    end_beat: float
    first_begin: float
    last_begin: float
    first_end: float
    last_end: float
    power: float

    @property
    def centre(self) -> float:
        """Middle of the extreme rates, Hz/s."""
        return 0.5 * (self.least_rate + self.greatest_rate)

    @property
    def spread(self) -> float:
        """Distance of the extreme rates from the centre, Hz/s."""
        return 0.5 * (self.greatest_rate - self.least_rate)

    @property
    def steepest(self) -> float:
        """Greatest magnitude of a rate, Hz/s."""
        return max(abs(self.least_rate), abs(self.greatest_rate))


class Response(NamedTuple):
    """The entries of one pair in `PairTable`; ``moment`` and ``envelope`` may be empty."""

    rate: float
    spread: float
    far: float
    step: float
    moment: ComplexArray
    envelope: FloatArray


def response_of(pairs: PairTable, pair: int) -> Response:
    """The response of the filter to one pair of ramps."""
    entries = slice(pairs.begin[pair], pairs.end[pair])
    return Response(
        float(pairs.rate[pair]), float(pairs.spread[pair]), float(pairs.far[pair]), pairs.step,
        pairs.moment[entries], pairs.envelope[entries],
    )  # fmt: skip


class Chirp(NamedTuple):
    """A piece of a chirp: exp(j2π(φ + f t + ½ μ t²)) times ``amplitude`` from begin to end.

    A gain below ``limit`` need not be added.
    """

    amplitude: complex
    limit: float
    phase: float
    beat: float
    rate: float
    begin: float
    end: float


class Samples(NamedTuple):
    """Samples at the times ``first + n·step``, in arrays of real and of imaginary parts."""

    real: FloatArray
    imag: FloatArray
    first: float
    step: float


class Batch(NamedTuple):
    """The links ``low:high``, a pair of ramps, and the response of the filter to it."""

    pair: RampPair
    response: Response
    taps: Taps
    links: LinkTable
    low: int
    high: int


class BandLimits(NamedTuple):
    """Half the filter's support, begin and end of sampling, pass edge, and h(0)."""

    half: float
    from_time: float
    until_time: float
    passband: float
    peak: float


class BeatRange(NamedTuple):
    """Extreme beats of all channels, and the greatest distance of one from its link's middle."""

    least: float
    greatest: float
    apart: float


class BeatExpansion(NamedTuple):
    """A polynomial in the beat at the time ``time``, within ``width`` of ``centre``.

    ``node`` are Chebyshev's nodes; the matrix ``to_terms`` gives coefficients from values at them.
    """

    time: float
    centre: float
    width: float
    node: FloatArray
    to_terms: FloatArray


class CornerRange(NamedTuple):
    """Times of corners within ``time_width`` of ``time``, beats within ``beat_width`` of ``beat``.

    ``side`` is −1 where corners are beginnings of chirps, and 1 where they are endings.
    """

    side: int
    time: float
    time_width: float
    beat: float
    beat_width: float


class WindowSeries(NamedTuple):
    """The impulse response over a sample's window, in Legendre's polynomials (`near_corners`).

    A window lasts for ``num_steps`` intervals between samples and ``share`` of one more. ``gain``
    (interval, order + 1) has the coefficients of every interval, 0 for the moment with h, and in
    the last row 1 for this moment alone. ``node`` and ``weight`` are Gauss's rule on [0, 1].
    """

    share: float
    num_steps: int
    gain: FloatArray
    node: FloatArray
    weight: FloatArray


class CutExpansion(NamedTuple):
    """Polynomials for a sample whose window may contain a corner.

    The variables of ``corner_gain`` (power, Chebyshev's polynomial) are the beat at the corner,
    less ``beat``, and the time from the corner to the sample, less ``delay``. That of ``edge_gain``
    (power) is the beat at the window's other edge, less ``edge_beat``. Each variable is in units of
    its width.
    """

    corner_gain: ComplexArray
    edge_gain: ComplexArray
    beat: float
    beat_width: float
    delay: float
    delay_width: float
    edge_beat: float
    edge_width: float


class Chips(NamedTuple):
    """Conjugate chips ``(code, chip)``; of each sent ramp the row and the chips' duration, s."""

    value: ComplexArray
    row: IntArray
    duration: FloatArray


class CodedRamps(NamedTuple):
    """A victim's ramps and samples, the coded ramps of a transmitter, the links and the filter."""

    own: Ramps
    sent: Ramps
    window: Window
    links: LinkTable
    taps: Taps


class CodeWork(NamedTuple):
    """Rows of samples, each with a ramp of the victim and a coded one, as columns ``(unit,)``."""

    row: IntArray
    ramp: IntArray
    sent: IntArray


class CodeTaps(NamedTuple):
    """The impulse response between the entries of a table, of which ``per_sample`` are 1/rate.

    Entries are ``step`` s apart, and that at −S/2 has the number ``begin``. ``time`` (entry, node)
    has Gauss's nodes between an entry and the next, s from the middle of the response, ``height``
    their weights times h. Outside of its support, h is continued as an entire function.
    """

    step: float
    per_sample: int
    begin: int
    time: FloatArray
    height: FloatArray


class CodedChirp(NamedTuple):
    """The chirp of a link and channel, with its code, and the rate of its amplitude, V/s.

    ``amplitude`` is that where the victim's ramp starts. The cell at the time t has the number
    ``into + stretch·t``, counted from the sent ramp's start.
    """

    chirp: Chirp
    amplitude: complex
    drift: complex
    code: ComplexArray
    into: float
    stretch: float


class SweptRule(NamedTuple):
    """Filon's rule for chips whose beat changes; a chip has ``cells_per_chip`` equal cells.

    ``node`` are Gauss's nodes of a cell on [−1, 1]; ``to_node`` (node, order) gives their weights
    from spherical Bessel functions of half the phase by which the beat turns in a cell.
    """

    cells_per_chip: int
    node: FloatArray
    to_node: ComplexArray
