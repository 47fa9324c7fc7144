"""Scenarios A, B and C of the paper: their cases, and the rows of their tables."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Final, get_args

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.scene.ground_truth import truth
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.detection import Detections
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver, mean_threshold
from polychirp.receiver.attribution import detected
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.mitigation.blanking import Blanking
from polychirp.receiver.overview.pooling import group_means, pooled
from polychirp.receiver.overview.range_rate import range_rate_map
from polychirp.receiver.overview.range_response import range_response
from polychirp.receiver.selection import FrameReceiver
from polychirp.rng import Streams
from polychirp.scoring.causes import causes
from polychirp.study.kernel_parts import OF_PAPER, compile_parts
from polychirp.study.margins import gate_for
from polychirp.study.paper.results import (
    Antenna,
    GhostKind,
    GhostRow,
    Mitigation,
    PaperResults,
    PaperRow,
    RowMap,
    Scenario,
    TargetRow,
    WaveformKind,
    paper_claims,
)
from polychirp.study.provenance import versions
from polychirp.study.reception import Reception
from polychirp.study.section_v.cases import run_correlation
from polychirp.study.spec import Study, StudyRadar, scene_of, schedules_of, tracer_of
from polychirp.study.trial import VictimResult, echoes_during, receive_and_score, trace_frame
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.threads import side_by_side
from polychirp.traffic.paper import paper_mounts, paper_street
from polychirp.units import from_db, to_db
from polychirp.waveform import AnyWaveform, DiverseTriangular, FixedTriangular, Triangular

WAVEFORMS: Final[dict[WaveformKind, AnyWaveform]] = {
    "conventional": Triangular(bandwidth=1e9, ramp_duration=1e-3),
    "diverse": DiverseTriangular(),
    "fixed-per-radar": FixedTriangular(),
}
"""The two waveforms of the paper, and one fixed slope for each radar as a fair comparison.

The conventional one has the shortest ramp and the widest band of table 2. With equal slopes, up-
and down-beats of different echoes pair by chance; the steepest slope, whose range-Doppler coupling
is least, gives the fewest such pairs.
"""

TARGETS_OF_RADAR: Final = {
    "vehicle-1": ("target-4", "target-3"),
    "vehicle-2": ("target-2", "vehicle-4"),
    "vehicle-3": ("target-3", "target-4"),
    "vehicle-4": ("vehicle-2", "target-2"),
}
"""Names of the two targets of each radar."""

GREATEST_CLOCK_OFFSET: Final = 20e-6
"""Greatest relative clock error of interferers that are not synchronous; chosen: a crystal's."""

GHOST_EXTENT: Final = (1.0, 2.0)
"""Differences of range, m, and range rate, m/s, below which two ghosts of one kind count as one;
chosen, as for echoes of one body."""

MAP_CELLS: Final = (150, 200)
"""Greatest numbers of cells of a row's map along range rate and range; chosen: the page of the
report draws it with two to four pixels per cell, and all maps have some 2 MB."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One frame of one victim, before it is simulated."""

    scenario: Scenario
    victim: str
    interferers: tuple[str, ...]
    waveform: WaveformKind
    synchronous: bool = True
    mitigation: Mitigation = "none"
    antenna: Antenna = "table 2"


def paper_cases() -> Iterator[Case]:
    """Variants of scenarios A, B and C; radar 2 in A and C with another antenna; all radars on."""
    pairs: list[tuple[Scenario, str, tuple[str, ...]]] = [
        ("A", "vehicle-1", ()),
        ("A", "vehicle-2", ()),
        ("B", "vehicle-1", ("vehicle-3",)),
        ("C", "vehicle-2", ("vehicle-4",)),
    ]
    mitigations: tuple[Mitigation, ...] = ("none", "blanking")

    def case(pair: tuple[Scenario, str, tuple[str, ...]], waveform: WaveformKind) -> Case:
        scenario, victim, interferers = pair
        return Case(scenario=scenario, victim=victim, interferers=interferers, waveform=waveform)

    for pair, synchronous, waveform, mitigation in product(
        pairs, (True, False), WAVEFORMS, mitigations
    ):
        yield replace(case(pair, waveform), synchronous=synchronous, mitigation=mitigation)
    both: tuple[WaveformKind, ...] = ("conventional", "diverse")
    for pair, waveform in product((pairs[1], pairs[3]), both):
        yield replace(case(pair, waveform), antenna="consistent")
    radars = tuple(TARGETS_OF_RADAR)
    for waveform, victim in product(both, radars):
        yield case(("all", victim, tuple(name for name in radars if name != victim)), waveform)


