"""One trial of a study: all stages in order, from the drawn street to the score."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.base import RayTracer
from polychirp.channel.scene.ground_truth import truth
from polychirp.channel.tracers.path_interpolation import interpolate_paths
from polychirp.errors import InputError, no_such
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.detection import Detections
from polychirp.model.frame_history import FrameHistory
from polychirp.model.if_frame import IfFrame, IfParts, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.placement import Placement, placement
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.model.score import Score
from polychirp.model.truth import Truth
from polychirp.receiver.attribution import attribute, floor_rise, powers_in, target_levels
from polychirp.receiver.coherent.parts import PartPowers
from polychirp.receiver.mimo import (
    azimuths_in_motion,
    phases_in_motion,
    virtual_array,
    virtual_parts,
)
from polychirp.receiver.mitigation.base import refuse_unfit
from polychirp.receiver.selection import (
    AnyReceiver,
    decodes_elements,
    readable_elements,
    receiver_for,
    refuse_real_samples,
    refuse_unsampled,
)
from polychirp.receiver.signal_model.transmit_codes import code_blocks
from polychirp.rng import Streams
from polychirp.scoring.compare import compare
from polychirp.scoring.echoes import Echoes, echoes_of, mean_echoes
from polychirp.study.body_echoes import body_echoes
from polychirp.study.frame_loop import last_frame
from polychirp.study.ghost_radars import radars_of_ghosts
from polychirp.study.kernel_parts import compile_parts, parts_of
from polychirp.study.limits.size import refuse_too_large
from polychirp.study.margins import folds_of, gate_for
from polychirp.study.random_draw import sample_street
from polychirp.study.recent_results import RecentResults, recalled
from polychirp.study.reception import Reception
from polychirp.study.spec import (
    Study,
    refresh_times,
    scene_of,
    schedules_of,
    target_names,
    tracer_of,
    victim_indices,
)
from polychirp.synthesis.impairments.oscillator_errors import Oscillating
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.threads import side_by_side
from polychirp.waveform import FrameRule

Signals = tuple[IfFrame, IfParts]
MakesSignals = Callable[[], Signals]

ECHO_INSTANTS: Final = 12
"""Greatest number of instants of a frame whose echoes explain detections. Chosen: parts of a scene
are traced every 18 ms at the latest, so that in a frame of 50 ms hardly any trace is left out."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VictimResult:
    """Frame, detections, truth and score of one radar in one trial.

    ``paths`` are all paths to this radar at the refresh time that is nearest to the instant of the
    detections.

    `Trial.victim` and `StoredRun.victim` return one by the name of the radar.
    """

    name: str
    frame: IfFrame
    parts: IfParts
    paths: PropagationPaths
    detections: Detections
    truth: Truth
    score: Score
    placement: Placement


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """Scene, paths (one snapshot per refresh time) and the victims' results of one trial.

    ``frames`` has all frames of a rule that acts from frame to frame; None without such a rule. The
    victims' results are then those of its last frame.

    `run_trial` returns it.
    """

    scene: Scene
    snapshots: tuple[PropagationPaths, ...]
    victims: tuple[VictimResult, ...]
    frames: FrameHistory | None = None

    def victim(self, name: str) -> VictimResult:
        """The result of the radar called ``name``.

        Raises
        ------
        InputError
            The trial has no such victim; the message names those that it has.
        """
        for victim in self.victims:
            if victim.name == name:
                return victim
        raise InputError(no_such("victim", name, [victim.name for victim in self.victims]))


