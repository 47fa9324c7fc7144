"""Frames of a drawn road with other radars, with the true IF filter of the production engine.

Bodies are points in free space, so that a frame takes fractions of a second. A study file gives
frames of traced streets instead: `frame_of_study`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.channel.scene.ground_truth import truth
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Converter
from polychirp.model.ramp import RampSchedule
from polychirp.model.truth import Truth
from polychirp.rng import Streams
from polychirp.study.random_draw import sample_street
from polychirp.study.spec import (
    Study,
    StudyRadar,
    scene_of,
    schedules_of,
    target_names,
    tracer_of,
    victim_indices,
)
from polychirp.study.trial import paths_at, trace_frame
from polychirp.synthesis.impairments.front_end import undisturbed
from polychirp.synthesis.impairments.oscillator_errors import Oscillating
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.units import from_db
from polychirp.waveform import Sawtooth


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadKind:
    """Radars of a drawn road.

    Parameters
    ----------
    interferers : number of other radars, all oncoming
    ratios : least and greatest slope of an interferer over that of the victim
    idle : least and greatest time, s, by which their idle time exceeds that of the victim, so that
        a crossing moves from ramp to ramp
    kept : part of the interference that stays in the frame; None for all
    sampling : of the victim's converter
    """

    interferers: int = 1
    ratios: tuple[float, float] = (0.5, 0.8)
    idle: tuple[float, float] = (0.0, 0.2e-6)
    kept: Literal["direct", "indirect"] | None = None
    sampling: Literal["complex", "real"] = "complex"


ROADS: Final[Mapping[str, RoadKind]] = {
    "direct": RoadKind(kept="direct"),
    "indirect": RoadKind(kept="indirect"),
    "near-parallel": RoadKind(ratios=(0.96, 0.985), idle=(0.0, 0.0)),
    "many": RoadKind(interferers=6, ratios=(0.4, 1.6)),
    "real-mixer": RoadKind(sampling="real"),
}
"""Kinds of roads by name. Bursts of "near-parallel" last more than half a ramp: the band of
±10 MHz is crossed within 20 MHz over 1.5 to 4 % of 20 MHz/µs, 25 to 67 µs, or what the ramp has."""


FREQUENCY_OF_SETS: Final = 79e9
"""Frequency, Hz, at which the frames of the benchmark's sets are traced. Their versions are fixed,
whatever tracers do without a frequency."""

_MOUNT: Final = Pose(x=2.0, z=0.5)


def road_frame(streams: Streams, kind: RoadKind) -> tuple[IfFrame, IfParts]:
    """A frame of 64 chirps of 20 µs and 256 samples on four channels, and its parts.

    Chosen: 400 MHz in 20 µs at 20 MS/s show 75 m; six points of 0 to 15 dBsm stand at 6 to 60 m,
    radars drive 12 m ahead and more; 0 dBm and a noise figure of 13 dB.
    """
    study = road_study(streams, kind)
    return kept_interference(*frame_of_study(study)[:2], kind.kept)


def kept_interference(
    frame: IfFrame, parts: IfParts, kept: Literal["direct", "indirect"] | None
) -> tuple[IfFrame, IfParts]:
    """The frame with one part of the interference alone; None: with all of it."""
    if kept is None:
        return frame, parts
    lost = {"direct", "indirect"} - {kept}
    keep = [n for n, name in enumerate(parts.names) if name not in lost]
    few = replace(parts, samples=parts.samples[keep], names=tuple(parts.names[n] for n in keep))
    return frame.with_samples(few.total()), few


def road_study(streams: Streams, kind: RoadKind) -> Study:
    """The drawn road as a study, whose first radar is the victim."""
    random = streams["road"]
    bandwidth, duration = 400e6, 20e-6
    points = tuple(
        Point(
            name=f"point {n}",
            x=float(random.uniform(6.0, 60.0)),
            y=float(random.uniform(-6.0, 6.0)),
            z=0.5,
            rcs=float(10.0 ** random.uniform(0.0, 1.5)),
        )
        for n in range(6)
    )
    vehicles = [Vehicle(name="ego", x=0.0, y=0.0, speed=float(random.uniform(0.0, 20.0)))]
    radars = [road_radar("victim", "ego", bandwidth, duration, sampling=kind.sampling)]
    for n in range(kind.interferers):
        name = f"car {n}"
        vehicles.append(
            Vehicle(
                name=name,
                x=float(12.0 + 14.0 * n + random.uniform(0.0, 8.0)),
                y=float(random.uniform(3.0, 4.0)),
                heading=np.pi,
                speed=float(random.uniform(0.0, 20.0)),
            )
        )
        ratio = float(random.uniform(*kind.ratios))
        # both frequencies are equal at this time into the victim's first ramp
        crossing = float(random.uniform(5e-6, 16e-6))
        other = road_radar(
            f"radar {n}",
            name,
            ratio * bandwidth,
            duration,
            start_frequency=77e9 + bandwidth / duration * (1.0 - ratio) * crossing,
            idle=5e-6 + float(random.uniform(*kind.idle)),
        )
        radars.append(replace(other, num_sweeps=64))
    return Study(
        name="road",
        seed=int(random.integers(2**31)),
        num_sweeps=64,
        street=Street(vehicles=tuple(vehicles), points=points),
        radars=tuple(radars),
        victims=("victim",),
        targets=tuple(point.name for point in points),
        tracer=FreeSpace(frequency=FREQUENCY_OF_SETS),
    )


def road_radar(
    name: str,
    vehicle: str,
    bandwidth: float,
    duration: float,
    *,
    start_frequency: float = 77e9,
    idle: float = 5e-6,
    sampling: Literal["complex", "real"] = "complex",
    mount: Pose = _MOUNT,
) -> StudyRadar:
    """A radar of four channels and 20 MS/s, whose filter ends at 10 MHz."""
    return StudyRadar(
        name=name,
        vehicle=vehicle,
        mount=mount,
        array=AntennaArray(num_channels=4),
        transmit_power=1e-3,
        transmit_gain=1.0,
        noise_figure=from_db(13.0),
        if_filter=IfFilter(passband=9e6, stopband=10e6),
        converter=Converter(sample_rate=20e6, start=4e-6, margin=3e-6, sampling=sampling),
        waveform=Sawtooth(
            start_frequency=start_frequency,
            bandwidth=bandwidth,
            ramp_duration=duration,
            idle=idle,
        ),
    )


class StudyFrame(NamedTuple):
    """A frame of a study with its parts, the truth in its middle, and the paths to its radar.

    ``others`` are the schedules of the other radars by their number. ``clean`` are the samples
    without them, V ``(channel, ramp, fast)``, with the digitiser's errors that they would have.
    """

    frame: IfFrame
    parts: IfParts
    truth: Truth
    paths: PropagationPaths
    others: dict[int, RampSchedule]
    clean: ComplexArray


def frame_of_study(study: Study, *, victim: int | None = None) -> StudyFrame:
    """Frame of a victim of a study, by number; None: the first one.

    The street is drawn from the study's seed. Paths are those of the snapshot that is nearest to
    the middle of the frame.
    """
    study = sample_street(study)
    scene, schedules = scene_of(study), schedules_of(study)
    number = victim_indices(study)[0] if victim is None else victim
    own = schedules[number]
    streams = Streams(study.seed)
    snapshots = trace_frame(
        tracer_of(study, schedules),
        scene,
        [own],
        refresh_interval=study.refresh_interval,
        receivers=[number],
    )
    frame, parts = synthesize(
        Oscillating(inner=Stretch(), streams=streams),
        scene,
        schedules,
        snapshots,
        victim=number,
        interferers=None,
        streams=streams,
    )
    middle = float(0.5 * (own.start_time.min() + own.end_time.max()))
    true = truth(
        scene.at(middle),
        number,
        target_names(study, study.radars[number]),
        has_occlusion="occlusion" in study.tracer.capabilities,
    )
    paths = paths_at(middle, snapshots)
    others = {n: one for n, one in enumerate(schedules) if n != number}
    radar = scene.radars[number]
    clean = frame.samples - parts.interference
    if radar.front_end.digitiser is not None:
        clean = undisturbed(radar, parts, frame.times)
    return StudyFrame(frame, parts, true, paths.select(paths.receiver == number), others, clean)