def paper_study(
    waveform: WaveformKind,
    *,
    synchronous: bool = True,
    radars: Sequence[str] = tuple(TARGETS_OF_RADAR),
    seed: int = 1,
) -> Study:
    """The paper's street with some of its radars, as a study that can be run or written to a file.

    If not ``synchronous``, the interferers (radars 3 and 4) start at random between 0 and 3 ms, and
    their clocks have errors; radars 1 and 2 start at 0 without errors. The targets of all radars
    are targets of the study; a target that a radar cannot see does not count as missed.
    `InputError` is raised if the street has no such radar, or there is no such waveform.

    >>> study = paper_study("diverse", radars=("vehicle-2", "vehicle-4"))
    >>> study.name, len(study.radars), study.targets
    ('paper-diverse', 2, ('target-2', 'vehicle-4', 'vehicle-2'))
    """
    mounts = paper_mounts()
    unknown = sorted(set(radars) - set(mounts))
    if unknown:
        raise InputError(f"the street has no radar '{unknown[0]}'; it has {', '.join(mounts)}")
    if waveform not in WAVEFORMS:
        raise InputError(f"there is no waveform '{waveform}'; choose among {', '.join(WAVEFORMS)}")
    return Study(
        name=f"paper-{waveform}",
        seed=seed,
        street=paper_street(),
        radars=tuple(
            _radar(name, mounts[name], WAVEFORMS[waveform], synchronous=synchronous, seed=seed)
            for name in radars
        ),
        targets=tuple(dict.fromkeys(one for name in radars for one in TARGETS_OF_RADAR[name])),
        refresh_interval=1e-3,
    )


def _radar(
    name: str, mount: tuple[str, Pose], waveform: AnyWaveform, *, synchronous: bool, seed: int
) -> StudyRadar:
    vehicle, pose = mount
    keeps_time = synchronous or name in ("vehicle-1", "vehicle-2")
    draw = Streams(seed)["timing", name]
    # the only draws from this stream, made for synchronous radars too
    start_time, clock_offset = draw.uniform(0.0, 3e-3), draw.uniform(-1.0, 1.0)
    return StudyRadar(
        name=name,
        vehicle=vehicle,
        mount=pose,
        waveform=waveform,
        start_time=0.0 if keeps_time else start_time,
        clock_offset=0.0 if keeps_time else clock_offset * GREATEST_CLOCK_OFFSET,
    )


def with_consistent_antennas(scene: Scene) -> Scene:
    """The scene with the antenna gain that the beam allows, 11 dBi instead of 27 (errata 9).

    Paths do not contain antennas, so they need not be traced again.
    """
    radars = [
        replace(
            radar,
            array=replace(
                radar.array, pattern=replace(radar.array.pattern, peak_gain=from_db(11.0))
            ),
        )
        for radar in scene.radars
    ]
    return replace(scene, radars=tuple(radars))


def run_paper(
    *,
    seed: int = 1,
    progress: Progress = no_progress,
    show: Callable[[PaperRow], None] = lambda _row: None,
) -> PaperResults:
    """Run every case of the paper on one street, with the same paths and noise for all.

    ``show`` is called with each of the paper's own cases as soon as it is computed.

    `paper_study` gives one of its scenarios as a study.
    """
    compile_parts(OF_PAPER, progress=progress)
    started = time.perf_counter()
    studies = {
        (waveform, synchronous): paper_study(waveform, synchronous=synchronous, seed=seed)
        for waveform, synchronous in product(WAVEFORMS, (True, False))
    }
    schedules = {key: schedules_of(study) for key, study in studies.items()}
    first = studies["conventional", True]
    scene = scene_of(first)
    snapshots = trace_frame(
        tracer_of(first, schedules["conventional", True]),
        scene,
        [schedule for some in schedules.values() for schedule in some],
        refresh_interval=first.refresh_interval,
        progress=progress,
    )
    rows = _case_rows(scene, schedules, snapshots, seed=seed, progress=progress, show=show)
    correlation = run_correlation(seed=seed, progress=progress)
    tables = _tables(rows)
    return PaperResults(
        seed=seed,
        versions=versions(),
        wall_time_s=time.perf_counter() - started,
        rows=tables["rows"],
        everyone=tables["everyone"],
        consistent=tables["consistent"],
        claims=paper_claims(radar_1="vehicle-1", radar_2="vehicle-2"),
        conventional=schedules["conventional", True][0],
        diverse=schedules["diverse", True][0],
        scene=scene,
        notes=_NOTES,
        correlation=correlation,
    )