def run_trial(
    study: Study,
    *,
    names_radars: bool = True,
    traces: RecentResults | None = None,
    signals: RecentResults | None = None,
    progress: Progress = no_progress,
) -> Trial:
    """Run one trial: draw the street, trace paths, synthesize frames, detect targets, score.

    `save_run` stores the `Trial`, and `draw` draws the result of a victim.

    Parameters
    ----------
    names_radars : whether the scores name the radar of each ghost, for which the signals of the
        radars are kept or computed again, one by one
    traces : paths of earlier trials, which are used again where the street is the same
    signals : received signals of earlier trials, used again where radars and noise are too
    """
    study = sample_street(study)
    scene = scene_of(study)
    schedules = schedules_of(study)
    tracer = tracer_of(study, schedules)
    frames: FrameHistory | None = None
    refuse_too_large(study, schedules)
    victims = victim_indices(study)
    _refuse_unreadable(study, scene, schedules, victims)
    compile_parts(parts_of(study), progress=progress)
    if isinstance(study.access, FrameRule):
        last = last_frame(study, study.access, scene, traces=traces)
        schedules, frames = last.schedules, last.history
    times = refresh_times(
        [schedules[victim] for victim in victims],
        study.refresh_interval,
        least=study.least_traced_time,
    )
    street = as_traced(scene)
    trace = partial(_traced, tracer, street, times, receivers=victims, progress=progress)
    makers = (tracer, street, times, victims)
    snapshots = recalled(traces, makers, trace)

    def simulated(victim: int) -> VictimResult:
        return simulate_victim(
            study,
            scene,
            schedules,
            snapshots,
            victim=victim,
            names_radars=names_radars,
            recall=partial(
                recalled, signals, (makers, scene.radars, schedules, study.seed, victim)
            ),
        )

    simulations = [partial(simulated, victim) for victim in victims]
    results: list[VictimResult] = []
    progress("radars", 0, len(victims))
    for result in side_by_side(simulations):
        results.append(result)
        progress("radars", len(results), len(victims))
    return Trial(scene=scene, snapshots=snapshots, victims=tuple(results), frames=frames)


def _refuse_unreadable(
    study: Study, scene: Scene, schedules: Sequence[RampSchedule], victims: Sequence[int]
) -> None:
    """Refuse codes, arrays or samples that the receiver cannot read, before the tracing."""
    for victim in victims:
        code_blocks(schedules[victim])
        radar = study.radars[victim]
        receiver = receiver_for(study.receiver, schedules[victim])
        readable_elements(receiver, scene.radars[victim].array, schedules[victim])
        refuse_unsampled(receiver, schedules[victim], radar)
        refuse_unfit(
            study.receiver.mitigation,
            schedules[victim],
            times=sample_times(schedules[victim], radar.converter),
            is_real=radar.converter.is_real,
            num_channels=scene.radars[victim].array.num_channels,
        )
        if radar.converter.is_real:
            refuse_real_samples(study.receiver, schedules[victim], radar=radar.name)


def simulate_victim(
    study: Study,
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    names_radars: bool = True,
    recall: Callable[[MakesSignals], Signals] = lambda make: make(),
) -> VictimResult:
    """Frame that radar ``victim`` receives over the snapshots' paths, its detections and score.

    ``recall`` gives the frame and its parts where they are known, and else makes them.
    """
    streams = Streams(study.seed)
    reception = Reception(
        engine=Oscillating(inner=Stretch(), streams=streams),
        scene=scene,
        schedules=schedules,
        snapshots=snapshots,
        victim=victim,
    )
    frame, parts = recall(partial(reception.frame, streams, keeps=names_radars))
    return receive_and_score(
        study.receiver,
        scene,
        snapshots,
        victim=victim,
        frame=frame,
        parts=parts,
        targets=target_names(study, study.radars[victim]),
        has_occlusion="occlusion" in study.tracer.capabilities,
        reception=reception if names_radars else None,
    )


def as_traced(scene: Scene) -> Scene:
    """The scene with those properties of its radars alone that tracing reads: place and antennas.

    Studies that differ in anything else, such as waveforms, have the same paths.
    """
    radars = tuple(
        Radar(name=radar.name, mount=radar.mount, array=radar.array) for radar in scene.radars
    )
    return replace(scene, radars=radars)


def trace_frame(
    tracer: RayTracer,
    scene: Scene,
    schedules: Sequence[RampSchedule],
    *,
    refresh_interval: float,
    receivers: Sequence[int] | None = None,
    progress: Progress = no_progress,
) -> tuple[PropagationPaths, ...]:
    """Paths to ``receivers`` (numbers of radars; None: all) at the refresh times of the frames.

    ``schedules`` are those whose ramps must be covered; ``refresh_interval`` is in s.
    """
    times = refresh_times(schedules, refresh_interval)
    return _traced(tracer, scene, times, receivers=receivers, progress=progress)


def _traced(
    tracer: RayTracer,
    scene: Scene,
    times: FloatArray,
    *,
    receivers: Sequence[int] | None,
    progress: Progress,
) -> tuple[PropagationPaths, ...]:
    return interpolate_paths(
        tracer,
        scene,
        times,
        receivers=receivers,
        progress=lambda done, total: progress("ray tracing", done, total),
    )


