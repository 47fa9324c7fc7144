"""Estimates from results: for each point, and for differences of two points along an axis."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.frame_history import frames_until_free, longest_run
from polychirp.scoring.causes import Nature
from polychirp.scoring.statistics import (
    Estimate,
    mean_count,
    proportion,
    ratio_difference,
    rms,
    rms_difference,
)
from polychirp.study.monte_carlo.grid import Label
from polychirp.study.monte_carlo.records import NATURES
from polychirp.study.monte_carlo.results import Results

ERROR_NAMES: Final = ("range", "range_rate", "azimuth", "elevation")
"""Quantities whose rms errors are estimated."""

_IS_GHOST: Final = np.array([Nature(name).is_ghost for name in NATURES])
_UNEXPLAINED: Final = NATURES.index(Nature.UNEXPLAINED.value)
"""Mask of the ghosts among `NATURES`, and number of the unexplained ones there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """Estimates for one radar at one point, from all its trials.

    Every estimate has a 95 % interval; a trial counts as one draw (`scoring.statistics`).
    `summaries` returns them.

    Parameters
    ----------
    labels : label of the point on each axis
    study_hash : hash of the study of the point
    victim : name of the radar
    num_trials : number of trials with a result
    detection : probability that a target in sight is detected (`scoring.sight`)
    ghost : probability that a frame has at least one ghost
    ghosts, unexplained, missed : mean number in a frame; ``unexplained`` are the ghosts that no
        signal of a radar explains: noise, or errors of the processing
    out_of_sight : mean number in a frame of the targets that no receiver could find
    unresolved : mean number in a frame of the detections that the receiver left out, since it could
        not resolve their range rates (`Detections`)
    floor_rise : power ratio, median over trials
    snr, inr, sinr, mitigated_sinr : power ratios in the cells of targets in sight, detected or not:
        medians over targets and trials; the last after mitigation, the others before it
    range_rmse, range_rate_rmse, azimuth_rmse, elevation_rmse : rms errors of detected targets in
        sight, m, m/s, rad, rad; limits of angles are π at most
    lost : share of the frames that interference takes, of a rule that acts from frame to frame
    longest_loss, until_free : mean of the greatest number of frames lost in a row, and of the
        number lost before the first free one
    """

    labels: tuple[Label, ...]
    study_hash: str
    victim: str
    num_trials: int
    detection: Estimate
    ghost: Estimate
    ghosts: Estimate
    unexplained: Estimate
    missed: Estimate
    out_of_sight: Estimate
    unresolved: Estimate
    floor_rise: float
    snr: float
    inr: float
    sinr: float
    mitigated_sinr: float
    range_rmse: Estimate
    range_rate_rmse: Estimate
    azimuth_rmse: Estimate
    elevation_rmse: Estimate
    lost: Estimate
    longest_loss: Estimate
    until_free: Estimate


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Difference of one radar's estimates at two points that differ on one axis, trials paired.

    Parameters
    ----------
    axis : name of the axis of the grid
    first, other : the first label of the axis, and the label with which it is compared
    labels : label of the point with ``other`` on each axis
    victim : name of the radar
    num_trials : number of trials that both points have
    detection, ghosts : other minus first: detection probability, mean number of ghosts in a frame
    range_rmse, range_rate_rmse, azimuth_rmse, elevation_rmse : other minus first: rms errors, m,
        m/s, rad, rad
    """

    axis: str
    first: Label
    other: Label
    labels: tuple[Label, ...]
    victim: str
    num_trials: int
    detection: Estimate
    ghosts: Estimate
    range_rmse: Estimate
    range_rate_rmse: Estimate
    azimuth_rmse: Estimate
    elevation_rmse: Estimate


@dataclass(frozen=True, slots=True, kw_only=True)
class _Counts:
    """Sums per trial, ``(trial,)``: ``found`` counts detected targets, ``seen`` those in sight."""

    trial: FloatArray
    found: FloatArray
    seen: FloatArray
    ghosts: FloatArray
    unexplained: FloatArray
    squares: dict[str, FloatArray]

    def only(self, trials: FloatArray) -> "_Counts":
        """The same for the trials with these numbers alone."""
        kept = np.isin(self.trial, trials)
        return _Counts(
            trial=self.trial[kept],
            found=self.found[kept],
            seen=self.seen[kept],
            ghosts=self.ghosts[kept],
            unexplained=self.unexplained[kept],
            squares={name: values[kept] for name, values in self.squares.items()},
        )


def _counts(results: Results, point: int, victim: int) -> _Counts:
    was_run = ~np.isnan(results.num_detections[point, :, victim, 0])
    detected = results.detected[point, was_run, victim]
    counts = results.num_detections[point, was_run, victim]
    errors = {
        name: in_sight_only(results, f"{name}_error", point)[was_run, victim]
        for name in ERROR_NAMES
    }
    return _Counts(
        trial=np.flatnonzero(was_run).astype(np.float64),
        found=np.nansum(detected, axis=1),
        seen=np.sum(~np.isnan(detected), axis=1).astype(np.float64),
        ghosts=counts[:, _IS_GHOST].sum(axis=1),
        unexplained=counts[:, _UNEXPLAINED],
        squares={name: _sum_of_squares(values) for name, values in errors.items()},
    )


def in_sight_only(results: Results, name: str, point: int) -> FloatArray:
    """The array ``name`` of `Results` at a point, NaN for targets out of sight, detected or not."""
    return np.where(np.isnan(results.detected[point]), np.nan, getattr(results, name)[point])


def _sum_of_squares(errors: FloatArray) -> FloatArray:
    """Sum of squares over detected targets, ``(trial,)``; all NaN if no trial has an error."""
    if np.all(np.isnan(errors)):
        return np.full(len(errors), np.nan)
    return np.asarray(np.nansum(errors**2, axis=1))


def summaries(results: Results) -> list[Summary]:
    """`Summary` of every radar at every point of `Results`."""
    return [
        _summary(results, point, victim)
        for point in range(len(results.study_hash))
        for victim in range(len(results.victim))
        if _counts(results, point, victim).trial.size
    ]


def _summary(results: Results, point: int, victim: int) -> Summary:
    counts = _counts(results, point, victim)
    is_seen = np.isfinite(results.detected[point, :, victim])
    snr, inr, mitigated = (
        levels[point, :, victim][is_seen]
        for levels in (results.snr, results.inr, results.mitigated_sinr)
    )
    ones = np.ones(counts.trial.size)
    hidden = _finite(results.num_out_of_sight[point, :, victim])
    num_targets = len(results.target)
    return Summary(
        labels=results.labels(point),
        study_hash=results.study_hash[point],
        victim=results.victim[victim],
        num_trials=int(counts.trial.size),
        detection=proportion(counts.found, counts.seen),
        ghost=proportion((counts.ghosts > 0).astype(np.float64), ones),
        ghosts=mean_count(counts.ghosts),
        unexplained=mean_count(counts.unexplained),
        missed=mean_count(counts.seen - counts.found).within(0.0, num_targets),
        out_of_sight=mean_count(hidden).within(0.0, num_targets),
        unresolved=mean_count(_finite(results.num_unresolved[point, :, victim])),
        floor_rise=_median(results.floor_rise[point, :, victim]),
        snr=_median(snr),
        inr=_median(inr),
        sinr=_median(snr / (1.0 + inr)),
        mitigated_sinr=_median(mitigated),
        range_rmse=rms(counts.squares["range"], counts.found),
        range_rate_rmse=rms(counts.squares["range_rate"], counts.found),
        azimuth_rmse=rms(counts.squares["azimuth"], counts.found).within(0.0, math.pi),
        elevation_rmse=rms(counts.squares["elevation"], counts.found).within(0.0, math.pi),
        **losses(results.lost[point, :, victim : victim + 1]),
    )


def losses(lost: FloatArray) -> dict[str, Estimate]:
    """Estimates of `Summary` from frames that are lost (1) or not (0), ``(trial, victim, frame)``.

    A trial counts as one draw, whatever the number of its victims. Frames that no trial has, since
    the rule of another point has more, and trials with NaN, which were not run, are left out.
    """
    lost = lost[:, :, ~np.all(np.isnan(lost), axis=(0, 1))]
    is_known = ~np.any(np.isnan(lost), axis=(1, 2)) if lost.size else np.zeros(len(lost), bool)
    lost = lost[is_known]

    def mean_over_victims(count: Callable[[BoolArray], int]) -> Estimate:
        means = [np.mean([count(row) for row in frames]) for frames in lost == 1.0]
        return mean_count(np.array(means, dtype=np.float64)).within(0.0, lost.shape[-1])

    return {
        "lost": proportion(lost.sum(axis=(1, 2)), np.full(len(lost), float(lost[0:1].size))),
        "longest_loss": mean_over_victims(longest_run),
        "until_free": mean_over_victims(frames_until_free),
    }


def _finite(values: FloatArray) -> FloatArray:
    return np.asarray(values[np.isfinite(values)])


def _median(values: FloatArray) -> float:
    """Median of the finite values; NaN if there are none."""
    known = _finite(values)
    return float(np.median(known)) if known.size else float("nan")


def differences(results: Results) -> list[Difference]:
    """Differences, along every axis and for every radar, from the point with the first label."""
    return [
        paired_difference(results, pair, axis=axis, victim=victim)
        for axis in range(len(results.axes))
        for pair in _neighbours(results, axis)
        for victim in range(len(results.victim))
        if all(_counts(results, point, victim).trial.size for point in pair)
    ]


def _neighbours(results: Results, axis: int) -> Iterator[tuple[int, int]]:
    """Pairs of points that differ on ``axis`` only; the first has the first label there."""
    numbers = np.arange(len(results.study_hash)).reshape(results.shape)
    lines = np.moveaxis(numbers, axis, -1).reshape(-1, results.shape[axis])
    for first, *others in lines.tolist():
        yield from ((first, other) for other in others)


def paired_difference(
    results: Results, pair: tuple[int, int], *, axis: int, victim: int
) -> Difference:
    """Difference of the second of two points from the first; they differ on one axis only."""
    counts = [_counts(results, point, victim) for point in pair]
    common = np.intersect1d(counts[0].trial, counts[1].trial)
    first, other = (one.only(common) for one in counts)
    ones = np.ones(common.size)
    detection = ratio_difference((other.found, other.seen), (first.found, first.seen))
    labels = results.labels(pair[1])

    def rmse(name: str) -> Estimate:
        return rms_difference(
            (other.squares[name], other.found), (first.squares[name], first.found)
        )

    return Difference(
        axis=results.axes[axis][0],
        first=results.labels(pair[0])[axis],
        other=labels[axis],
        labels=labels,
        victim=results.victim[victim],
        num_trials=int(common.size),
        detection=detection.within(-1.0, 1.0),
        ghosts=ratio_difference((other.ghosts, ones), (first.ghosts, ones)),
        range_rmse=rmse("range"),
        range_rate_rmse=rmse("range_rate"),
        azimuth_rmse=rmse("azimuth").within(-math.pi, math.pi),
        elevation_rmse=rmse("elevation").within(-math.pi, math.pi),
    )
