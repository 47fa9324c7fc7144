"""Effects of hardware impairments on scenario C of the paper, direct interference."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from polychirp.model.antenna import ArrayErrors
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.front_end import Digitiser, FrontEnd, GainControl, HighPass, IqImbalance
from polychirp.model.leakage import Bumper, Leakage
from polychirp.model.oscillator import Oscillator, PhaseNoise, QuadraticError
from polychirp.model.paths import PropagationPaths
from polychirp.scoring.causes import MADE_BY_RADARS
from polychirp.study.paper.results import WaveformKind
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import Study, StudyRadar, scene_of, schedules_of
from polychirp.study.trial import VictimResult, simulate_victim, trace_frame
from polychirp.units import from_db, to_db

VICTIM: Final = "vehicle-2"
INTERFERER: Final = "vehicle-4"

WAVEFORMS: Final[tuple[WaveformKind, ...]] = ("conventional", "diverse")

Impair = Callable[[StudyRadar], StudyRadar]

_NOISY_OSCILLATOR: Final = Oscillator(phase_noise=PhaseNoise())


def _digitised(full_scale_dbm: float, bits: int, control: GainControl | None = None) -> FrontEnd:
    full_scale = from_db(full_scale_dbm - 30.0)
    return FrontEnd(digitiser=Digitiser(full_scale=full_scale, bits=bits, gain_control=control))


def _clock(*, start_time: float = 0.0, clock_offset: float = 0.0) -> Impair:
    """A change of the clock of the interferer alone, since only the difference matters."""

    def impair(radar: StudyRadar) -> StudyRadar:
        if radar.name != INTERFERER:
            return radar
        return replace(radar, start_time=start_time, clock_offset=clock_offset)

    return impair


def _with_leakage(
    radar: StudyRadar, *, oscillator: Oscillator | None = None, high_pass: HighPass | None = None
) -> StudyRadar:
    return replace(
        radar,
        leakage=(Leakage(isolation=from_db(35.0)),),
        bumper=Bumper(distance=0.1, reflection=from_db(-15.0)),
        oscillator=oscillator or Oscillator(),
        front_end=FrontEnd(high_pass=high_pass),
    )


IMPAIRMENTS: Final[Mapping[str, Impair]] = {
    "none": lambda radar: radar,
    "phase noise, −93 dBc/Hz at 1 MHz": lambda radar: replace(radar, oscillator=_NOISY_OSCILLATOR),
    "ramps bowed by 1 MHz": lambda radar: replace(
        radar, oscillator=Oscillator(ramp_error=QuadraticError(peak=1e6))
    ),
    "interferer starts 20 ns late": _clock(start_time=20e-9),
    "interferer starts 1 µs late": _clock(start_time=1e-6),
    "interferer's clock 0.1 ppm fast": _clock(clock_offset=1e-7),
    "interferer's clock 20 ppm fast": _clock(clock_offset=2e-5),
    "leakage −35 dB, bumper −15 dB at 10 cm": _with_leakage,
    "the same with phase noise": lambda radar: _with_leakage(radar, oscillator=_NOISY_OSCILLATOR),
    "the same behind a high-pass of 2 × 50 kHz": lambda radar: _with_leakage(
        radar, high_pass=HighPass(corners=(50e3, 50e3))
    ),
    "I/Q: 1 dB, 5°": lambda radar: replace(
        radar,
        front_end=FrontEnd(imbalance=IqImbalance(gain=from_db(1.0), phase=math.radians(5.0))),
    ),
    "channels: 1 dB, 10° rms": lambda radar: replace(
        radar, array_errors=ArrayErrors(gain=from_db(1.0), phase=math.radians(10.0))
    ),
    "12 bits, full scale 0 dBm": lambda radar: replace(radar, front_end=_digitised(0.0, 12)),
    "12 bits, full scale −20 dBm": lambda radar: replace(radar, front_end=_digitised(-20.0, 12)),
    "8 bits, full scale 0 dBm": lambda radar: replace(radar, front_end=_digitised(0.0, 8)),
    "8 bits, gain control": lambda radar: replace(
        radar, front_end=_digitised(0.0, 8, GainControl())
    ),
}
"""Change of every radar of the scene, by the name of the impairment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImpairedRow:
    """Result of the victim with one impairment and one waveform, radars synchronous.

    Parameters
    ----------
    impairment, waveform : names
    ghosts : range in m, and power relative to the strongest target in dB, of each false detection
        from interference or the front end, strongest first
    floor_rise_db : rise of the range spectra over thermal noise
    missed : number of targets that were missed
    others : number of other false detections
    """

    impairment: str
    waveform: str
    ghosts: tuple[tuple[float, float], ...]
    floor_rise_db: float
    missed: int
    others: int


def compare_impairments(
    *, names: Sequence[str] = tuple(IMPAIRMENTS), seed: int = 1, progress: Progress = no_progress
) -> tuple[ImpairedRow, ...]:
    """Scenario C with each impairment on its own, for both of the paper's waveforms.

    Paths, noise and ramps are the same for all.
    """
    rows = []
    for waveform in WAVEFORMS:
        ideal = paper_study(waveform, radars=(VICTIM, INTERFERER), seed=seed)
        snapshots = trace_frame(
            ideal.tracer,
            scene_of(ideal),
            schedules_of(ideal),
            refresh_interval=ideal.refresh_interval,
            progress=progress,
        )
        for number, name in enumerate(names):
            progress(f"impairments, {waveform}", number, len(names))
            rows.append(_row(name, waveform, _victim_result(_impaired(ideal, name), snapshots)))
        progress(f"impairments, {waveform}", len(names), len(names))
    return tuple(rows)


def _impaired(study: Study, name: str) -> Study:
    return replace(study, radars=tuple(IMPAIRMENTS[name](radar) for radar in study.radars))


def _victim_result(study: Study, snapshots: Sequence[PropagationPaths]) -> VictimResult:
    """Result of the victim on paths that are traced once, since they do not contain radars."""
    scene = scene_of(study)
    victim = scene.radar_index(VICTIM)
    return simulate_victim(study, scene, schedules_of(study), snapshots, victim=victim)


def _row(name: str, waveform: str, seen: VictimResult) -> ImpairedRow:
    found, score = seen.detections, seen.score
    targets = [float(found.power[n]) for n in score.target_detection]
    strongest = max(targets, default=math.nan)

    def ghosts() -> Iterator[tuple[float, float]]:
        for n in sorted(score.ghosts, key=lambda n: -found.power[n]):
            if score.nature[n] in MADE_BY_RADARS:
                yield float(found.range[n]), float(to_db(found.power[n] / strongest))

    return ImpairedRow(
        impairment=name,
        waveform=waveform,
        ghosts=tuple(ghosts()),
        floor_rise_db=float(to_db(score.floor_rise)),
        missed=score.num_missed,
        others=sum(score.nature[n] not in MADE_BY_RADARS for n in score.ghosts),
    )
