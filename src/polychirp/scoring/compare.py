"""Detections against truth: targets found and missed, their errors, and ghosts."""

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS
from polychirp.model.paths import PropagationPaths
from polychirp.model.score import Score
from polychirp.model.target_levels import TargetLevels
from polychirp.model.truth import Truth
from polychirp.scoring.association import Gate, associate
from polychirp.scoring.ghosts import dominated_by_interference, natures


def compare(
    detections: Detections,
    truth: Truth,
    *,
    powers: FloatArray,
    own_paths: PropagationPaths,
    floor_rise: float,
    before: TargetLevels,
    after: TargetLevels,
    gate: Gate | None = None,
) -> Score:
    """Score the detections of one radar, the victim, in one frame.

    Parameters
    ----------
    powers : W, power of every part in every detection, ``(detection, part)``
    own_paths : paths from the victim back to itself, at the time of the detections
    floor_rise : ratio of the range spectra's floor to the noise alone; the score passes it on
    before, after : echo and interference over noise at every target, before and after mitigation
    gate : largest differences between a detection and its target; None is `Gate` by default
    """
    gate = gate or Gate()
    target, detection = associate(
        detections, truth, gate=gate, may_be_target=~dominated_by_interference(powers)
    )

    def per_target(values: FloatArray) -> FloatArray:
        out = np.zeros(len(truth.name))
        out[target] = values
        return out

    is_detected = np.zeros(len(truth.name), dtype=bool)
    is_detected[target] = True
    return Score(
        is_detected=is_detected,
        range_error=per_target(detections.range[detection] - truth.range[target]),
        range_rate_error=per_target(detections.range_rate[detection] - truth.range_rate[target]),
        azimuth_error=per_target(detections.azimuth[detection] - truth.azimuth[target]),
        elevation_error=per_target(detections.elevation[detection] - truth.elevation[target]),
        sinr=per_target(_sinr(powers)[detection]),
        snr=before.snr,
        inr=before.inr,
        mitigated_sinr=after.sinr,
        nature=tuple(
            nature.value
            for nature in natures(
                detections, powers, own_paths, targets=detection.tolist(), gate=gate
            )
        ),
        power=detections.power,
        target_detection=tuple(int(n) for n in detection),
        num_missed=int(np.sum(truth.is_visible & ~is_detected)),
        floor_rise=floor_rise,
    )


def _sinr(powers: FloatArray) -> FloatArray:
    """Power of echo and multipath over that of all other parts, ``(detection,)``."""
    is_own = np.isin(PARTS, ("echo", "multipath"))
    disturbed = powers[:, ~is_own].sum(axis=1)
    return np.asarray(powers[:, is_own].sum(axis=1) / np.maximum(disturbed, 1e-300))
