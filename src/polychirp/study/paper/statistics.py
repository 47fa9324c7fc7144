"""Trials for the paper's figures 12 and 13: detection and accuracy over the number of targets."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Final, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.baseband import Progress, no_progress
from polychirp.receiver.mitigation.blanking import Blanking
from polychirp.scoring.statistics import Estimate
from polychirp.study.monte_carlo.grid import Axis
from polychirp.study.monte_carlo.plan import Plan, Point
from polychirp.study.monte_carlo.results import Results
from polychirp.study.monte_carlo.run import run_plan
from polychirp.study.monte_carlo.summary import (
    Difference,
    Summary,
    in_sight_only,
    paired_difference,
    summaries,
)
from polychirp.study.monte_carlo.tasks import Executor
from polychirp.study.paper.results import (
    PAPER_TARGETS,
    Interval,
    Situation,
    StatisticsRow,
    WaveformKind,
)
from polychirp.study.paper.scenarios import WAVEFORMS
from polychirp.study.provenance import provenance
from polychirp.study.spec import AnyTracer, Study, StudyRadar
from polychirp.study.traffic import StudyTraffic
from polychirp.traffic.street import Building, Road, Street, Vehicle
from polychirp.units import to_db

Channel = Literal["points", "point-vehicles", "vehicles"]
"""Model of the street: targets as isotropic points in free space; vehicles as a few point
scatterers; vehicles, road and buildings ray-traced."""

_TRACERS: Final[dict[Channel, AnyTracer]] = {
    "points": FreeSpace(),
    "point-vehicles": PointVehicles(),
    "vehicles": Composite(),
}

NUM_INTERFERERS: Final = 2
"""Number of radars of other vehicles, synchronous with the victim; chosen."""

NUM_TARGETS: Final = (1, 4, 7, PAPER_TARGETS)
"""Numbers of targets at which the curves have points."""

TRIALS: Final = 12
"""Trials of each point that `polychirp paper` runs; chosen. The stored points have more."""

LONGEST_FRAME: Final = 56e-3
"""Time for which paths are traced, s. Chosen: of 300 frames with diverse slopes, the longest takes
55 ms, so that all curves of a trial have the same paths."""

Curve = tuple[WaveformKind, Situation]

CURVES: Final[tuple[Curve, ...]] = tuple(
    product(("conventional", "diverse"), ("alone", "interfered", "blanked"))
)

_CURVE_LABELS: Final = tuple(", ".join(curve) for curve in CURVES)


def statistics_study(channel: Channel = "points", *, seed: int = 1) -> Study:
    """Study of one radar in random traffic without interferers; other studies are made from it.

    With the channel "points", an isotropic scatterer of 10 m² stands for every target, at the
    nearest point of the vehicle's place, and no body blocks the line of sight.
    """
    shape: Literal["points", "vehicles"] = "points" if channel == "points" else "vehicles"
    ego = Vehicle(name="ego", x=0.0, y=-1.75, speed=10.0)
    return Study(
        name=f"paper-statistics-{channel}",
        seed=seed,
        street=Street(
            road=Road(length=110.0, width=14.0, x=35.0),
            vehicles=(ego,),
            buildings=tuple(
                Building(name=name, x=35.0, y=y, length=90.0, width=8.0, height=9.0)
                for name, y in (("right", -14.0), ("left", 14.0))
            ),
        ),
        radars=(
            StudyRadar(
                name="front",
                vehicle="ego",
                mount=Pose(x=2.32, z=0.5),
                waveform=WAVEFORMS["conventional"],
            ),
        ),
        traffic=StudyTraffic(seen_from="ego", num_carriers=NUM_INTERFERERS, shape=shape),
        tracer=_TRACERS[channel],
        refresh_interval=4e-3 if channel == "vehicles" else 1e-3,
        least_traced_time=LONGEST_FRAME if channel == "vehicles" else 0.0,
    )


def with_situation(study: Study, waveform: WaveformKind, situation: Situation) -> Study:
    """The study with this waveform for all radars, and with this situation of the victim."""
    assert study.traffic is not None
    traffic = replace(
        study.traffic, num_interferers=NUM_INTERFERERS, are_silent=situation == "alone"
    )
    return replace(
        study,
        radars=tuple(replace(radar, waveform=WAVEFORMS[waveform]) for radar in study.radars),
        traffic=traffic,
        receiver=replace(study.receiver, mitigation=Blanking() if situation == "blanked" else None),
    )


def statistics_plan(
    channel: Channel = "points",
    *,
    trials: int,
    num_targets: Sequence[int] = NUM_TARGETS,
    curves: Sequence[Curve] = CURVES,
    seed: int = 1,
) -> Plan:
    """Plan of all ``curves`` over ``num_targets``; trial n has the same seed at all points."""
    study = statistics_study(channel, seed=seed)
    assert study.traffic is not None
    points = []
    for count, (waveform, situation) in product(num_targets, curves):
        few = replace(study, traffic=replace(study.traffic, num_targets=count))
        one = with_situation(few, waveform, situation)
        points.append(
            Point(
                labels=(count, f"{waveform}, {situation}"),
                study=one,
                study_hash=provenance(one).study_hash,
                command=None,
            )
        )
    return Plan(
        axes=(
            Axis(name="num_targets", labels=tuple(num_targets), changes=()),
            Axis(name="curve", labels=tuple(map(", ".join, curves)), changes=()),
        ),
        points=tuple(points),
        trials=trials,
        stop_half_width=None,
        origin=provenance(study),
    )


def run_statistics(
    plan: Plan, *, folder: Path, executor: Executor, progress: Progress = no_progress
) -> tuple[StatisticsRow, ...]:
    """Run the trials that ``folder`` does not have, and return the points of the curves."""
    finished = run_plan(plan, folder=folder, executor=executor, progress=progress)
    return rows_of(finished.results)


def rows_of(results: Results) -> tuple[StatisticsRow, ...]:
    """Points of the curves, from the trials of a `statistics_plan`."""
    points = {hashed: number for number, hashed in enumerate(results.study_hash)}
    return tuple(
        _row(summary, results, points[summary.study_hash]) for summary in summaries(results)
    )


def _row(summary: Summary, results: Results, point: int) -> StatisticsRow:
    count, curve = summary.labels
    waveform, situation = CURVES[_CURVE_LABELS.index(str(curve))]
    gain = _gain(results, point)
    return StatisticsRow(
        waveform=waveform,
        situation=situation,
        num_targets=int(count),
        num_trials=summary.num_trials,
        detection=_interval(summary.detection),
        ghosts=_interval(summary.ghosts),
        unexplained=_interval(summary.unexplained),
        range_rmse_m=_interval(summary.range_rmse),
        azimuth_rmse_deg=_interval(summary.azimuth_rmse, scale=180.0 / math.pi),
        speed_rmse_kmh=_interval(summary.range_rate_rmse, scale=3.6),
        range_median_m=_median(in_sight_only(results, "range_error", point)),
        azimuth_median_deg=math.degrees(_median(in_sight_only(results, "azimuth_error", point))),
        speed_median_kmh=3.6 * _median(in_sight_only(results, "range_rate_error", point)),
        floor_rise_db=float(to_db(summary.floor_rise)),
        detection_gain=None if gain is None else _interval(gain.detection),
        ghosts_gain=None if gain is None else _interval(gain.ghosts),
    )


def _gain(results: Results, point: int) -> Difference | None:
    """Difference from the conventional waveform; None for it, and if it has no trials."""
    count, curve = results.labels(point)
    waveform, situation = CURVES[_CURVE_LABELS.index(str(curve))]
    labels = [results.labels(number) for number in range(len(results.study_hash))]
    reference = (count, f"conventional, {situation}")
    if waveform == "conventional" or reference not in labels:
        return None
    return paired_difference(results, (labels.index(reference), point), axis=1, victim=0)


def _median(errors: FloatArray) -> float:
    """Median of the absolute values of all finite errors; NaN if there are none."""
    sizes = np.abs(errors[np.isfinite(errors)])
    return float(np.median(sizes)) if sizes.size else math.nan


def _interval(estimate: Estimate, *, scale: float = 1.0) -> Interval:
    return scale * estimate.value, scale * estimate.low, scale * estimate.high
