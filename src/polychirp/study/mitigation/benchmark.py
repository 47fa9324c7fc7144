"""Methods of mitigation on a set of frames: measures of every frame, and their percentiles."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from polychirp.axes import BoolArray
from polychirp.errors import CapabilityError, InputError, RunError, no_such
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Detecting, Mitigated, Mitigation, mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.scoring.burst_detection import burst_counts, hit_in_truth
from polychirp.scoring.mitigation import share_touched
from polychirp.study.mitigation.carried_work import CarriedWork
from polychirp.study.mitigation.frame_sets import FRAME_SETS, NEWEST, WHOLE_BAND, set_frame
from polychirp.study.mitigation.measures import MEASURES, MeasuredFrame, measured_frame, measures
from polychirp.study.monte_carlo.tasks import Outcome, Task, outcome_of
from polychirp.study.provenance import versions
from polychirp.threads import one_blas_thread

FORMAT: Final = "polychirp mitigation benchmark, version 2"

NO_MITIGATION: Final = "nothing"
ORACLE: Final = "clean oracle"
"""Bounds: no mitigation, and the frame without interference, which no real receiver has."""

KNOWN: Final = ", bursts known"
"""End of the name of a method whose detector is `KnownBursts`."""

PERCENTILES: Final = (10, 50, 90)

LEAST_CHANGE: Final = 0.1
"""Fall of ``sinr_range``, dB, from which a method made a frame worse; chosen."""

OTHER_MEASURES: Final = ("precision", "recall", "f_score", "false_mitigation", "clean_evm")
"""Measures beside those of `measures`. Of the samples that the method's detector finds on the
interfered frame: the share that is hit, the share of those hit that it finds, and the harmonic mean
of both; NaN for a method without a detector. Of the clean frame: the share of the samples that the
method changes, and its EVM."""

_CALLED: Final[set[tuple[str, type, tuple[int, ...]]]] = set()
"""Rows, types of methods and shapes of samples that were called in this process; see `_timed`."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownBursts:
    """A detector that knows which samples are hit: what a repair gives with perfect detection.

    Parameters
    ----------
    mask : samples that are hit, ``(ramp, fast)``
    guard : s; unused, the mask holds all
    """

    mask: BoolArray
    guard: float | None = 0.0

    def hit(self, frame: IfFrame) -> BoolArray:
        """The known mask."""
        del frame
        return self.mask


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodResult:
    """Measures of one method on the frames of one family.

    Parameters
    ----------
    family, method : names
    frames : measures of every frame by name; empty if the method refuses such frames
    seconds : CPU time of the method on every frame, without what a process does once
    refusal : reason of a refusal, else empty
    """

    family: str
    method: str
    frames: tuple[Mapping[str, float], ...]
    seconds: tuple[float, ...] = ()
    refusal: str = ""

    def percentiles(self, measure: str) -> tuple[float, ...]:
        """`PERCENTILES` of a measure over the frames; NaN if it has no values."""
        values = np.array([frame[measure] for frame in self.frames])
        values = values[~np.isnan(values)]
        if not values.size:
            return (math.nan,) * len(PERCENTILES)
        return tuple(float(value) for value in np.percentile(values, PERCENTILES))

    def share_worse(self, nothing: MethodResult) -> float:
        """Share of the frames whose ``sinr_range`` is below that without mitigation."""
        pairs = zip(self.frames, nothing.frames, strict=False)
        worse = [own["sinr_range"] < bare["sinr_range"] - LEAST_CHANGE for own, bare in pairs]
        return float(np.mean(worse)) if worse else math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchmarkPlan:
    """Methods and frames that are measured.

    Parameters
    ----------
    methods : by name
    frame_set, families : set of frames, and families of it; all if empty
    num_frames : frames of every family
    fewer : smaller numbers of frames by the names of methods, such as slow ones
    knows_bursts : measure each method that begins with a detector once more with `KnownBursts`

    Raises
    ------
    InputError
        There is no such set or family, a number of frames is below 1, or a method has the name of
        another row.
    """

    methods: Mapping[str, Mitigation]
    frame_set: str = NEWEST
    families: tuple[str, ...] = ()
    num_frames: int = 8
    fewer: Mapping[str, int] = field(default_factory=dict)
    knows_bursts: bool = False

    def __post_init__(self) -> None:
        chosen = chosen_families(self.frame_set, self.families)
        object.__setattr__(self, "families", chosen)
        for name in self.methods:
            if name in (NO_MITIGATION, ORACLE) or name.endswith(KNOWN):
                raise InputError(f"a method cannot be called '{name}'; that is another row's name")
        for number in (self.num_frames, *self.fewer.values()):
            if number < 1:
                raise InputError(f"the number of frames is {number}; use 1 or more")

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of all rows of a family, both bounds included."""
        names = []
        for name, method in self.methods.items():
            names.append(name)
            repair: object = method
            if self.knows_bursts and isinstance(repair, BurstRepair):
                names.append(name + KNOWN)
        return (NO_MITIGATION, *names, ORACLE)

    def measures_frame(self, row: str, number: int) -> bool:
        """True if a row has a frame of this number."""
        return number < self.fewer.get(row.removesuffix(KNOWN), self.num_frames)


def run_benchmark(
    plan: BenchmarkPlan, *, workers: int = 1, progress: Progress = no_progress
) -> tuple[MethodResult, ...]:
    """Every method on the same frames, and both bounds; the same for any number of workers.

    Only the times differ from run to run.

    Raises
    ------
    InputError
        A method cannot be sent to worker processes.
    RunError
        A method fails on a frame.
    """
    tasks = [
        Task(point=place, trial=place * plan.num_frames + number, seed=number)
        for place in range(len(plan.families))
        for number in range(plan.num_frames)
    ]
    progress("frames", 0, len(tasks))
    rows: dict[int, Mapping[str, FrameRow]] = {}
    with one_blas_thread():
        for outcome in _outcomes(plan, tasks, workers):
            if outcome.failure:
                family = plan.families[outcome.task.point]
                raise RunError(f"frame {outcome.task.seed} of '{family}': {outcome.failure}")
            rows[outcome.task.trial] = outcome.result
            progress("frames", len(rows), len(tasks))
    return tuple(
        _result(family, row, [rows[place * plan.num_frames + n] for n in range(plan.num_frames)])
        for place, family in enumerate(plan.families)
        for row in plan.rows
    )


def _outcomes(plan: BenchmarkPlan, tasks: Sequence[Task], workers: int) -> Iterator[Outcome]:
    from polychirp.study.monte_carlo.executor import LocalWorkers

    work = partial(measured_task, plan)
    if workers == 1:
        return map(work, tasks)
    return LocalWorkers(count=workers).compute(CarriedWork.of(work), iter(tasks))


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameRow:
    """Measures of a method on one frame, and its CPU time, s; or why it refuses the frame."""

    measures: Mapping[str, float] | None = None
    seconds: float = math.nan
    refusal: str = ""


def measured_task(plan: BenchmarkPlan, task: Task) -> Outcome:
    """All rows of the frame of a task, by name."""
    family = plan.families[task.point]
    return outcome_of(task, lambda: _frame_rows(plan, family, task.seed))


def _frame_rows(plan: BenchmarkPlan, family: str, number: int) -> dict[str, FrameRow]:
    frame, parts = set_frame(plan.frame_set, family, number)
    on = measured_frame(frame, parts, whole_band=family in WHOLE_BAND)
    truth = hit_in_truth(parts, frame.times.is_sample)
    rows = {}
    for name in plan.rows:
        if not plan.measures_frame(name, number):
            continue
        method: Any = plan.methods.get(name.removesuffix(KNOWN))
        treated = on.clean if name == ORACLE else frame
        try:
            if name.endswith(KNOWN):
                on_clean = _knowing(method, np.zeros_like(truth))
                known = _knowing(method, truth)
                rows[name] = _row(name, on, treated, known, on_clean, truth)
            else:
                rows[name] = _row(name, on, treated, method, method, truth)
        except CapabilityError as error:
            rows[name] = FrameRow(refusal=str(error))
    return rows


def _knowing(method: Any, mask: BoolArray) -> Mitigation:
    """The method with `KnownBursts` in place of its detector."""
    settings: dict[str, Any] = {setting.name: setting.default for setting in fields(BurstRepair)}
    known: Mitigation = replace(method, **settings | {"detector": KnownBursts(mask=mask)})
    return known


def _row(
    name: str,
    on: MeasuredFrame,
    treated: IfFrame,
    method: Mitigation | None,
    on_clean: Mitigation | None,
    truth: BoolArray,
) -> FrameRow:
    """Measures of a method on a frame, and on the same frame without interference."""
    result, seconds = _timed(name, method, treated)
    unspoilt = mitigated(on_clean, on.clean)
    present = on.frame.times.is_sample
    values = measures(on, result) | {
        "precision": math.nan,
        "recall": math.nan,
        "f_score": math.nan,
        "false_mitigation": share_touched(
            on.clean.samples, unspoilt.samples, unspoilt.weight, present
        ),
        "clean_evm": measures(on, unspoilt)["evm"],
    }
    detecting: object = method
    if isinstance(detecting, Detecting):
        counts = burst_counts(detecting.hit(treated), truth, present)
        values |= {
            "precision": counts.precision,
            "recall": counts.recall,
            "f_score": counts.f_score,
        }
    return FrameRow(measures=values, seconds=seconds)


def _result(family: str, row: str, frames: Sequence[Mapping[str, FrameRow]]) -> MethodResult:
    """All frames of a row; none if the method refuses one of them."""
    own = [frame[row] for frame in frames if row in frame]
    refusal = next((one.refusal for one in own if one.refusal), "")
    measured = [] if refusal else [one for one in own if one.measures is not None]
    return MethodResult(
        family=family,
        method=row,
        frames=tuple(one.measures for one in measured if one.measures is not None),
        seconds=tuple(one.seconds for one in measured),
        refusal=refusal,
    )


def chosen_families(frame_set: str, families: Sequence[str]) -> tuple[str, ...]:
    """Names of the families of a set; all if none is named.

    Raises
    ------
    InputError
        There is no such set or family.
    """
    if frame_set not in FRAME_SETS:
        raise InputError(no_such("set of frames", frame_set, FRAME_SETS))
    known = FRAME_SETS[frame_set]
    for family in families:
        if family not in known:
            raise InputError(no_such("family of frames", family, known))
    return tuple(dict.fromkeys(families)) or tuple(known)


def benchmark_record(results: Sequence[MethodResult], plan: BenchmarkPlan) -> dict[str, Any]:
    """The results as plain values for JSON: settings, measures of every frame, percentiles.

    NaN is None. It has no times, so that it is the same for any number of workers.
    """
    nothing = {result.family: result for result in results if result.method == NO_MITIGATION}
    return {
        "format": FORMAT,
        "set": plan.frame_set,
        "versions": versions(),
        "methods": {name: _settings(method) for name, method in plan.methods.items()},
        "percentiles": list(PERCENTILES),
        "results": [
            {
                "family": result.family,
                "method": result.method,
                "refusal": result.refusal,
                "num_frames": len(result.frames),
                "share_worse": _plain(result.share_worse(nothing[result.family])),
                "summary": {
                    name: [_plain(value) for value in result.percentiles(name)]
                    for name in (*MEASURES, *OTHER_MEASURES)
                },
                "frames": [
                    {name: _plain(value) for name, value in frame.items()}
                    for frame in result.frames
                ],
            }
            for result in results
        ],
    }


def benchmark_times(results: Sequence[MethodResult]) -> dict[str, dict[str, float]]:
    """Median CPU time for a frame of this machine, s, by method and family."""
    times: dict[str, dict[str, float]] = {}
    for result in results:
        if result.seconds:
            median = round(float(np.median(result.seconds)), 6)
            times.setdefault(result.method, {})[result.family] = median
    return times


def _timed(name: str, method: Mitigation | None, frame: IfFrame) -> tuple[Mitigated, float]:
    """The result of a row's method on a frame, and the CPU time that it took, s.

    The first call in a process for frames of a shape is not timed. It also loads modules and
    kernels for up to a second, which would count for whichever method comes first.
    """
    call = (name, type(method), frame.samples.shape)
    if method is not None and call not in _CALLED:
        _CALLED.add(call)
        method.mitigate(frame)
    start = time.process_time()
    result = mitigated(None, frame) if method is None else method.mitigate(frame)
    return result, time.process_time() - start


def _settings(method: Any) -> Any:
    """Settings of a spec by name; of another object the name of its class."""
    if not is_dataclass(method):
        return type(method).__qualname__
    values = {setting.name: getattr(method, setting.name) for setting in fields(method)}
    return {name: _settings(v) if is_dataclass(v) else v for name, v in values.items()}


def _plain(value: float) -> float | None:
    return None if math.isnan(value) else round(value, 6)
