"""Rules of access that act from frame to frame, on what a radar measured in the last one.

A rule is plain data. For every radar and frame it gives a `Turn`: when the radar starts, how far
its frequencies are shifted, and which draw of its waveform it sends. It sees its own last turn and
what its radar measured, `MeasuredInterference`, and nothing of other radars. Random choices come
from streams with the names of the radar and the frame.

A rule that also listens before each frame (`Listening`) is asked, after every time of listening,
how long the radar waits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal, Protocol, runtime_checkable

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, Ratio, Seconds, from_db
from polychirp.waveform.access import Assignment, Count
from polychirp.waveform.base import need_not_negative, need_positive

TOLERATED_INR: Final = from_db(-6.0)
"""Default of the power ratio of interference to noise above which a frame is lost. It is the
protection criterion of automotive radars in ITU-R M.2057; the floor then rises by 1 dB."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """Start, band and draw of one radar in one frame.

    Parameters
    ----------
    delay : s, from the begin of the frame to the radar's first ramp
    shift : Hz, added to all of its frequencies
    draw : number of the draw of its waveform; another number draws other values
    """

    delay: float = 0.0
    shift: float = 0.0
    draw: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredInterference:
    """Interference that one radar measured in one frame.

    Parameters
    ----------
    inr : power ratio of interference to noise in its IF band, mean over the samples of the frame
    hit_ramps : share of its ramps in which there is more interference than noise
    """

    inr: float
    hit_ramps: float


@runtime_checkable
class FrameRule(Protocol):
    """A rule that changes what a radar does from frame to frame.

    `HopAfterHit` is an example. The method `assign`, which every rule has, gives the turns of the
    first frame, with draw 0.
    """

    @property
    def num_frames(self) -> int:
        """Number of frames; the last one is simulated, and the others are measured alone."""

    @property
    def frame_interval(self) -> float:
        """Time from the begin of one frame to that of the next, s."""

    @property
    def tolerated(self) -> float:
        """Power ratio of interference to noise above which a frame counts as lost."""

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """Delay and shift of every radar in the first frame, as of `Access`."""

    def next_turn(self, last: Turn, measured: MeasuredInterference, *, streams: Streams) -> Turn:
        """The turn of a radar in its next frame.

        ``streams`` belong to the radar and that frame; equal ones give an equal turn.
        """


@runtime_checkable
class Listening(FrameRule, Protocol):
    """A rule by which a radar listens before it sends, as `ListenBeforeTalk`.

    The delay of a turn is then the begin of the first time of listening.
    """

    @property
    def listening(self) -> float:
        """Time for which the radar listens, s."""

    def wait(self, energy: float, *, samples: float, attempt: int, streams: Streams) -> float:
        """Time, s, that the radar waits before it listens again; 0 for sending at once.

        Parameters
        ----------
        energy : measured energy over the mean energy of noise alone
        samples : number of independent complex samples of noise in that energy
        attempt : number of times that it has listened before in this frame
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameRuleSettings(Spec):
    """Settings that rules from frame to frame share.

    Parameters
    ----------
    num_frames : number of frames of a trial; the last one is simulated in full
    frame_interval : s, from the begin of one frame to that of the next, the same for all radars
    tolerated : power ratio of interference to noise above which a frame counts as lost
    """

    num_frames: Annotated[int, Between(least=1, greatest=10_000)] = 10
    frame_interval: Seconds = 50e-3
    tolerated: Ratio = TOLERATED_INR

    def __post_init__(self) -> None:
        owner = "a rule from frame to frame"
        need_positive(owner, num_frames=self.num_frames, frame_interval=self.frame_interval)
        need_positive(owner, tolerated=self.tolerated)


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnTurns(FrameRuleSettings):
    """Settings that rules share which draw a radar's slot, start and channel.

    Parameters
    ----------
    num_slots, slot : number of slots among which a radar draws, and their length, s
    start_spread : s, within which the start is uniform, after that of the slot
    num_channels, spacing : number of channels among which a radar draws, and their distance, Hz
    """

    num_slots: Count = 1
    slot: Seconds = 0.0
    start_spread: Seconds = 0.0
    num_channels: Count = 1
    spacing: Hertz = 0.0

    def __post_init__(self) -> None:
        super(DrawnTurns, self).__post_init__()
        owner = "a rule that draws turns"
        need_positive(owner, num_slots=self.num_slots, num_channels=self.num_channels)
        need_not_negative(
            owner, slot=self.slot, start_spread=self.start_spread, spacing=self.spacing
        )
        if self.num_slots > 1:
            need_positive(f"{owner} with slots", slot=self.slot)
        if self.num_channels > 1:
            need_positive(f"{owner} with channels", spacing=self.spacing)

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """See `FrameRule.assign`."""
        del heading
        turns = [self.drawn(draw=0, streams=streams.of("access", name)) for name in names]
        return Assignment(
            delay=np.array([turn.delay for turn in turns]),
            shift=np.array([turn.shift for turn in turns]),
        )

    def drawn(self, *, draw: int, streams: Streams) -> Turn:
        """A turn whose slot, start and channel are drawn from streams of their own."""
        slot = int(streams["slot"].integers(self.num_slots))
        channel = int(streams["channel"].integers(self.num_channels))
        start = float(streams["start"].uniform(0.0, self.start_spread))
        return Turn(delay=slot * self.slot + start, shift=channel * self.spacing, draw=draw)