def receive_and_score(
    receiver: AnyReceiver,
    scene: Scene,
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    frame: IfFrame,
    parts: IfParts,
    targets: Sequence[str],
    has_occlusion: bool = True,
    reception: Reception | None = None,
) -> VictimResult:
    """Detections in a frame, scored against the truth at the detections' reference time.

    ``has_occlusion`` is False if the paths come from a tracer without it: no target is hidden then.
    ``reception`` is that of the frame; without it, the score names no radars of ghosts. If
    several transmit elements are used (MIMO), a receiver that does not separate them itself needs
    the frame decoded; the result then holds the frame and the parts of the virtual array.
    """
    received = frame
    receiver = receiver_for(receiver, received.schedule)
    is_coded = received.schedule.num_elements > 1 and not decodes_elements(receiver)
    if is_coded:
        frame, parts = virtual_array(received), virtual_parts(received, parts)
    found, powers_of = attribute(receiver, frame)
    powers = powers_in(parts, powers_of)
    if is_coded:
        found = azimuths_in_motion(receiver, received, found)
    true = truth(scene.at(found.time), victim, targets, has_occlusion=has_occlusion)
    motion = phases_in_motion(received, true.range_rate) if is_coded else None
    after = target_levels(receiver, frame, parts, true, motion=motion)
    before = after
    if receiver.mitigation is not None:
        bare = replace(receiver, mitigation=None)
        before = target_levels(bare, frame, parts, true, motion=motion)
    paths = paths_at(found.time, snapshots)
    then = scene.at(paths.reference_time)
    echo_snr = body_echoes(then, paths, victim=victim, targets=targets, frame=received)
    echoes = echoes_during(received.schedule, found.time, scene, snapshots, victim=victim)
    score = compare(
        found,
        true,
        powers=powers,
        echoes=replace(echoes, folds=folds_of(receiver, received.schedule, received.array)),
        floor_rise=floor_rise(receiver, frame, parts),
        before=before,
        after=after,
        echo_snr=echo_snr,
        fluctuation=_fluctuation(scene, targets),
        gate=gate_for(receiver, received.schedule, received.times, received.array),
    )
    if reception is not None:
        decode = partial(virtual_parts, received) if is_coded else None
        radar = radars_of_ghosts(score.nature, reception, _contributions(powers_of, decode))
        score = replace(score, radar=radar)
    return VictimResult(
        name=scene.radars[victim].name,
        frame=frame,
        parts=parts,
        paths=paths.select(paths.receiver == victim),
        detections=found,
        truth=true,
        score=score,
        placement=placement(scene.at(found.time), victim, targets),
    )


def _fluctuation(scene: Scene, targets: Sequence[str]) -> FloatArray:
    """Power of the echo of every target over its mean, ``(target,)``; 1 unless it fluctuates."""
    ratio = {actor.name: actor.fluctuation for actor in scene.actors}
    return np.array([ratio[name] for name in targets])


def _contributions(
    powers_of: PartPowers, decode: Callable[[IfParts], IfParts] | None
) -> Callable[[Sequence[IfParts]], FloatArray]:
    """Function from the parts of several radars to their power in each detection, W.

    Its result has the axes ``(detection, radar, part)``. ``decode`` separates transmitting elements
    where the receiver does not.
    """

    def contributed(several: Sequence[IfParts]) -> FloatArray:
        decoded = several if decode is None else [decode(one) for one in several]
        power = powers_of(np.concatenate([one.samples for one in decoded]))
        return power.reshape(len(power), len(several), -1)

    return contributed


def paths_at(time: float, snapshots: Sequence[PropagationPaths]) -> PropagationPaths:
    """The snapshot that is nearest to a time, s."""
    return min(snapshots, key=lambda paths: abs(paths.reference_time - time))


def echoes_during(
    schedule: RampSchedule,
    time: float,
    scene: Scene,
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
) -> Echoes:
    """Echoes of radar ``victim`` during its frame, as they are at a ``time``, s (`mean_echoes`).

    They are those of the snapshots within the frame, of `ECHO_INSTANTS` at most.
    """
    begin, end = float(np.min(schedule.start_time)), float(np.max(schedule.end_time))
    during = [paths for paths in snapshots if begin <= paths.reference_time <= end]
    during = during or [paths_at(time, snapshots)]
    count = min(len(during), ECHO_INSTANTS)
    some = [during[n] for n in np.rint(np.linspace(0, len(during) - 1, count)).astype(int)]
    elapsed = np.array([time - paths.reference_time for paths in some])
    several = [echoes_of(paths, scene.at(paths.reference_time), victim) for paths in some]
    return mean_echoes(several, elapsed)
