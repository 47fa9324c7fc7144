"""Methods of mitigation on a set of frames: measures of every frame, and their percentiles."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Final

import numpy as np

from polychirp.errors import CapabilityError, InputError, no_such
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated, Mitigation, mitigated
from polychirp.scoring.mitigation import share_touched
from polychirp.study.mitigation.frame_sets import FRAME_SETS, set_frame
from polychirp.study.mitigation.measures import MEASURES, measured_frame, measures
from polychirp.study.provenance import versions

FORMAT: Final = "polychirp mitigation benchmark, version 1"

NO_MITIGATION: Final = "nothing"
ORACLE: Final = "clean oracle"
"""Bounds: no mitigation, and the frame without interference, which no real receiver has."""

PERCENTILES: Final = (10, 50, 90)

LEAST_CHANGE: Final = 0.1
"""Fall of ``sinr_range``, dB, from which a method made a frame worse; chosen."""

CLEAN_MEASURES: Final = ("false_mitigation", "clean_evm", "seconds")
"""Measures beside those of `measures`: share of the samples of the clean frame that the method
changes, EVM of that frame, and time for the interfered frame, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodResult:
    """Measures of one method on the frames of one family.

    Parameters
    ----------
    family, method : names
    frames : measures of every frame by name; empty if the method refuses such frames
    refusal : reason of that, else empty
    """

    family: str
    method: str
    frames: tuple[Mapping[str, float], ...]
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


def run_benchmark(
    methods: Mapping[str, Mitigation],
    *,
    frame_set: str = "v1",
    families: Sequence[str] = (),
    num_frames: int = 8,
    progress: Progress = no_progress,
) -> tuple[MethodResult, ...]:
    """Every method on the same frames, and both bounds.

    Parameters
    ----------
    families : of the set; all if empty
    num_frames : frames of every family

    Raises
    ------
    InputError
        There is no such set or family, or the number of frames is below 1.
    """
    chosen = chosen_families(frame_set, families)
    if num_frames < 1:
        raise InputError(f"the number of frames is {num_frames}; use 1 or more")
    all_methods: dict[str, Mitigation | None] = {NO_MITIGATION: None, **methods, ORACLE: None}
    results = []
    total = len(chosen) * num_frames
    for place, family in enumerate(chosen):
        rows: dict[str, list[Mapping[str, float]]] = {name: [] for name in all_methods}
        refusals: dict[str, str] = {}
        for number in range(num_frames):
            progress("frames", place * num_frames + number, total)
            frame, parts = set_frame(frame_set, family, number)
            on = measured_frame(frame, parts)
            for name, method in all_methods.items():
                if name in refusals:
                    continue
                treated = on.clean if name == ORACLE else frame
                try:
                    result, seconds = _timed(method, treated)
                    unspoilt = mitigated(method, on.clean)
                except CapabilityError as error:
                    refusals[name] = str(error)
                    continue
                after, present = unspoilt.samples, frame.times.is_sample
                rows[name].append(
                    measures(on, result)
                    | {
                        "false_mitigation": share_touched(
                            on.clean.samples, after, unspoilt.weight, present
                        ),
                        "clean_evm": measures(on, unspoilt)["evm"],
                        "seconds": seconds,
                    }
                )
        results += [
            MethodResult(
                family=family,
                method=name,
                frames=tuple(rows[name]),
                refusal=refusals.get(name, ""),
            )
            for name in all_methods
        ]
    progress("frames", total, total)
    return tuple(results)


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
    return tuple(families) or tuple(known)


def benchmark_record(
    results: Sequence[MethodResult],
    methods: Mapping[str, Mitigation],
    *,
    frame_set: str,
) -> dict[str, Any]:
    """The results as plain values for JSON: settings, measures of every frame, percentiles.

    NaN is None. Times are those of this machine; all else is the same everywhere.
    """
    nothing = {result.family: result for result in results if result.method == NO_MITIGATION}
    return {
        "format": FORMAT,
        "set": frame_set,
        "versions": versions(),
        "methods": {name: _settings(method) for name, method in methods.items()},
        "percentiles": list(PERCENTILES),
        "results": [
            {
                "family": result.family,
                "method": result.method,
                "refusal": result.refusal,
                "share_worse": _plain(result.share_worse(nothing[result.family])),
                "summary": {
                    name: [_plain(value) for value in result.percentiles(name)]
                    for name in (*MEASURES, *CLEAN_MEASURES)
                },
                "frames": [
                    {name: _plain(value) for name, value in frame.items()}
                    for frame in result.frames
                ],
            }
            for result in results
        ],
    }


def _timed(method: Mitigation | None, frame: IfFrame) -> tuple[Mitigated, float]:
    """The result of a method on a frame, and the time that it took, s."""
    start = time.perf_counter()
    result = mitigated(None, frame) if method is None else method.mitigate(frame)
    return result, time.perf_counter() - start


def _settings(method: Any) -> Any:
    """Settings of a spec by name; of another object the name of its class."""
    if not is_dataclass(method):
        return type(method).__qualname__
    values = {field.name: getattr(method, field.name) for field in fields(method)}
    return {name: _settings(v) if is_dataclass(v) else v for name, v in values.items()}


def _plain(value: float) -> float | None:
    return None if math.isnan(value) else round(value, 6)
