"""The nature of every detection: a target, a further echo, or a ghost, and its kind."""

from collections.abc import Sequence
from enum import Enum

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS
from polychirp.model.paths import PropagationPaths
from polychirp.scoring.association import Gate


class Nature(Enum):
    """Cause of a detection."""

    TARGET = "target"
    ECHO = "echo"
    """A real echo of some body, wall or road that is not on the list of targets."""
    MULTIPATH = "multipath"
    """An own echo reflected by a plane: nothing is at that place."""
    DIRECT = "direct"
    INDIRECT = "indirect"
    FRONT_END = "front-end"
    """Caused in the radar itself: leakage, a bumper, clipping, quantisation, an offset."""
    UNEXPLAINED = "unexplained"
    """A false alarm, or a residue of the processing."""

    @property
    def is_ghost(self) -> bool:
        """True if nothing is at that place."""
        return self not in (Nature.TARGET, Nature.ECHO)


_BY_PART = {
    "direct": Nature.DIRECT,
    "indirect": Nature.INDIRECT,
    "leakage": Nature.FRONT_END,
    "distortion": Nature.FRONT_END,
}

HIDING_RATIO = 100.0
"""Ratio of interference to an own echo in the same cell above which the detection is that of the
interference: 20 dB. Chosen: an interferer's floor may be above the echo of a real wall."""


def natures(
    detections: Detections,
    powers: FloatArray,
    own_paths: PropagationPaths,
    *,
    targets: Sequence[int],
    gate: Gate,
) -> tuple[Nature, ...]:
    """Nature of every detection.

    A detection is an echo if an own path of the same range and rate exists, and the own echo is
    above the noise and not hidden by interference. Otherwise the strongest part decides: a signal
    of another radar makes a direct or indirect ghost, the radar's own front end a front-end ghost.
    The rest is multipath if a reflected own path exists, and otherwise unexplained.

    Parameters
    ----------
    powers : W, ``(detection, part)`` in the order of `PARTS`
    own_paths : of the victim to itself, at the time of the detections
    targets : numbers of the detections that belong to targets
    """
    is_target = np.isin(np.arange(detections.num_detections), list(targets))
    is_there = _has_path(detections, own_paths.select(~own_paths.is_mirrored), gate)
    is_mirrored = _has_path(detections, own_paths.select(own_paths.is_mirrored), gate)
    part = {name: powers[:, n] for n, name in enumerate(PARTS)}
    own = part["echo"] + part["multipath"]
    is_above_rest = (own > part["noise"]) & (own * HIDING_RATIO > part["direct"] + part["indirect"])
    strongest = np.argmax(powers, axis=1)

    def nature(n: int) -> Nature:
        if is_target[n]:
            return Nature.TARGET
        if is_there[n] and is_above_rest[n]:
            return Nature.ECHO
        name = PARTS[int(strongest[n])]
        if name in _BY_PART:
            return _BY_PART[name]
        return Nature.MULTIPATH if is_mirrored[n] and is_above_rest[n] else Nature.UNEXPLAINED

    return tuple(nature(n) for n in range(detections.num_detections))


def dominated_by_interference(powers: FloatArray) -> BoolArray:
    """Mask of the detections that another radar's signal causes, ``(detection,)``."""
    own = powers[:, PARTS.index("echo")] + powers[:, PARTS.index("multipath")]
    other = powers[:, PARTS.index("direct")] + powers[:, PARTS.index("indirect")]
    return np.asarray(other > HIDING_RATIO * own)


def _has_path(detections: Detections, paths: PropagationPaths, gate: Gate) -> BoolArray:
    """Mask of the detections that have a path of their range and rate, ``(detection,)``."""
    distance = 0.5 * SPEED_OF_LIGHT * paths.delay
    rate = 0.5 * SPEED_OF_LIGHT * paths.delay_rate
    near = (np.abs(distance - detections.range[:, None]) <= gate.range) & (
        np.abs(rate - detections.range_rate[:, None]) <= gate.range_rate
    )
    return np.asarray(np.any(near, axis=1))
