"""Spectra and maps of a study at once, and its detections a little later."""

import threading
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import ModelWarning
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.model.spectra import RangePower, RangeRateMap, Spectrogram
from polychirp.receiver.overview.range_rate import range_rate_map
from polychirp.receiver.overview.spectrogram import spectrogram
from polychirp.receiver.selection import receiver_for
from polychirp.rng import Streams
from polychirp.study.check import check
from polychirp.study.kernel_parts import compile_parts, parts_of
from polychirp.study.reception import Reception
from polychirp.study.spec import Study, scene_of, schedules_of, target_names, tracer_of
from polychirp.study.trial import VictimResult, receive_and_score, trace_frame
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch

PROFILES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("echo", ("echo", "multipath")),
    ("interference", ("direct", "indirect")),
    ("noise", ("noise",)),
)
"""Curves of the range profile besides that of all samples, and the parts of each."""


class Stopped(Exception):  # noqa: N818 -- no error
    """The user has stopped a full trace."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """The first view of a study, before anything is detected.

    Parameters
    ----------
    study, scene, snapshots : what was simulated
    frame, parts : samples of the victim
    profiles : power over range by name: "all" and those of `PROFILES`
    map : power over range and range rate of all samples, after mitigation
    spectrogram : of all samples of the first channel, before mitigation
    seconds : time that all this took
    """

    study: Study
    scene: Scene
    snapshots: tuple[PropagationPaths, ...]
    frame: IfFrame
    parts: IfParts
    profiles: Mapping[str, RangePower]
    map: RangeRateMap
    spectrogram: Spectrogram
    seconds: float


def look_at(study: Study, *, progress: Progress = no_progress) -> Look:
    """Trace and synthesize a frame of the study's first victim, and make its spectra and maps."""
    compile_parts(parts_of(study), progress=progress)
    begin = time.perf_counter()
    scene, schedules = scene_of(study), schedules_of(study)
    snapshots = trace_frame(
        tracer_of(study, schedules),
        scene,
        schedules[:1],
        refresh_interval=study.refresh_interval,
        receivers=(0,),
        progress=progress,
    )
    frame, parts = synthesize(
        Stretch(),
        scene,
        schedules,
        snapshots,
        victim=0,
        interferers=None,
        streams=Streams(study.seed),
    )
    receiver = receiver_for(study.receiver, frame.schedule)
    plain = replace(receiver, mitigation=None)
    whole = range_rate_map(receiver, frame)
    profiles = {"all": _profile(whole)}
    for name, members in PROFILES:
        part = parts.total(*members)
        if np.any(part):
            profiles[name] = _profile(range_rate_map(plain, frame.with_samples(part)))
    return Look(
        study=study,
        scene=scene,
        snapshots=snapshots,
        frame=frame,
        parts=parts,
        profiles=profiles,
        map=whole,
        spectrogram=spectrogram(plain, frame),
        seconds=time.perf_counter() - begin,
    )


def _profile(map_: RangeRateMap) -> RangePower:
    return RangePower(power=map_.power.max(axis=0), range=map_.range)


def detections_in(look: Look) -> VictimResult:
    """Detections of a look, with their causes."""
    return receive_and_score(
        look.study.receiver,
        look.scene,
        look.snapshots,
        victim=0,
        frame=look.frame,
        parts=look.parts,
        targets=target_names(look.study, look.study.radars[0]),
        has_occlusion="occlusion" in look.study.tracer.capabilities,
        reception=Reception(
            engine=Stretch(),
            scene=look.scene,
            schedules=schedules_of(look.study),
            snapshots=look.snapshots,
            victim=0,
        ),
    )


def notes_on(study: Study) -> tuple[str, ...]:
    """Limits of the models that a study exceeds, one sentence each.

    A `PolychirpError` is raised if the study cannot be run, which says why.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ModelWarning)
        check(study)
    return tuple(dict.fromkeys(str(warning.message) for warning in caught))


def strongest_paths(look: Look, count: int) -> list[tuple[str, FloatArray]]:
    """Kind and points ``(point, xyz)``, m, of the strongest paths to the victim.

    The kinds are "echo", "direct" and "indirect".
    """
    paths = look.snapshots[0]
    paths = paths.select(paths.receiver == 0)
    power = np.sum(np.abs(paths.transfer) ** 2, axis=(1, 2))
    places = look.scene.radar_position
    found: list[tuple[str, FloatArray]] = []
    for kind, mask in _kinds(paths).items():
        numbers = np.flatnonzero(mask)
        for n in numbers[np.argsort(-power[numbers], kind="stable")[:count]]:
            bounces = paths.bounce_point[paths.bounce_start[n] : paths.bounce_start[n + 1]]
            ends = places[paths.transmitter[n]], places[paths.receiver[n]]
            found.append((kind, np.vstack([ends[0], bounces, ends[1]])))
    return found


def _kinds(paths: PropagationPaths) -> dict[str, Sequence[bool]]:
    is_own = paths.transmitter == paths.receiver
    return {
        "echo": is_own,
        "direct": ~is_own & paths.is_direct,
        "indirect": ~is_own & ~paths.is_direct,
    }


class Stop:
    """A button that stops a full trace: it is pressed in one thread and noticed in another."""

    def __init__(self) -> None:
        self._pressed = threading.Event()

    def press(self) -> None:
        """Ask for a stop."""
        self._pressed.set()

    def noticed_by(self, show: Progress) -> Progress:
        """A progress function that calls ``show``, and raises `Stopped` once it is pressed."""

        def shown(what: str, done: int, total: int) -> None:
            if self._pressed.is_set():
                raise Stopped
            show(what, done, total)

        return shown
