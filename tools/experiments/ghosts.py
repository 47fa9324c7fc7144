"""Probability of ghosts: Monte Carlo trials on point targets, beside the closed forms.

A radar faces oncoming and parked cars, some of which carry a radar that faces it. Targets are
points in free space, so that differences from `scoring.closed_forms` come from the receiver. Each
trial draws another street, noise, starts and clocks, which are the same for all cases.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.direct.line_of_sight import line_of_sight
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import RunError
from polychirp.frames import Pose
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.paths import PropagationPaths
from polychirp.receiver.settings import SearchSettings
from polychirp.scoring.causes import Nature
from polychirp.scoring.closed_forms.overlap import any_of
from polychirp.scoring.closed_forms.synchronous import (
    apparent_point,
    ghost_by_clock,
    ghost_by_start,
    has_ridge_in_map,
    removing_slope_difference,
)
from polychirp.scoring.statistics import Estimate, mean_count, proportion
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.records import NATURES, VictimRecord
from polychirp.study.monte_carlo.tasks import Executor, Task
from polychirp.study.random_draw import sample_street
from polychirp.study.spec import Study, StudyRadar, scene_of
from polychirp.study.traffic import StudyTraffic
from polychirp.traffic.random_traffic import Lane
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import DiverseTriangular, Triangular

NUM_TRIALS: Final = 60
"""Number of trials of every case but those of slopes; chosen."""

NUM_SLOPE_TRIALS: Final = 20
"""Number of trials of cases of slopes, which take longer and are nearly certain; chosen."""

LANES: Final = (
    Lane(y=1.75, oncoming=True),
    *(Lane(y=y, oncoming=True, speed=(0.0, 0.0)) for y in (5.0, 8.5, 12.0, -5.0, -8.5, -12.0)),
)
"""One lane of oncoming cars, and rows of parked cars on both sides; all face the victim."""

START_SPREADS: Final = (0.02e-6, 0.05e-6, 0.1e-6, 0.2e-6, 0.5e-6, 1e-6, 5e-6)
CLOCK_SPREADS: Final = (0.01e-6, 0.1e-6, 0.2e-6, 0.3e-6, 0.5e-6, 1e-6)
SLOPE_DIFFERENCES: Final = (1e-6, 1e-5, 1e-4, 2e-4, 3e-4, 5e-4, 1e-3, 1e-2, 1e-1)
INTERFERER_NUMBERS: Final = (1, 2, 3, 4)
"""Values on the axes: spreads of starts, s, and of clocks, relative differences of slopes, and
numbers of interferers."""

_SPREAD_OF_MANY: Final = 0.3e-6
"""Spread of starts if the number of interferers is varied, s."""

_IS_GHOST: Final = [Nature(name).is_ghost for name in NATURES]
_DIRECT: Final = NATURES.index(Nature.DIRECT.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One point of the comparison.

    Parameters
    ----------
    axis, value : quantity that is varied, and its value in SI
    waveform : "conventional" or "diverse"
    study : study of each trial, without its seed
    num_trials : number of trials
    slope_difference : relative difference of the slopes of the interferers
    """

    axis: str
    value: float
    waveform: str
    study: Study
    num_trials: int
    slope_difference: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GhostRow:
    """Result of one case, with 95 % intervals.

    Parameters
    ----------
    axis, value, waveform : of the case
    theory : probability by the closed forms that the apparent point of an interferer is in the map,
        mean over the streets
    theory_of_ridges : probability that such a point or its cross-pairing ridge (`has_ridge_in_map`)
        is in the map
    direct : measured probability that a frame has a detection from a direct path
    any_ghost : measured probability that a frame has a false detection
    ghosts : mean number of false detections in a frame
    detection : probability that a target is detected
    predicted : number of trials in which the apparent point of an interferer is in the map
    lost : number of those trials without a direct ghost
    extra : number of trials with a direct ghost though no apparent point is in the map
    ridges : number of those trials in which a cross-pairing ridge is in the map
    num_trials : number of trials
    """

    axis: str
    value: float
    waveform: str
    theory: float
    theory_of_ridges: float
    direct: Estimate
    any_ghost: Estimate
    ghosts: Estimate
    detection: Estimate
    predicted: int
    lost: int
    extra: int
    ridges: int
    num_trials: int


