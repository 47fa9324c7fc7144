"""Estimates of a measurement of detection: probabilities and rates with 95 % intervals."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.scoring.ideal_detector import cell_threshold, ideal_detection, needed_snr
from polychirp.scoring.statistics import (
    UNKNOWN_ESTIMATE,
    Estimate,
    mean_count,
    poisson_mean,
    proportion,
)
from polychirp.study.roc.plan import Curve, RocPlan, as_read, case_name, silent_frame
from polychirp.study.roc.trial import RocRecord
from polychirp.study.roc.yardsticks import (
    Extent,
    num_cells,
    num_looks,
    stated_threshold,
    window_share,
)
from polychirp.units import from_db, to_db

HALF: Final = 0.5
"""Detection probability at which receivers are compared with the ideal detector; chosen: there the
curves are steepest."""


_PIECES: Final = 8
"""Number of pieces of an ideal detector's line for each measured SNR; chosen: it looks smooth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoint:
    """A receiver at one SNR.

    Parameters
    ----------
    curve : number of the curve
    snr_db : coherent SNR of the point, dB
    num_trials : number of frames
    detection : probability that the point is found
    ideal : that of the ideal detector
    ideal_windowed : that of the ideal detector at the greatest SNR that the receiver's windows
        leave in a cell; NaN if the receiver has no such cell
    others : number of detections in a frame that are of no point
    """

    curve: int
    snr_db: float
    num_trials: int
    detection: Estimate
    ideal: float
    ideal_windowed: float
    others: Estimate


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseRow:
    """A receiver on frames without a point.

    Parameters
    ----------
    num_trials : number of frames
    detections : number of detections in a frame
    stated : greatest number of them by the receiver's false-alarm probability; NaN without one
    num_cells : number of cells of a frame (`yardsticks.num_cells`)
    chance : probability that a detection is where a point might have been
    """

    curve: int
    num_trials: int
    detections: Estimate
    stated: float
    num_cells: float
    chance: Estimate

    @property
    def per_cell(self) -> Estimate:
        """Number of detections per cell."""
        found = self.detections
        return Estimate(
            value=found.value / self.num_cells,
            low=found.low / self.num_cells,
            high=found.high / self.num_cells,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Needed:
    """SNR at which a receiver detects half of the points, dB, and that of the ideal detector.

    Parameters
    ----------
    snr_db : interpolated between the measured SNRs; NaN if these do not enclose it
    ideal_db, windowed_db : of the ideal detector, and of that with the receiver's windows
    """

    curve: int
    snr_db: Estimate
    ideal_db: float
    windowed_db: float


@dataclass(frozen=True, slots=True, kw_only=True)
class IdealLine:
    """Detection probability of the ideal detector between the measured SNRs, for a drawing.

    Parameters
    ----------
    snr_db : dB
    ideal, windowed : detection probabilities, as of `CurvePoint`
    """

    snr_db: tuple[float, ...]
    ideal: tuple[float, ...]
    windowed: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RocSummary:
    """All estimates of a plan.

    Parameters
    ----------
    curves : the plan's curves, by their number
    looks : number of channels whose powers the ideal detector adds, for each curve
    limits : errors up to which a detection is that of a point, for each curve; in the first trial,
        if ramps are drawn
    lines : of the ideal detector, for each curve
    """

    curves: tuple[Curve, ...]
    looks: tuple[int, ...]
    limits: tuple[Extent, ...]
    points: tuple[CurvePoint, ...]
    noise: tuple[NoiseRow, ...]
    needed: tuple[Needed, ...]
    lines: tuple[IdealLine, ...]

    def of_curve(self, curve: int) -> tuple[CurvePoint, ...]:
        """Points of one curve, in the order of SNR."""
        return tuple(point for point in self.points if point.curve == curve)


def summary_of(plan: RocPlan, records: Iterable[RocRecord]) -> RocSummary:
    """Estimates from the records of a plan's frames; those of other frames are left out."""
    by_case = _by_case(plan, records)
    silent = silent_frame(plan)
    points: list[CurvePoint] = []
    noise, needed, looks, lines = [], [], [], []
    for number, curve in enumerate(plan.curves):
        frame = as_read(curve.receiver, silent)
        looks.append(num_looks(curve.receiver, frame))
        cells = num_cells(curve.receiver, frame)
        row = _noise_row(plan, number, cells, by_case[case_name(None)])
        threshold = stated_threshold(curve.receiver, looks=looks[-1])
        if threshold is None:
            threshold = _threshold_of_rate(row.per_cell.value, looks[-1])
        share = window_share(curve.receiver, frame)
        ideal = _Ideal(looks=looks[-1], threshold=threshold, share=share)
        mine = [
            _curve_point(number, snr_db, by_case[case_name(snr_db)], ideal)
            for snr_db in plan.snrs_db
        ]
        points += mine
        noise.append(row)
        needed.append(_needed(number, mine, ideal))
        lines.append(ideal.line(plan.snrs_db))
    return RocSummary(
        curves=plan.curves,
        looks=tuple(looks),
        limits=plan.limits,
        points=tuple(points),
        noise=tuple(noise),
        needed=tuple(needed),
        lines=tuple(lines),
    )


def _by_case(plan: RocPlan, records: Iterable[RocRecord]) -> Mapping[str, list[RocRecord]]:
    """Records of the plan's trials by their case, in the order of trials."""
    limit = {case_name(snr): plan.num_trials(n) for n, snr in enumerate(plan.cases)}
    chosen: dict[str, list[RocRecord]] = {name: [] for name in limit}
    for record in records:
        if record.trial < limit.get(record.case, 0):
            chosen[record.case].append(record)
    return {name: sorted(some, key=lambda one: one.trial) for name, some in chosen.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ideal:
    """The ideal detector beside a curve, and the share of the SNR that windows leave."""

    looks: int
    threshold: float
    share: float

    def at(self, snr: float) -> float:
        return float(ideal_detection(snr, num_channels=self.looks, threshold=self.threshold))

    def windowed_at(self, snr: float) -> float:
        return math.nan if math.isnan(self.share) else self.at(self.share * snr)

    def line(self, snrs_db: Sequence[float]) -> IdealLine:
        places = np.linspace(snrs_db[0], snrs_db[-1], _PIECES * (len(snrs_db) - 1) + 1)
        snrs = [from_db(place) for place in places]
        return IdealLine(
            snr_db=tuple(places.tolist()),
            ideal=tuple(self.at(snr) for snr in snrs),
            windowed=tuple(self.windowed_at(snr) for snr in snrs),
        )

    @property
    def needed(self) -> float:
        """SNR for `HALF`, dB."""
        snr = needed_snr(HALF, num_channels=self.looks, threshold=self.threshold)
        return float(to_db(snr))


def _threshold_of_rate(rate: float, looks: int) -> float:
    """Threshold of the ideal detector at a measured number of detections per cell.

    Without any detection it is that of one in 10¹² cells, the least that a receiver may state.
    """
    return cell_threshold(min(max(rate, 1e-12), 0.5), num_channels=looks)


def _noise_row(plan: RocPlan, number: int, cells: float, records: Sequence[RocRecord]) -> NoiseRow:
    # peaks of noise are independent; those of interference come together
    estimate = poisson_mean if len(plan.study.radars) == 1 else mean_count
    counts = np.array([record.others[number] for record in records], dtype=np.float64)
    return NoiseRow(
        curve=number,
        num_trials=len(records),
        detections=estimate(counts),
        stated=plan.curves[number].probability * cells,
        num_cells=cells,
        chance=_share([record.found[number] for record in records]),
    )


def _curve_point(
    number: int, snr_db: float, records: Sequence[RocRecord], ideal: _Ideal
) -> CurvePoint:
    others = np.array([record.others[number] for record in records], dtype=np.float64)
    return CurvePoint(
        curve=number,
        snr_db=snr_db,
        num_trials=len(records),
        detection=_share([record.found[number] for record in records]),
        ideal=ideal.at(from_db(snr_db)),
        ideal_windowed=ideal.windowed_at(from_db(snr_db)),
        others=mean_count(others),
    )


def _share(hits: Sequence[bool]) -> Estimate:
    if not hits:
        return UNKNOWN_ESTIMATE
    return proportion(np.array(hits, dtype=np.float64), np.ones(len(hits)))


def _needed(number: int, points: Sequence[CurvePoint], ideal: _Ideal) -> Needed:
    snrs = [point.snr_db for point in points]
    # a higher probability is reached at a lower SNR: the limits change places
    value, low, high = (
        crossing(snrs, [getattr(point.detection, name) for point in points], HALF)
        for name in ("value", "high", "low")
    )
    best = ideal.needed
    windowed = best - float(to_db(ideal.share)) if math.isfinite(ideal.share) else math.nan
    return Needed(
        curve=number,
        snr_db=Estimate(value=value, low=low, high=high),
        ideal_db=best,
        windowed_db=windowed,
    )


def crossing(places: Sequence[float], values: Sequence[float], level: float) -> float:
    """Place where values, on straight lines between the places, last rise through a level.

    It is NaN if they do not.

    >>> crossing([10.0, 12.0, 14.0], [0.0, 0.25, 0.75], 0.5)
    13.0
    """
    for n in range(len(places) - 1, 0, -1):
        before, after = values[n - 1], values[n]
        if before < level <= after:
            step = (level - before) / (after - before)
            return places[n - 1] + step * (places[n] - places[n - 1])
    return math.nan