@dataclass(frozen=True, slots=True, kw_only=True)
class RedrawEachFrame(DrawnTurns):
    """Every radar draws its turn anew for every frame, whatever it measured.

    With ``slot`` and ``num_slots`` it is slotted ALOHA from frame to frame, which needs a common
    clock; with ``start_spread``, pure ALOHA, or the dither of Texas Instruments' report SWRA662A;
    with ``spacing`` and ``num_channels``, frames that hop. All can be combined. The waveform's own
    draws are new as well.

    Examples
    --------
    >>> rule = RedrawEachFrame(num_slots=8, slot=2e-6)
    >>> quiet = MeasuredInterference(inr=0.0, hit_ramps=0.0)
    >>> turns = [rule.next_turn(Turn(), quiet, streams=Streams(seed=n)) for n in range(3)]
    >>> [round(turn.delay / 2e-6) for turn in turns], [turn.draw for turn in turns]
    ([0, 6, 3], [1, 1, 1])
    """

    kind: Literal["redraw-each-frame"] = "redraw-each-frame"

    def next_turn(self, last: Turn, measured: MeasuredInterference, *, streams: Streams) -> Turn:
        """See `FrameRule.next_turn`."""
        del measured
        return self.drawn(draw=last.draw + 1, streams=streams)


@dataclass(frozen=True, slots=True, kw_only=True)
class HopAfterHit(DrawnTurns):
    """A radar draws its turn anew after a frame with interference, and else keeps it.

    It draws what `RedrawEachFrame` draws. Radars that disturb each other thus part, and those that
    do not stay where they are.

    Parameters
    ----------
    hit : power ratio of interference to noise, mean over the frame, above which it draws anew
    hit_ramps : share of ramps with more interference than noise, above which it does too; this is
        what a detector of bursts counts

    Examples
    --------
    >>> rule = HopAfterHit(num_channels=4, spacing=75e6)
    >>> last, streams = Turn(shift=150e6), Streams(seed=1)
    >>> rule.next_turn(last, MeasuredInterference(inr=0.01, hit_ramps=0.0), streams=streams) == last
    True
    >>> rule.next_turn(last, MeasuredInterference(inr=9.0, hit_ramps=0.3), streams=streams).draw
    1
    """

    kind: Literal["hop-after-hit"] = "hop-after-hit"
    hit: Ratio = TOLERATED_INR
    hit_ramps: float = 1.0

    def __post_init__(self) -> None:
        super(HopAfterHit, self).__post_init__()
        need_positive("a rule that hops after a hit", hit=self.hit)
        if not 0.0 <= self.hit_ramps <= 1.0:
            raise InputError(
                f"hit_ramps is {self.hit_ramps:g}; it is a share of the ramps, from 0 to 1"
            )

    def next_turn(self, last: Turn, measured: MeasuredInterference, *, streams: Streams) -> Turn:
        """See `FrameRule.next_turn`."""
        if measured.inr > self.hit or measured.hit_ramps > self.hit_ramps:
            return self.drawn(draw=last.draw + 1, streams=streams)
        return last