def ghost_study(
    *,
    waveform: Triangular | DiverseTriangular = Triangular(),  # noqa: B008, a frozen value
    start_spread: float = 0.0,
    clock_spread: float = 0.0,
    num_interferers: int = 1,
    slope_difference: float = 0.0,
) -> Study:
    """A victim, two point targets and up to four cars that may carry a radar like its own.

    ``slope_difference`` is relative; it changes the bandwidth of a conventional waveform.
    """
    other = None
    if slope_difference and isinstance(waveform, Triangular):
        other = replace(waveform, bandwidth=waveform.bandwidth * (1.0 + slope_difference))
    return Study(
        name="ghosts-start-spread",
        num_sweeps=8,
        street=Street(vehicles=(Vehicle(name="ego", x=0.0, y=-1.75, max_edge=0.2),)),
        radars=(
            StudyRadar(name="front", vehicle="ego", mount=Pose(x=2.33, z=0.5), waveform=waveform),
        ),
        traffic=StudyTraffic(
            seen_from="ego",
            num_targets=2,
            num_carriers=INTERFERER_NUMBERS[-1],
            shape="points",
            lanes=LANES,
            max_edge=0.2,
            num_interferers=num_interferers,
            start_spread=start_spread,
            clock_spread=clock_spread,
            waveform=other,
        ),
        victims=("front",),
        tracer=FreeSpace(),
        refresh_interval=8e-3,
    )


def cases() -> tuple[Case, ...]:
    """All cases of the comparison."""
    return (
        *(case("start", spread) for spread in START_SPREADS),
        *(case("clock", spread) for spread in CLOCK_SPREADS),
        *(case("slope", difference) for difference in SLOPE_DIFFERENCES),
        *(case("number", number) for number in INTERFERER_NUMBERS),
        *(case("start", spread, "diverse") for spread in (START_SPREADS[0], START_SPREADS[-1])),
        case("clock", CLOCK_SPREADS[-1], "diverse"),
        case("number", INTERFERER_NUMBERS[-1], "diverse"),
    )