def _case_rows(
    scene: Scene,
    schedules: Mapping[tuple[WaveformKind, bool], Sequence[RampSchedule]],
    snapshots: Sequence[PropagationPaths],
    *,
    seed: int,
    progress: Progress,
    show: Callable[[PaperRow], None],
) -> dict[Case, PaperRow]:
    """Row of every case, on the same paths."""
    cases = list(paper_cases())

    def equivalent(case: Case) -> Case:
        """The synchronous case with the same row, if there is no interferer; else ``case``."""
        same = replace(case, synchronous=True)
        return case if case.interferers or same not in cases else same

    distinct = sorted(dict.fromkeys(equivalent(case) for case in cases), key=_is_variant)
    rows: dict[Case, PaperRow] = {}
    made = side_by_side(
        [
            partial(
                _case_row, case, scene, schedules[case.waveform, case.synchronous], snapshots, seed
            )
            for case in distinct
        ]
    )
    progress("radars", 0, len(distinct))
    for case, row in zip(distinct, made, strict=True):
        rows[case] = row
        if not _is_variant(case):
            show(row)
        progress("radars", len(rows), len(distinct))
    return {case: replace(rows[equivalent(case)], synchronous=case.synchronous) for case in cases}


def _is_variant(case: Case) -> bool:
    """False for the cases that the paper shows, and for the same with one slope per radar."""
    is_whole_street = case.scenario == "all"
    is_changed = case.mitigation != "none" or case.antenna != "table 2"
    return is_whole_street or is_changed or not case.synchronous


def _case_row(
    case: Case,
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    seed: int,
) -> PaperRow:
    victim = scene.radar_index(case.victim)
    receiver = CoherentReceiver(mitigation=Blanking() if case.mitigation == "blanking" else None)
    reception = Reception(
        engine=Stretch(),
        scene=scene if case.antenna == "table 2" else with_consistent_antennas(scene),
        schedules=schedules,
        snapshots=snapshots,
        victim=victim,
        interferers=[scene.radar_index(name) for name in case.interferers],
    )
    frame, parts = reception.frame(Streams(seed))
    result = receive_and_score(
        receiver,
        scene,
        snapshots,
        victim=victim,
        frame=frame,
        parts=parts,
        targets=TARGETS_OF_RADAR[case.victim],
        reception=reception,
    )
    return paper_row(
        case, result, receiver, paper_found=_found_by_the_paper(result, scene, snapshots)
    )


def _found_by_the_paper(
    result: VictimResult,
    scene: Scene,
    snapshots: Sequence[PropagationPaths],
) -> tuple[int, int]:
    """Numbers of detections of the paper's receiver in the same frame, and of targets found."""
    frame = result.frame
    detections, powers = detected(PaperReceiver(), frame, result.parts)
    victim = scene.radar_index(result.name)
    found = causes(
        detections,
        truth(scene.at(detections.time), victim, result.truth.name),
        powers=powers,
        echoes=echoes_during(frame.schedule, detections.time, scene, snapshots, victim=victim),
        gate=gate_for(PaperReceiver(), frame.schedule, frame.times, frame.array),
    )
    return detections.num_detections, int(found.association.target.size)


def _tables(rows: Mapping[Case, PaperRow]) -> dict[str, tuple[PaperRow, ...]]:
    """Rows of each table of the results, by its name."""
    named: dict[str, list[PaperRow]] = {"rows": [], "consistent": [], "everyone": []}
    for case, row in rows.items():
        if case.scenario == "all":
            named["everyone"].append(row)
        else:
            named["rows" if case.antenna == "table 2" else "consistent"].append(row)
    return {name: tuple(some) for name, some in named.items()}


_NOTES: Final = (
    "Targets are metal bodies: a plastic bumper in front of one gives a weaker, nearer echo of "
    "its own, counted among the other echoes.",
    "Scenarios A, B and C have the transmitters that the paper names; the rows for the whole "
    "street have all four radars on.",
    "Detections that belong together were not merged into objects; ghosts of one kind within "
    f"{GHOST_EXTENT[0]:g} m and {GHOST_EXTENT[1]:g} m/s of each other are shown as one.",
)


