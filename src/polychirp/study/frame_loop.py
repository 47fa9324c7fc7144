"""The frames of a study whose rule acts from frame to frame, up to the one that is simulated.

Before the last frame only what the rule sees is computed, from the powers of the paths and the
times at which ramps meet, without samples (`synthesis.links.interference_levels`). Every radar is
at once victim and interferer.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np

from polychirp.channel.base import RayTracer
from polychirp.channel.tracers.path_interpolation import PartedTracer
from polychirp.channel.tracers.ray_check import checked
from polychirp.errors import InputError
from polychirp.model.frame_history import FrameHistory
from polychirp.model.if_frame import sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.rng import Streams
from polychirp.study.recent_results import RecentResults, recalled
from polychirp.study.spec import Study, first_turn, schedule_in_turn, schedules_of, tracer_of
from polychirp.synthesis.links.interference_levels import (
    ReceivedPaths,
    band_of,
    energy_over_noise,
    interference_to_noise,
    received_paths,
)
from polychirp.waveform import FrameRule, Listening, MeasuredInterference, Turn


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LastFrame:
    """The last frame of a study: ramps of all radars, and what came before.

    Parameters
    ----------
    schedules : of every radar, in the order of the radars
    history : of all frames, the last one included
    """

    schedules: tuple[RampSchedule, ...]
    history: FrameHistory


def last_frame(
    study: Study, rule: FrameRule, scene: Scene, *, traces: RecentResults | None = None
) -> LastFrame:
    """The frames of a study under its rule; the scene moves on from frame to frame.

    The last frame begins at 0 s, as the only frame of other rules does, and the others before. So
    all rules are compared on the same street. Paths of all radars are traced once in every frame,
    at its begin. ``traces`` keeps them for other studies of the same street.

    Raises
    ------
    InputError
        A radar's frame ends after the next one begins, or the tracer gives paths that cannot be.

    Examples
    --------
    >>> from polychirp.channel.tracers.free_space import FreeSpace
    >>> from polychirp.study.spec import StudyRadar, scene_of
    >>> from polychirp.traffic.street import Street, Vehicle
    >>> from polychirp.waveform import HopAfterHit, Sawtooth
    >>> street = Street(vehicles=(Vehicle(name="a", x=0.0, y=0.0),
    ...     Vehicle(name="b", x=30.0, y=0.0, heading=np.pi)))
    >>> radars = tuple(StudyRadar(name=name, vehicle=name, waveform=Sawtooth()) for name in "ab")
    >>> rule = HopAfterHit(num_frames=3, num_channels=8, spacing=1e9)
    >>> study = Study(name="pair", street=street, radars=radars, access=rule, tracer=FreeSpace())
    >>> last_frame(study, rule, scene_of(study)).history.is_lost.shape
    (3, 2)
    """
    times = tuple(frame_begin(rule, number) for number in range(rule.num_frames))

    tracer = tracer_of(study, schedules_of(study))

    def traced() -> tuple[ReceivedPaths, ...]:
        moments = [scene.at(time) for time in times]
        return tuple(received_paths(one, _paths(tracer, one)) for one in moments)

    makers = ("frames", tracer, scene, times)
    known = recalled(traces, makers, traced)
    turns = [first_turn(study, radar) for radar in study.radars]
    rows: list[tuple[tuple[RampSchedule, ...], list[MeasuredInterference]]] = []
    schedules: tuple[RampSchedule, ...] = ()
    for frame, paths in enumerate(known):
        here = _Frame(study, rule, scene, paths, frame)
        turns, schedules = here.sent(turns)
        here.refuse_too_long(schedules)
        measured = here.measured(schedules)
        rows.append((schedules, measured))
        turns = [
            rule.next_turn(turn, one, streams=here.streams(number, frame + 1))
            for number, (turn, one) in enumerate(zip(turns, measured, strict=True))
        ]
    return LastFrame(schedules=schedules, history=_history(study, rule, rows))


def _paths(tracer: RayTracer, scene: Scene) -> PropagationPaths:
    """Paths of a tracer; those of a tracer without parts are checked, as in a trial."""
    paths = tracer.trace(scene)
    return paths if isinstance(tracer, PartedTracer) else checked(paths, scene)


def frame_begin(rule: FrameRule, number: int) -> float:
    """Begin of frame ``number``, s: the last one begins at 0 s."""
    return (number + 1 - rule.num_frames) * rule.frame_interval


def _history(
    study: Study,
    rule: FrameRule,
    rows: Sequence[tuple[Sequence[RampSchedule], Sequence[MeasuredInterference]]],
) -> FrameHistory:
    inr = np.array([[one.inr for one in measured] for _, measured in rows])
    return FrameHistory(
        names=tuple(radar.name for radar in study.radars),
        interval=rule.frame_interval,
        start_time=np.array([[float(one.start_time[0]) for one in sent] for sent, _ in rows]),
        inr=inr,
        hit_ramps=np.array([[one.hit_ramps for one in measured] for _, measured in rows]),
        is_lost=inr > rule.tolerated,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """One frame of all radars, with its paths and its number."""

    study: Study
    rule: FrameRule
    scene: Scene
    paths: ReceivedPaths
    number: int

    def streams(self, radar: int, frame: int) -> Streams:
        """Streams of one radar for its choices in one frame."""
        name = self.study.radars[radar].name
        return Streams(seed=self.study.seed).of("access", name, "frame", frame)

    def schedule(self, radar: int, turn: Turn) -> RampSchedule:
        """Ramps of a radar in this frame."""
        begin = frame_begin(self.rule, self.number)
        return schedule_in_turn(self.study, self.study.radars[radar], turn, begin=begin)

    def sent(self, turns: Sequence[Turn]) -> tuple[list[Turn], tuple[RampSchedule, ...]]:
        """The turns as they come to pass, and the ramps that all radars send."""
        if isinstance(self.rule, Listening):
            return self._after_listening(self.rule, turns)
        return [*turns], tuple(self.schedule(n, turn) for n, turn in enumerate(turns))

    def _after_listening(
        self, rule: Listening, turns: Sequence[Turn]
    ) -> tuple[list[Turn], tuple[RampSchedule, ...]]:
        """The same, if every radar listens first: one after the other, in order of time.

        A radar receives those whose ramps are decided, thus all that send while it listens: a radar
        that begins to listen later sends later.
        """
        kept, on_air = [*turns], dict[int, RampSchedule]()
        waiting: list[tuple[float, int, int]] = []
        for number, turn in enumerate(turns):
            heappush(waiting, (self._begin(number, turn), number, 0))
        while waiting:
            begin, number, attempt = heappop(waiting)
            streams = self.streams(number, self.number)
            planned = self.schedule(number, kept[number])
            energy, samples = energy_over_noise(
                self.scene,
                self.paths,
                on_air,
                listener=number,
                band=band_of(planned),
                time=(begin, begin + rule.listening),
            )
            measured = _measured_energy(energy, samples, streams["listening", attempt])
            pause = rule.wait(measured, samples=samples, attempt=attempt, streams=streams)
            if pause <= 0.0:
                later = Turn(
                    delay=kept[number].delay + rule.listening,
                    shift=kept[number].shift,
                    draw=kept[number].draw,
                )
                on_air[number] = self.schedule(number, later)
                continue
            turn = kept[number]
            kept[number] = Turn(
                delay=turn.delay + rule.listening + pause, shift=turn.shift, draw=turn.draw
            )
            heappush(waiting, (self._begin(number, kept[number]), number, attempt + 1))
        return kept, tuple(on_air[number] for number in range(len(turns)))

    def _begin(self, radar: int, turn: Turn) -> float:
        return float(self.schedule(radar, turn).start_time[0])

    def measured(self, schedules: Sequence[RampSchedule]) -> list[MeasuredInterference]:
        """Interference that every radar measures in this frame."""
        ratios = [
            interference_to_noise(self.scene, schedules, self.paths, victim=number)
            for number in range(len(schedules))
        ]
        times = [
            sample_times(schedule, radar.converter)
            for schedule, radar in zip(schedules, self.scene.radars, strict=True)
        ]
        return [
            MeasuredInterference(
                inr=float(np.average(ratio, weights=one.num_samples)),
                hit_ramps=float(np.mean(ratio > 1.0)),
            )
            for ratio, one in zip(ratios, times, strict=True)
        ]

    def refuse_too_long(self, schedules: Sequence[RampSchedule]) -> None:
        """Refuse ramps that end after the next frame of some radar can begin."""
        ends = [float(one.end_time[-1]) for one in schedules]
        late = int(np.argmax(ends))
        begin, interval = frame_begin(self.rule, self.number), self.rule.frame_interval
        if ends[late] > begin + interval:
            raise InputError(
                f"access.frame_interval: radar '{self.study.radars[late].name}' ends frame "
                f"{self.number} {ends[late] - begin:.4g} s after its begin, and the next frame "
                f"begins after {interval:.4g} s; lengthen frame_interval, or shorten frames, "
                "starts or waits"
            )


def _measured_energy(mean: float, samples: float, draw: np.random.Generator) -> float:
    r"""Energy of ``samples`` complex samples over that of noise, drawn about its ``mean``.

    It is :math:`\chi'^2_{2n}(2n(\bar e - 1))/2n`, with as many degrees of freedom as real samples.
    """
    freedom = 2.0 * samples
    return float(draw.noncentral_chisquare(freedom, freedom * (mean - 1.0)) / freedom)
