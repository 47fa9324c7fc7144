"""Samples of one radar over one frame: the sum of the contributions of all transmitters."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame, IfParts, parts_of, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.rng import Streams
from polychirp.synthesis.base import SynthesisEngine
from polychirp.synthesis.impairments.front_end import distortion, linear_steps, sample_scale
from polychirp.synthesis.impairments.high_pass import with_lead
from polychirp.synthesis.links.interferer_culling import (
    NEGLIGIBLE_SHARE,
    AudibleRadars,
    audible_radars,
)
from polychirp.synthesis.links.leakage import LEAKAGE_PART
from polychirp.synthesis.links.thermal_noise import thermal_noise


def synthesize(
    engine: SynthesisEngine,
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    interferers: Sequence[int] | None,
    streams: Streams,
    neglected_share: float = NEGLIGIBLE_SHARE,
) -> tuple[IfFrame, IfParts]:
    """Samples of one radar over one frame, and the parts that sum to them.

    Parameters
    ----------
    schedules : one per radar of the scene, in absolute time, errors of its clock included
    snapshots : paths during the frame, in order of time; every ramp of the victim uses the
        snapshot whose reference time is nearest to the middle of the ramp
    victim : number of the radar that receives
    interferers : numbers of the radars that disturb it; None: all others
    streams : random streams; noise is drawn from ``streams["noise", name of the victim]``
    neglected_share : greatest rms of the sum of all radars that are left out, relative to the
        noise's rms (`audible_radars`); at 0 only radars without any received signal are left out

    Raises
    ------
    InputError
        A radar has no schedule, a number has no radar, an interferer is given twice or is the
        victim, snapshots are missing or unordered, or a ramp is too short for the converter.

    Examples
    --------
    A scene without paths gives noise alone:

    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor
    >>> from polychirp.synthesis.stretch.engine import Stretch
    >>> from polychirp.testing.paths import paths_of
    >>> ramps = RampSchedule(start_time=[0.0], duration=[1e-3], start_frequency=[79e9],
    ...     slope=[1e12], start_phase=[0], sweep=[0])
    >>> scene = Scene(time=0.0, actors=(Actor(name="car", kind="vehicle"),),
    ...     radars=(Radar(name="front"),), carriers=(0,))
    >>> frame, parts = synthesize(Stretch(), scene, [ramps], [paths_of()],
    ...     victim=0, interferers=None, streams=Streams(seed=1))
    >>> frame.samples.shape, bool(np.all(frame.samples == parts.noise))
    ((4, 1, 981), True)
    """
    audible = audible_interferers(
        scene,
        schedules,
        snapshots,
        victim=victim,
        interferers=interferers,
        neglected_share=neglected_share,
    )
    radar, schedule = scene.radars[victim], schedules[victim]
    times = sample_times(schedule, radar.converter)
    names = parts_of(radar)
    samples = _behind_the_filter(
        engine,
        with_lead(scene, victim),
        schedules,
        snapshots,
        victim=victim,
        interferers=audible.numbers,
        names=names,
        streams=streams,
    )
    samples = linear_steps(radar, samples, times)
    scale = sample_scale(radar)
    if "distortion" in names:
        samples[-1] = distortion(radar, samples[:-1].sum(axis=0), times)
    if scale != 1.0:
        samples *= scale
    parts = IfParts(samples=samples, names=names, neglected=scale * audible.neglected)
    frame = IfFrame(
        samples=parts.total(),
        times=times,
        schedule=schedule,
        array=radar.array,
        high_pass=radar.front_end.high_pass,
        if_filter=radar.if_filter,
    )
    return frame, parts


def audible_interferers(
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    interferers: Sequence[int] | None,
    neglected_share: float = NEGLIGIBLE_SHARE,
) -> AudibleRadars:
    """The interferers whose signals `synthesize` adds to a frame; parameters as there."""
    others = [i for i in range(len(scene.radars)) if i != victim]
    chosen = others if interferers is None else list(interferers)
    _check(scene, schedules, snapshots, victim, chosen)
    # a high-pass rings with what arrives before the first sample, with less energy than that has
    early = with_lead(scene, victim)
    counts = [
        sample_times(schedules[victim], one.radars[victim].converter).num_samples.sum()
        for one in (early, scene)
    ]
    more = math.sqrt(counts[0] / counts[1])
    # the noise of one branch has half the power of both, and the bound is on both
    share = neglected_share / math.sqrt(sample_scale(scene.radars[victim]))
    found = audible_radars(
        early, schedules, snapshots, victim=victim, interferers=chosen, share=share / more
    )
    return replace(found, neglected=more * found.neglected)


def interference_of(
    engine: SynthesisEngine,
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    transmitter: int,
) -> IfParts:
    """The parts ``direct`` and ``indirect`` that one radar contributes to the frame of another.

    The sum over all audible interferers is that of the frame's parts (`synthesize`).
    """
    radar = scene.radars[victim]
    samples = engine.contribution(
        with_lead(scene, victim), schedules, snapshots, victim=victim, transmitter=transmitter
    )
    samples = samples * np.conj(radar.array.channel_response)[:, None, None]
    times = sample_times(schedules[victim], radar.converter)
    samples = sample_scale(radar) * linear_steps(radar, samples, times)
    return IfParts(samples=samples, names=("direct", "indirect"))


def _behind_the_filter(
    engine: SynthesisEngine,
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    interferers: Sequence[int],
    names: Sequence[str],
    streams: Streams,
) -> ComplexArray:
    """Samples behind the victim's IF filter, V ``(part, channel, ramp, fast)``, for ``names``."""
    radar, schedule = scene.radars[victim], schedules[victim]
    times = sample_times(schedule, radar.converter)
    samples = np.zeros(
        (len(names), radar.array.num_channels, schedule.num_ramps, times.most_samples),
        dtype=np.complex128,
    )
    own = engine.contribution(scene, schedules, snapshots, victim=victim, transmitter=victim)
    samples[0:2] = own[0:2]
    if "leakage" in names:
        samples[names.index("leakage")] = own[LEAKAGE_PART]
    for transmitter in interferers:
        samples[2:4] += engine.contribution(
            scene, schedules, snapshots, victim=victim, transmitter=transmitter
        )
    samples[4] = thermal_noise(radar, times, streams["noise", radar.name])
    # the mixer conjugates the received signal, and with it the channel's complex gain error, which
    # scales the noise as well
    samples *= np.conj(radar.array.channel_response)[:, None, None]
    return samples


def _check(
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    victim: int,
    interferers: Sequence[int],
) -> None:
    radars = range(len(scene.radars))
    if len(schedules) != len(radars):
        raise InputError(
            f"{len(schedules)} schedules for {len(radars)} radars; give every radar its own"
        )
    for number in (victim, *interferers):
        if number not in radars:
            raise InputError(f"there is no radar {number}; the scene has 0 to {len(radars) - 1}")
    if victim in interferers or len(set(interferers)) < len(interferers):
        raise InputError("interferers are other radars than the victim, each named once")
    moments = [paths.reference_time for paths in snapshots]
    if not moments or moments != sorted(moments):
        raise InputError("synthesis needs one snapshot of paths or more, in order of time")