def paper_row(
    case: Case, victim: VictimResult, receiver: CoherentReceiver, *, paper_found: tuple[int, int]
) -> PaperRow:
    """One row of the table, in the units of the report.

    ``paper_found`` are the numbers of detections of the paper's receiver and of targets among them.
    """
    response = range_response(receiver, victim.frame, victim.parts)
    score = victim.score
    return PaperRow(
        scenario=case.scenario,
        radar=case.victim,
        waveform=case.waveform,
        synchronous=case.synchronous,
        mitigation=case.mitigation,
        targets=tuple(_target_row(victim, n) for n in range(len(victim.truth.name))),
        ghosts=_ghost_rows(victim),
        missed=score.num_missed,
        floor_rise_db=float(to_db(score.floor_rise)),
        other_echoes=len(score.other_echoes),
        profile_range=response.range,
        profile_power_db=_dbm(response.power),
        noise_floor_db=float(_dbm(response.noise)),
        mean_threshold_db=float(_dbm(mean_threshold(np.sqrt(response.power)) ** 2)),
        detection_range=_at_start(victim, victim.detections.range, victim.detections.range_rate),
        detection_power_db=_dbm(victim.detections.power),
        paper_detections=paper_found[0],
        paper_found=paper_found[1],
        antenna=case.antenna,
        map=None if _is_aside(case) else row_map(receiver, victim),
    )


def _is_aside(case: Case) -> bool:
    """True for the cases that are in tables of their own."""
    return case.scenario == "all" or case.antenna != "table 2"


def row_map(receiver: FrameReceiver, victim: VictimResult) -> RowMap:
    """Range-rate map of a frame with at most `MAP_CELLS` cells, and what was found in it."""
    whole, found = range_rate_map(receiver, victim.frame), victim.detections
    rates, ranges = MAP_CELLS
    power = pooled(pooled(whole.power, most=rates, axis=0), most=ranges, axis=1)
    return RowMap(
        range=group_means(whole.range, most=ranges),
        range_rate=group_means(whole.range_rate, most=rates),
        power_db=_dbm(power),
        detection_range=found.range,
        detection_range_rate=found.range_rate,
        detection_power_db=_dbm(found.power),
        detection_cause=victim.score.nature,
        detection_origin=victim.score.origin,
        target_range=victim.truth.range,
        target_range_rate=victim.truth.range_rate,
    )


def _at_start(victim: VictimResult, distance: FloatArray, range_rate: FloatArray) -> FloatArray:
    """Ranges at the start of the frame, m, from those at the instant to which detections refer.

    The street has the paper's distances at the start, and moves by up to 0.5 m until the middle.
    """
    elapsed = victim.detections.time - float(victim.frame.schedule.start_time[0])
    return distance - elapsed * range_rate


def _dbm(power: np.ndarray | float) -> np.ndarray:
    return to_db(power) + 30.0


def _target_row(victim: VictimResult, n: int) -> TargetRow:
    true, score = victim.truth, victim.score
    row = TargetRow(
        name=true.name[n],
        range_m=float(_at_start(victim, true.range, true.range_rate)[n]),
        closing_speed_mps=-float(true.range_rate[n]),
        azimuth_deg=math.degrees(true.azimuth[n]),
        detected=bool(score.is_detected[n]),
    )
    if not row.detected:
        return row
    return replace(
        row,
        range_error_m=float(score.range_error[n]),
        speed_error_mps=-float(score.range_rate_error[n]),
        azimuth_error_deg=math.degrees(score.azimuth_error[n]),
        snr_db=float(to_db(score.detection_sinr[n])),
    )


def _ghost_rows(victim: VictimResult) -> tuple[GhostRow, ...]:
    """Ghosts, strongest first; of several of one kind within `GHOST_EXTENT`, the strongest."""
    found, score = victim.detections, victim.score
    reference = max((float(found.power[n]) for n in score.target_detection), default=math.nan)
    kept: list[int] = []
    for n in sorted(score.ghosts, key=lambda n: -found.power[n]):
        if not any(score.nature[m] == score.nature[n] and _same_place(found, m, n) for m in kept):
            kept.append(n)
    distance = _at_start(victim, found.range, found.range_rate)
    return tuple(
        GhostRow(
            kind=_kind(score.nature[n]),
            range_m=float(distance[n]),
            closing_speed_mps=-float(found.range_rate[n]),
            azimuth_deg=math.degrees(found.azimuth[n]),
            power_over_strongest_target_db=float(to_db(found.power[n] / reference)),
            radar=score.radar[n],
        )
        for n in kept
    )


def _same_place(found: Detections, a: int, b: int) -> bool:
    return bool(
        abs(found.range[a] - found.range[b]) < GHOST_EXTENT[0]
        and abs(found.range_rate[a] - found.range_rate[b]) < GHOST_EXTENT[1]
    )


def _kind(nature: str) -> GhostKind:
    kinds: tuple[GhostKind, ...] = get_args(GhostKind)
    return kinds[kinds.index(nature)]
