"""The nature of every detection: a target, another echo, or one of several kinds of ghosts."""

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
    """The echo of a target."""
    ECHO = "echo"
    """An echo of a real body, wall or road at a place that is no target's own."""
    MULTIPATH = "multipath"
    """An own echo with a mirror on a part of its path: no body is at that place."""
    DIRECT = "direct"
    """Another radar's signal without a reflection."""
    INDIRECT = "indirect"
    """Another radar's signal that a body reflects."""
    FRONT_END = "front-end"
    """Caused in the radar itself: leakage, a bumper, clipping, quantisation, an offset."""
    UNEXPLAINED = "unexplained"
    """None of the other causes: noise, or an error of the processing."""

    @property
    def is_ghost(self) -> bool:
        """True if no body is at the place of the detection."""
        return self not in (Nature.TARGET, Nature.ECHO)


_BY_PART = {
    "direct": Nature.DIRECT,
    "indirect": Nature.INDIRECT,
    "leakage": Nature.FRONT_END,
    "distortion": Nature.FRONT_END,
}

HIDING_RATIO = 100.0
"""Ratio of powers, interference to own echo in one detection, above which the interference causes
the detection: 20 dB. Chosen above 0 dB because a real wall may be detected although the floor that
an interferer raises is above its echo."""


def natures(
    detections: Detections,
    powers: FloatArray,
    own_paths: PropagationPaths,
    *,
    targets: Sequence[int],
    gate: Gate,
) -> tuple[Nature, ...]:
    """Nature of every detection.

    The first of these rules that applies decides:

    1. A detection of a target is a target.
    2. It is an echo if an own path without a mirror has its range and range rate (within ``gate``)
       and the own echo is visible: above the noise, and less than `HIDING_RATIO` below the
       interference.
    3. It is a direct, indirect or front-end ghost if that is the part with the most power.
    4. It is multipath if an own path with a mirror has its range and range rate and the own echo is
       visible as in rule 2.
    5. It is unexplained.

    Parameters
    ----------
    powers : W, ``(detection, part)`` in the order of `PARTS`
    own_paths : of the victim to itself, at the time of the detections
    targets : numbers of the detections that belong to targets (`association`)
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
    """Mask of the detections whose interference is more than `HIDING_RATIO` above the own echo.

    It is ``(detection,)``; ``powers`` as for `natures`.
    """
    own = powers[:, PARTS.index("echo")] + powers[:, PARTS.index("multipath")]
    other = powers[:, PARTS.index("direct")] + powers[:, PARTS.index("indirect")]
    return np.asarray(other > HIDING_RATIO * own)


def _has_path(detections: Detections, paths: PropagationPaths, gate: Gate) -> BoolArray:
    """Mask of the detections with the range and range rate of a path, ``(detection,)``."""
    distance = 0.5 * SPEED_OF_LIGHT * paths.delay
    rate = 0.5 * SPEED_OF_LIGHT * paths.delay_rate
    near = (np.abs(distance - detections.range[:, None]) <= gate.range) & (
        np.abs(rate - detections.range_rate[:, None]) <= gate.range_rate
    )
    return np.asarray(np.any(near, axis=1))
