"""Which detection belongs to which target, one to one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.model.detection import Detections
from polychirp.model.truth import Truth
from polychirp.spec import Spec
from polychirp.units import Metres, MetresPerSecond, Radians


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate(Spec):
    """Largest errors with which a detection still belongs to a target.

    An azimuth that is not known (NaN, from a single channel) is within any gate.
    """

    range: Metres = 0.4
    range_rate: MetresPerSecond = 1.0
    azimuth: Radians = np.pi / 12


def associate(
    detections: Detections, truth: Truth, *, gate: Gate, is_claim: BoolArray | None = None
) -> tuple[IntArray, IntArray]:
    """Pairs of target and detection: numbers of the targets, and of the detections they get.

    Inside the gate the **strongest** claim is taken, not the nearest: errors would look better
    than they are. One detection serves one target; the pairs are those that maximise the sum
    of powers in dB over the weakest (Kuhn–Munkres).

    Parameters
    ----------
    is_claim : detections that may be taken, ``(detection,)``; all where it is not given
    """
    from scipy.optimize import linear_sum_assignment

    allowed = _inside(detections, truth, gate)
    if is_claim is not None:
        allowed &= is_claim
    if not np.any(allowed):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    level = np.log(np.maximum(detections.power, 1e-300))
    worth = np.where(allowed, 1e3 + level - level.min(), 0.0)
    target, detection = linear_sum_assignment(worth, maximize=True)
    kept = allowed[target, detection]
    return np.asarray(target[kept]), np.asarray(detection[kept])


def _inside(detections: Detections, truth: Truth, gate: Gate) -> BoolArray:
    """``(target, detection)``."""

    def within(found: FloatArray, true: FloatArray, limit: float) -> BoolArray:
        return np.asarray(np.abs(found[None, :] - true[:, None]) <= limit)

    return (
        within(detections.range, truth.range, gate.range)
        & within(detections.range_rate, truth.range_rate, gate.range_rate)
        & (
            within(detections.azimuth, truth.azimuth, gate.azimuth)
            | np.isnan(detections.azimuth)[None, :]
        )
        & truth.is_visible[:, None]
    )
