"""One frame of a plan: the receivers on it, and which of their detections are the point's."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.detection import Detections
from polychirp.rng import Streams
from polychirp.study.monte_carlo.tasks import Outcome, Task, outcome_of
from polychirp.study.roc.frames import DrawnPoint, drawn_points, frame_with, middle_of
from polychirp.study.roc.plan import RocPlan, as_read, case_name, of_trial
from polychirp.study.roc.yardsticks import Extent, error_limits
from polychirp.units import from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class RocRecord:
    """Result of one frame.

    Parameters
    ----------
    case, trial : name of the case (`plan.case_name`), and number of the trial
    found : for each curve, True if the tested point has a detection of its own. In frames without
        a point, True if noise has a detection where a point might have been
    others : for each curve, number of detections that are of no point
    """

    case: str
    trial: int
    found: tuple[bool, ...]
    others: tuple[int, ...]

    @classmethod
    def of(cls, content: dict[str, Any]) -> Self:
        """The record in the content of a line of the log."""
        return cls(
            case=content["case"],
            trial=content["trial"],
            found=tuple(content["found"]),
            others=tuple(content["others"]),
        )


def attempt_frame(plan: RocPlan, task: Task) -> Outcome:
    """Compute and read one frame; an exception becomes the failure of the outcome."""
    return outcome_of(task, lambda: measured(plan, plan.cases[task.point], task.trial))


def measured(plan: RocPlan, snr_db: float | None, trial: int) -> RocRecord:
    """The record of one frame; SNR in dB, None for a frame without a point.

    The ramps, and the errors of the array, follow from the seed of the trial; the point and the
    noise from the seed and the SNR.
    """
    study = of_trial(plan.study, trial)
    streams = Streams(study.seed).of("roc", case_name(snr_db))
    snr = 1.0 if snr_db is None else from_db(snr_db)
    strong = None if snr_db is None else plan.strong
    points = drawn_points(plan.window, strong, snr=snr, random=streams["points"])
    frame = frame_with(study, () if snr_db is None else points, streams=streams)
    middle = middle_of(frame.schedule)
    found, others = [], []
    for curve in plan.curves:
        seen = curve.receiver.detect(as_read(curve.receiver, frame))
        limits = error_limits(curve.receiver, frame.schedule, frame.times)
        is_found = found_points(seen, points, limits=limits, middle=middle)
        found.append(bool(is_found[0]))
        own = 0 if snr_db is None else int(is_found.sum())
        others.append(seen.num_detections - own)
    return RocRecord(case=case_name(snr_db), trial=trial, found=tuple(found), others=tuple(others))


def found_points(
    seen: Detections, points: Sequence[DrawnPoint], *, limits: Extent, middle: float
) -> BoolArray:
    """Mask of the points that have a detection of their own within the limits, ``(point,)``.

    ``middle`` is the time in the middle of the frame, s, to which the points refer.
    """
    from scipy.optimize import linear_sum_assignment

    error = _errors(seen, points, limits=limits, middle=middle)
    is_found = np.zeros(len(points), dtype=np.bool_)
    point, detection = linear_sum_assignment(np.minimum(error, 1e3))
    is_found[point] = error[point, detection] <= 1.0
    return is_found


def _errors(
    seen: Detections, points: Sequence[DrawnPoint], *, limits: Extent, middle: float
) -> FloatArray:
    """Errors of every detection as that of every point, over the limits: ``(point, detection)``."""
    states = np.array([point.at(seen.time - middle) for point in points])
    distance = np.abs(seen.range - states[:, :1]) / limits.range
    rate = np.abs(seen.range_rate - states[:, 1:]) / limits.range_rate
    return np.where(np.maximum(distance, rate) <= 1.0, np.maximum(distance, rate), np.inf)
