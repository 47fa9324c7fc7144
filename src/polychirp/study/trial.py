"""One trial: the only place that calls the stages in order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from polychirp.channel.base import RayTracer
from polychirp.channel.scene.ground_truth import truth
from polychirp.channel.tracers.path_interpolation import interpolate_paths
from polychirp.errors import InputError, no_such
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.model.score import Score
from polychirp.model.truth import Truth
from polychirp.receiver.attribution import floor_rise, part_powers
from polychirp.receiver.chain import Receiver
from polychirp.receiver.mimo import (
    azimuths_in_motion,
    code_blocks,
    virtual_array,
    virtual_parts,
)
from polychirp.rng import Streams
from polychirp.scoring.compare import compare
from polychirp.study.kernel_parts import compile_parts, parts_of
from polychirp.study.random_draw import drawn
from polychirp.study.size import refuse_too_large
from polychirp.study.spec import (
    Study,
    refresh_times,
    scene_of,
    schedules,
    target_names,
    victim_indices,
)
from polychirp.synthesis.impairments.oscillator_errors import Oscillating
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.threads import side_by_side

Progress = Callable[[str, int, int], None]
"""Told what is being done, how many steps of it are done, and of how many."""


def silent(what: str, done: int, total: int) -> None:
    """Tell nobody."""
    del what, done, total


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Victim:
    """What one radar heard, claimed, and what was there."""

    name: str
    frame: IfFrame
    parts: IfParts
    detections: Detections
    truth: Truth
    score: Score


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """All that one run of a study gives."""

    scene: Scene
    snapshots: tuple[PropagationPaths, ...]
    victims: tuple[Victim, ...]

    def victim(self, name: str) -> Victim:
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


def run_trial(study: Study, *, progress: Progress = silent) -> Trial:
    """Run a study once: traffic, scene, ramps, paths, samples, detections, score."""
    study = drawn(study)
    scene = scene_of(study)
    plans = schedules(study)
    refuse_too_large(study, plans)
    for number in victim_indices(study):
        code_blocks(plans[number])  # a code that cannot be told apart is refused before the work
    compile_parts(parts_of(study), progress=progress)
    snapshots = trace_frame(
        study.tracer,
        scene,
        [plans[i] for i in victim_indices(study)],
        refresh_interval=study.refresh_interval,
        receivers=victim_indices(study),
        progress=progress,
    )
    victims: list[Victim] = []
    listening = [
        partial(heard, study, scene, plans, snapshots, victim=victim)
        for victim in victim_indices(study)
    ]
    progress("radars", 0, len(listening))
    for victim in side_by_side(listening):
        victims.append(victim)
        progress("radars", len(victims), len(listening))
    return Trial(scene=scene, snapshots=snapshots, victims=tuple(victims))


def heard(
    study: Study,
    scene: Scene,
    plans: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
) -> Victim:
    """What one radar hears by these paths, and makes of it."""
    streams = Streams(study.seed)
    frame, parts = synthesize(
        Oscillating(inner=Stretch(), streams=streams),
        scene,
        plans,
        snapshots,
        victim=victim,
        interferers=None,
        streams=streams,
    )
    return judged(
        study.receiver,
        scene,
        snapshots,
        victim=victim,
        frame=frame,
        parts=parts,
        targets=target_names(study, study.radars[victim]),
    )


def trace_frame(
    tracer: RayTracer,
    scene: Scene,
    plans: Sequence[RampSchedule],
    *,
    refresh_interval: float,
    receivers: Sequence[int] | None = None,
    progress: Progress = silent,
) -> tuple[PropagationPaths, ...]:
    """Paths to ``receivers`` (None: all) all through the frames of ``plans``, at every interval."""
    return interpolate_paths(
        tracer,
        scene,
        refresh_times(plans, refresh_interval),
        receivers=receivers,
        progress=lambda done, total: progress("ray tracing", done, total),
    )


def judged(
    receiver: Receiver,
    scene: Scene,
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    frame: IfFrame,
    parts: IfParts,
    targets: Sequence[str],
) -> Victim:
    """What the receiver makes of a frame, scored against the truth at the time it refers to.

    A frame from several transmitting elements is decoded first: it is the virtual array's frame
    and parts that the victim gets.
    """
    received = frame
    if received.schedule.num_elements > 1:
        frame, parts = virtual_array(received), virtual_parts(received, parts)
    found = receiver.detect(frame)
    powers = part_powers(receiver, frame, parts, found)
    if received.schedule.num_elements > 1:
        found = azimuths_in_motion(receiver, received, found)
    seen = truth(scene.at(found.time), victim, targets)
    nearest = min(snapshots, key=lambda paths: abs(paths.reference_time - found.time))
    own = (nearest.transmitter == victim) & (nearest.receiver == victim)
    score = compare(
        found,
        seen,
        powers=powers,
        own_paths=nearest.select(own),
        floor_rise=floor_rise(receiver, frame, parts),
    )
    return Victim(
        name=scene.radars[victim].name,
        frame=frame,
        parts=parts,
        detections=found,
        truth=seen,
        score=score,
    )