@dataclass(frozen=True, slots=True, kw_only=True)
class ListenBeforeTalk(FrameRuleSettings):
    """A radar listens before its frame, and sends only if its band is quiet.

    It measures the energy that its antenna receives within the band of its waveform for the time
    ``listening``. If the energy exceeds that of noise by the threshold, it waits for a time that is
    uniform up to ``backoff`` and listens again, ``most_attempts`` times in all; after the last one
    it sends in any case, since a car cannot do without its radar. In the next frame it begins to
    listen where it last did in this one, or, if that was after ``start_spread``, at a time that is
    drawn anew. Two radars that begin to listen so shortly after each other that the later one has
    not yet heard enough of the earlier one collide, and again in every later frame in which both
    keep their places.

    Parameters
    ----------
    start_spread : s, within which a radar begins to listen in its first frame
    listening : s
    false_alarm_probability : probability that noise alone makes the band seem busy
    backoff : s, greatest time between two times of listening
    most_attempts : greatest number of times of listening before a frame

    Raises
    ------
    InputError
        A time is negative or zero, or a probability is not between 0 and 1.

    Examples
    --------
    >>> rule = ListenBeforeTalk(start_spread=20e-3, backoff=5e-3)
    >>> rule.wait(1.0, samples=3e4, attempt=0, streams=Streams(seed=1))
    0.0
    >>> 0.0 < rule.wait(2.0, samples=3e4, attempt=0, streams=Streams(seed=1)) < 5e-3
    True
    """

    kind: Literal["listen-before-talk"] = "listen-before-talk"
    start_spread: Seconds = 10e-3
    listening: Seconds = 100e-6
    false_alarm_probability: float = 1e-6
    backoff: Seconds = 5e-3
    most_attempts: Annotated[int, Between(least=1, greatest=1000)] = 8

    def __post_init__(self) -> None:
        super(ListenBeforeTalk, self).__post_init__()
        owner = "listening before talk"
        need_positive(owner, listening=self.listening, backoff=self.backoff)
        need_positive(owner, most_attempts=self.most_attempts)
        need_not_negative(owner, start_spread=self.start_spread)
        if not 0.0 < self.false_alarm_probability < 1.0:
            raise InputError(f"{owner} needs a false-alarm probability between 0 and 1")

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """See `FrameRule.assign`."""
        del heading
        begin = [streams["access", name].uniform(0.0, self.start_spread) for name in names]
        return Assignment(delay=np.array(begin), shift=np.zeros(len(names)))

    def next_turn(self, last: Turn, measured: MeasuredInterference, *, streams: Streams) -> Turn:
        """See `FrameRule.next_turn`."""
        del measured
        begin = last.delay
        if begin > self.start_spread:
            begin = float(streams["start"].uniform(0.0, self.start_spread))
        return Turn(delay=begin, shift=last.shift, draw=last.draw + 1)

    def wait(self, energy: float, *, samples: float, attempt: int, streams: Streams) -> float:
        """See `Listening.wait`."""
        if attempt + 1 >= self.most_attempts or energy <= self.threshold(samples):
            return 0.0
        return float(streams["backoff", attempt].uniform(0.0, self.backoff))

    def threshold(self, samples: float) -> float:
        r"""Energy over the mean energy of noise above which the band seems busy.

        The energy of n complex samples of noise is :math:`\chi^2_{2n}/2n` of its mean.

        >>> round(ListenBeforeTalk().threshold(3e4), 3)
        1.028
        """
        from scipy.special import chdtri

        freedom = 2.0 * samples
        return float(chdtri(freedom, self.false_alarm_probability) / freedom)
