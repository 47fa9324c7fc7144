"""Association of detections with targets, one to one."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.model.detection import Detections
from polychirp.model.truth import Truth
from polychirp.spec import Spec
from polychirp.units import Metres, MetresPerSecond, Radians


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate(Spec):
    """Largest errors, to either side, with which a detection can still belong to a target.

    The errors are those of the range (m), range rate (m/s), azimuth and elevation (rad); the
    defaults are chosen. A detection without azimuth or elevation (NaN, from an array that does not
    measure it) meets any limit of that angle.
    """

    range: Metres = 0.4
    range_rate: MetresPerSecond = 1.0
    azimuth: Radians = np.pi / 12
    elevation: Radians = np.pi / 12


class Association(NamedTuple):
    """Numbers of the detected targets, and of the detection of each, in the same order."""

    target: IntArray
    detection: IntArray


def associate(
    detections: Detections, truth: Truth, *, gate: Gate, may_be_target: BoolArray | None = None
) -> Association:
    """Pairs of targets and detections, in which each target and each detection occurs once at most.

    Of the detections inside its gate a target gets the **strongest**: the nearest to the truth
    would make errors look smaller than they are. Of all pairings with the greatest number of pairs,
    the one with the greatest sum of detected powers in dB is chosen (Kuhn–Munkres algorithm). The
    mask ``may_be_target`` ``(detection,)`` is true for the detections that may be paired; by
    default, all may.
    """
    from scipy.optimize import linear_sum_assignment

    allowed = _inside(detections, truth, gate)
    if may_be_target is not None:
        allowed &= may_be_target
    if not np.any(allowed):
        return Association(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    level = np.log(np.maximum(detections.power, 1e-300))
    value = np.where(allowed, 1e3 + level - level.min(), 0.0)
    target, detection = linear_sum_assignment(value, maximize=True)
    kept = allowed[target, detection]
    return Association(np.asarray(target[kept]), np.asarray(detection[kept]))


def _inside(detections: Detections, truth: Truth, gate: Gate) -> BoolArray:
    """Mask of the pairs inside the gate, ``(target, detection)``, false for hidden targets."""

    def within(found: FloatArray, true: FloatArray, limit: float) -> BoolArray:
        return np.asarray(np.abs(found[None, :] - true[:, None]) <= limit)

    return (
        within(detections.range, truth.range, gate.range)
        & within(detections.range_rate, truth.range_rate, gate.range_rate)
        & (
            within(detections.azimuth, truth.azimuth, gate.azimuth)
            | np.isnan(detections.azimuth)[None, :]
        )
        & (
            within(detections.elevation, truth.elevation, gate.elevation)
            | np.isnan(detections.elevation)[None, :]
        )
        & truth.is_visible[:, None]
    )
