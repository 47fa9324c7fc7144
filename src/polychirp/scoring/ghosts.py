"""What a detection is that is no target: a further echo, or a ghost, and of which kind."""

from __future__ import annotations

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
    """What a detection really is."""

    TARGET = "target"
    ECHO = "echo"
    """A real echo of some body, wall or road that is not on the list of targets."""
    MULTIPATH = "multipath"
    """An own echo by way of a mirror, where there is nothing."""
    DIRECT = "direct"
    INDIRECT = "indirect"
    FRONT_END = "front-end"
    """Made in the radar itself: leakage, a bumper, clipping, quantisation, an offset."""
    UNEXPLAINED = "unexplained"
    """A false alarm, or left over by the processing."""

    @property
    def is_ghost(self) -> bool:
        """Whether nothing is there."""
        return self not in (Nature.TARGET, Nature.ECHO)


_BY_PART = {
    "direct": Nature.DIRECT,
    "indirect": Nature.INDIRECT,
    "leakage": Nature.FRONT_END,
    "distortion": Nature.FRONT_END,
}

DROWNED = 100.0
"""Ratio to an own echo above which interference in the same cell is no longer its neighbour."""


def natures(
    detections: Detections,
    powers: FloatArray,
    own_paths: PropagationPaths,
    *,
    targets: Sequence[int],
    gate: Gate,
) -> tuple[Nature, ...]:
    """What every detection is.

    Where an own path of the same range and rate exists, and what it brings stands above the
    noise and is not drowned in interference, something is there. Where none does, the part that
    gives the detection most of its power decides: another radar's signal makes a ghost, direct
    or indirect; the radar's own front end makes one too; an own echo by way of a mirror is
    multipath; the rest is unexplained.

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
    is_heard = (own > part["noise"]) & (own * DROWNED > part["direct"] + part["indirect"])
    strongest = np.argmax(powers, axis=1)

    def nature(n: int) -> Nature:
        if is_target[n]:
            return Nature.TARGET
        if is_there[n] and is_heard[n]:
            return Nature.ECHO
        name = PARTS[int(strongest[n])]
        if name in _BY_PART:
            return _BY_PART[name]
        return Nature.MULTIPATH if is_mirrored[n] and is_heard[n] else Nature.UNEXPLAINED

    return tuple(nature(n) for n in range(detections.num_detections))


def dominated_by_interference(powers: FloatArray) -> BoolArray:
    """Detections that another radar's signal makes, ``(detection,)``."""
    own = powers[:, PARTS.index("echo")] + powers[:, PARTS.index("multipath")]
    other = powers[:, PARTS.index("direct")] + powers[:, PARTS.index("indirect")]
    return np.asarray(other > DROWNED * own)


def _has_path(detections: Detections, paths: PropagationPaths, gate: Gate) -> BoolArray:
    """Whether a path of each detection's range and rate exists, ``(detection,)``."""
    distance = 0.5 * SPEED_OF_LIGHT * paths.delay
    rate = 0.5 * SPEED_OF_LIGHT * paths.delay_rate
    near = (np.abs(distance - detections.range[:, None]) <= gate.range) & (
        np.abs(rate - detections.range_rate[:, None]) <= gate.range_rate
    )
    return np.asarray(np.any(near, axis=1))
