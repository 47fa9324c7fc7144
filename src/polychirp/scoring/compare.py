"""Detections against truth: targets found and missed, their errors and extents, and ghosts."""

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.detection import Detections
from polychirp.model.extent import Extent, extent_of
from polychirp.model.if_frame import PARTS
from polychirp.model.score import Score
from polychirp.model.target_levels import TargetLevels
from polychirp.model.truth import Truth
from polychirp.scoring.association import Gate, seen_azimuths
from polychirp.scoring.causes import causes
from polychirp.scoring.echoes import Echoes
from polychirp.scoring.sight import in_sight


def compare(
    detections: Detections,
    truth: Truth,
    *,
    powers: FloatArray,
    echoes: Echoes,
    floor_rise: float,
    before: TargetLevels,
    after: TargetLevels,
    echo_snr: FloatArray,
    fluctuation: FloatArray | float = 1.0,
    gate: Gate | None = None,
) -> Score:
    """Score the detections of one radar, the victim, in one frame.

    Parameters
    ----------
    powers : W, power of every part in every detection, ``(detection, part)``
    echoes : paths from the victim back to itself during the frame, moved to the time of the
        detections (`mean_echoes`)
    floor_rise : ratio of the range spectra's floor to the noise alone; the score passes it on
    before, after : echo and interference over noise at every target, before and after mitigation
    echo_snr : coherent SNR of the whole echo of every target, a ratio, which says with the truth
        what is in sight, ``(target,)``
    fluctuation : power of the echo of a fluctuating target over its mean, ``(target,)``: a target
        whose echo fades is not out of sight, but missed
    gate : margins of a detection; None is `Gate` by default
    """
    found = causes(detections, truth, powers=powers, echoes=echoes, gate=gate or Gate())
    target, detection = found.association
    seen = seen_azimuths(
        truth.azimuth[target], truth.elevation[target], detections.elevation[detection]
    )
    extents = [_extent(detections, mine) for mine in found.is_on_target]

    def per_target(values: FloatArray) -> FloatArray:
        out = np.full(len(truth.name), np.nan)
        out[target] = values
        return out

    is_detected = np.zeros(len(truth.name), dtype=bool)
    is_detected[target] = True
    is_in_sight = in_sight(truth, echo_snr / np.maximum(fluctuation, 1e-300))
    return Score(
        is_detected=is_detected,
        range_error=per_target(detections.range[detection] - truth.range[target]),
        range_rate_error=per_target(detections.range_rate[detection] - truth.range_rate[target]),
        azimuth_error=per_target(detections.azimuth[detection] - seen),
        elevation_error=per_target(detections.elevation[detection] - truth.elevation[target]),
        detection_sinr=per_target(_sinr(powers)[detection]),
        echo_snr=echo_snr,
        is_in_sight=is_in_sight,
        snr=before.snr,
        inr=before.inr,
        mitigated_sinr=after.sinr,
        num_points=np.array([one.num_points for one in extents], dtype=np.float64),
        length=np.array([one.length for one in extents]),
        width=np.array([one.width for one in extents]),
        range_rate_span=np.array([one.range_rate_span for one in extents]),
        nature=tuple(nature.value for nature in found.nature),
        body=found.body,
        power=detections.power,
        target_detection=tuple(int(n) for n in detection),
        num_missed=int(np.sum(is_in_sight & ~is_detected)),
        floor_rise=floor_rise,
        num_unresolved=detections.num_unresolved,
    )


def _extent(detections: Detections, mine: BoolArray) -> Extent:
    """Extent of the detections in a mask ``(detection,)``; of objects, at least the largest one."""
    places = extent_of(
        range=detections.range[mine],
        range_rate=detections.range_rate[mine],
        azimuth=detections.azimuth[mine],
    )

    def at_least(value: float, of_objects: FloatArray) -> float:
        return max(value, float(of_objects[mine].max(initial=0.0)))

    return Extent(
        num_points=int(detections.num_points[mine].sum()),
        length=at_least(places.length, detections.length),
        width=at_least(places.width, detections.width),
        range_rate_span=at_least(places.range_rate_span, detections.range_rate_span),
    )


def _sinr(powers: FloatArray) -> FloatArray:
    """Power of echo and multipath over that of all other parts, ``(detection,)``."""
    is_own = np.isin(PARTS, ("echo", "multipath"))
    disturbed = powers[:, ~is_own].sum(axis=1)
    return np.asarray(powers[:, is_own].sum(axis=1) / np.maximum(disturbed, 1e-300))