def case(axis: str, value: float, waveform: str = "conventional") -> Case:
    """One case; ``axis`` is start, clock, slope or number."""
    change: Mapping[str, Mapping[str, float]] = {
        "start": {"start_spread": value},
        "clock": {"clock_spread": value},
        "slope": {"slope_difference": value},
        "number": {"start_spread": _SPREAD_OF_MANY, "num_interferers": int(value)},
    }
    kind = {"conventional": Triangular(), "diverse": DiverseTriangular()}[waveform]
    return Case(
        axis=axis,
        value=value,
        waveform=waveform,
        study=ghost_study(waveform=kind, **change[axis]),  # type: ignore[arg-type]
        num_trials=NUM_SLOPE_TRIALS if axis == "slope" else NUM_TRIALS,
        slope_difference=value if axis == "slope" else 0.0,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Expectation:
    """Direct ghosts of one trial in theory.

    Parameters
    ----------
    in_map, ridge : probabilities on the street of the trial, for random start and clock, that the
        apparent point of an interferer is in the map, and that it or its cross-pairing ridge is
    is_in_map, has_ridge : True if so with the start and the clock that the trial draws
    """

    in_map: float = 0.0
    ridge: float = 0.0
    is_in_map: bool = False
    has_ridge: bool = False


def measure_ghosts(
    cases: Sequence[Case],
    *,
    executor: Executor,
    seed: int = 1,
    progress: Progress = no_progress,
) -> tuple[GhostRow, ...]:
    """Run every case; trial n has the same seed in all.

    Raises
    ------
    RunError
        A trial fails.
    """
    total = sum(case.num_trials for case in cases)
    tasks = (
        Task(point=point, trial=trial, seed=trial_seed(seed, trial))
        for point, case in enumerate(cases)
        for trial in range(case.num_trials)
    )
    found: dict[tuple[int, int], VictimRecord] = {}
    with closing(executor.run([case.study for case in cases], tasks)) as outcomes:
        for outcome in outcomes:
            if outcome.result is None:
                raise RunError(f"a trial of the ghosts failed: {outcome.failure}")
            found[outcome.task.point, outcome.task.trial] = outcome.result[0]
            progress("ghosts", len(found), total)
    return tuple(
        _row(
            case,
            [expectation(case, trial_seed(seed, trial)) for trial in range(case.num_trials)],
            [found[point, trial] for trial in range(case.num_trials)],
        )
        for point, case in enumerate(cases)
    )


def _row(case: Case, expected: Sequence[Expectation], records: Sequence[VictimRecord]) -> GhostRow:
    counts = np.array([record.detections for record in records], dtype=np.float64)
    ones = np.ones(len(records))
    is_direct = counts[:, _DIRECT] > 0
    num_ghosts = counts[:, _IS_GHOST].sum(axis=1)
    is_due = np.array([one.is_in_map for one in expected])
    has_ridge = np.array([one.has_ridge for one in expected])
    is_extra = is_direct & ~is_due
    return GhostRow(
        axis=case.axis,
        value=case.value,
        waveform=case.waveform,
        theory=float(np.mean([one.in_map for one in expected])),
        theory_of_ridges=float(np.mean([one.ridge for one in expected])),
        direct=proportion(is_direct.astype(np.float64), ones),
        any_ghost=proportion((num_ghosts > 0).astype(np.float64), ones),
        ghosts=mean_count(num_ghosts),
        detection=proportion(
            np.array([sum(record.is_detected) for record in records], dtype=np.float64),
            np.array([sum(record.is_visible) for record in records], dtype=np.float64),
        ),
        predicted=int(is_due.sum()),
        lost=int(np.sum(is_due & ~is_direct)),
        extra=int(is_extra.sum()),
        ridges=int(np.sum(is_extra & has_ridge)),
        num_trials=len(records),
    )


def expectation(case: Case, seed: int) -> Expectation:
    """Expectation for the trial with ``seed``; zero for diverse waveforms.

    Probabilities are exact where either all starts or all clocks are equal.
    """
    study = sample_street(replace(case.study, seed=seed))
    receiver, ramps = study.receiver, study.radars[0].waveform
    assert isinstance(receiver, SearchSettings)
    if not isinstance(ramps, Triangular) or _is_removed(case.slope_difference, receiver, ramps):
        return Expectation()
    others = study.radars[1:]
    paths = line_of_sight(
        scene_of(study),
        frequency=ramps.start_frequency,
        pairs=np.array([[n + 1, 0] for n in range(len(others))]),
    )
    distance, rate = apparent_point(
        delay=paths.delay,
        delay_rate=paths.delay_rate,
        start_offset=np.array([radar.start_time for radar in others]),
        clock_offset=np.array([radar.clock_offset for radar in others]),
    )
    low, high, speed = receiver.least_range, receiver.greatest_range, receiver.greatest_speed
    coupling = ramps.ramp_duration * (ramps.start_frequency / ramps.bandwidth + 0.5)
    is_in_map = (distance >= low) & (distance <= high) & (np.abs(rate) <= speed)
    has_ridge = has_ridge_in_map(
        distance=distance,
        range_rate=rate,
        coupling=coupling,
        least_range=low,
        greatest_range=high,
        greatest_speed=speed,
    )
    half = 0.5 * SPEED_OF_LIGHT
    own_range, own_speed = half * paths.delay, half * np.abs(paths.delay_rate)
    wider = coupling * (speed + own_speed)
    faster = speed + np.maximum(high - own_range, own_range - low) / coupling
    return Expectation(
        in_map=_probability(case, paths, low=low, high=high, speed=speed),
        ridge=_probability(case, paths, low=low - wider, high=high + wider, speed=faster),
        is_in_map=bool(np.any(is_in_map)),
        has_ridge=bool(np.any(has_ridge)),
    )


def _is_removed(slope_difference: float, receiver: SearchSettings, ramps: Triangular) -> bool:
    limit = removing_slope_difference(
        greatest_delay=2.0 * receiver.greatest_range / SPEED_OF_LIGHT,
        duration=ramps.ramp_duration,
    )
    return slope_difference >= limit


def _probability(
    case: Case,
    paths: PropagationPaths,
    *,
    low: FloatArray | float,
    high: FloatArray | float,
    speed: FloatArray | float,
) -> float:
    """Probability that a ghost is within limits, which may differ from path to path."""
    traffic = case.study.traffic
    assert traffic is not None
    by_start = ghost_by_start(
        paths.delay, spread=traffic.start_spread, least_range=low, greatest_range=high
    )
    by_clock = ghost_by_clock(paths.delay_rate, spread=traffic.clock_spread, greatest_speed=speed)
    return any_of(by_start * by_clock)
