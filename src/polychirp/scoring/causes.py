"""The cause of every detection: a target, another body, clutter, or one of several ghosts."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS
from polychirp.model.truth import Truth
from polychirp.scoring.association import (
    Association,
    Gate,
    angular_distances,
    associate,
    distances_from_bodies,
)
from polychirp.scoring.echoes import Echoes, power_by_body


class Nature(Enum):
    """Cause of a detection.

    Examples
    --------
    >>> Nature("direct").is_ghost, Nature("target").is_ghost
    (True, False)
    """

    TARGET = "target"
    """An echo of a target, on its visible metal."""
    BODY = "body"
    """An echo of a vehicle or object that is no target, or of a target beside its visible metal."""
    CLUTTER = "clutter"
    """An echo of a road, building, tree or street furniture."""
    MULTIPATH = "multipath"
    """An own echo with a mirror on a part of its path: no body is at that place."""
    DIRECT = "direct"
    """Another radar's signal without a reflection."""
    INDIRECT = "indirect"
    """Another radar's signal that a body reflects."""
    FRONT_END = "front-end"
    """Caused in the radar itself: leakage, a bumper, clipping, quantisation, an offset."""
    FOLDED = "folded"
    """An own echo beyond the range rates that the receiver tells apart: it has another one."""
    UNEXPLAINED = "unexplained"
    """None of the other causes: noise, or an error of the processing."""

    @property
    def is_ghost(self) -> bool:
        """True if no body is at the place of the detection."""
        return self not in (Nature.TARGET, Nature.BODY, Nature.CLUTTER, Nature.FOLDED)


MADE_BY_RADARS: Final = (Nature.DIRECT.value, Nature.INDIRECT.value, Nature.FRONT_END.value)
"""Natures of ghosts that interference or the radar itself makes, which mitigation may remove."""

_PARTS_OF: Final = {
    "own": ("echo", "multipath"),
    "interference": ("direct", "indirect"),
    "front end": ("leakage", "distortion"),
    "noise": ("noise",),
}
"""Parts of the samples that may cause a detection together."""

MIRROR_RATIO: Final = 9.0
"""Ratio of powers, multipath to echo, above which a detection is multipath. A road adds to the echo
one wave that it reflects on the way out, one on the way back and one on both; if it reflects all,
their sum has at most three times the echo's amplitude."""

FEWEST_MARGINS: Final = 4.0
"""Span of range rates, in margins of a detection, above which an echo may be called folded. Chosen:
within a span of two margins, every detection would be a folded echo of whatever has its range."""

HIDING_RATIO: Final = 10.0
"""Ratio of powers, echo of another body to that of a target within the margins of a detection,
above which the detection is not the target's. Chosen: an echo that is weaker by 10 dB is hidden
beside another one in the same cell."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Causes:
    """Causes of all detections.

    Parameters
    ----------
    nature : of every detection
    body : name of the body whose echo each detection is; None for ghosts
    is_on_target : true if a detection is an echo of a target, ``(target, detection)``; a detection
        belongs to one target at most
    association : found targets, and the detection that gives the errors of each
    """

    nature: tuple[Nature, ...]
    body: tuple[str | None, ...]
    is_on_target: BoolArray
    association: Association


def causes(
    detections: Detections, truth: Truth, *, powers: FloatArray, echoes: Echoes, gate: Gate
) -> Causes:
    """Cause of every detection.

    The powers of the parts say which signal causes a detection, and places say which body:

    1. The signal is that of the parts with the most power: own echo and multipath, interference,
       front end, or noise. A ghost on a body is therefore a ghost. Interference is direct or
       indirect, whichever is stronger; a detection of noise is unexplained.
    2. An own signal whose multipath is not above `MIRROR_RATIO` times the echo, as parts or as
       powers of the paths within the margins, since an echo fades, is a **target** if it lies on
       the target's visible metal (`association`), unless the echo of a body that is no target is
       above `HIDING_RATIO` times that of the target within the margins.
    3. Otherwise it is of the **body** or **clutter** whose paths within the margins have the most
       power. If there is none, paths in all directions count: those of two echoes in one cell, and
       those far beside the axis, are measured with large errors.
    4. An own signal without such a path is **multipath** if a mirrored path is within the margins
       of range and range rate. It is **folded** if a path without mirrors is, once some spans are
       subtracted from its range rate, and else unexplained.

    Parameters
    ----------
    powers : W, ``(detection, part)`` in the order of `PARTS`
    echoes : own paths of the radar during the frame, moved to the time of the detections
    """
    part = {name: powers[:, n] for n, name in enumerate(PARTS)}
    signal = _strongest_signal(part)
    near, at_range = _near(detections, echoes, gate)
    by_body = power_by_body(echoes, near)
    is_echo = part["multipath"] <= MIRROR_RATIO * part["echo"]
    is_echo |= _has_plain_paths(echoes, near)
    is_echo &= signal == "own"
    apart = distances_from_bodies(detections, truth, gate)
    may_be = (apart <= 1.0) & is_echo & ~_is_hidden(by_body, truth, echoes)
    pairs = associate(detections, truth, gate=gate, is_on_body=may_be)
    is_on_target = _nearest_of(may_be, apart, pairs)
    is_mirrored = np.any(at_range & echoes.is_mirrored[:, None], axis=0)
    by_body = np.where(np.any(by_body > 0, axis=0), by_body, power_by_body(echoes, at_range))
    folded = power_by_body(echoes, _near_folded(detections, echoes, gate))

    def cause(n: int) -> tuple[Nature, str | None]:
        if np.any(is_on_target[:, n]):
            return Nature.TARGET, truth.name[int(np.argmax(is_on_target[:, n]))]
        if is_echo[n] and np.any(by_body[:, n] > 0):
            actor = int(np.argmax(by_body[:, n]))
            return Nature.CLUTTER if echoes.is_clutter[actor] else Nature.BODY, echoes.body[actor]
        if signal[n] == "own" and not is_mirrored[n] and np.any(folded[:, n] > 0):
            return Nature.FOLDED, echoes.body[int(np.argmax(folded[:, n]))]
        is_direct = part["direct"][n] >= part["indirect"][n]
        return _ghost(signal[n], is_direct=is_direct, is_mirrored=is_mirrored[n]), None

    every = [cause(n) for n in range(detections.num_detections)]
    return Causes(
        nature=tuple(nature for nature, _ in every),
        body=tuple(body for _, body in every),
        is_on_target=is_on_target,
        association=pairs,
    )


def _ghost(signal: str, *, is_direct: bool, is_mirrored: bool) -> Nature:
    """Nature of a detection where no body is, by the key of `_PARTS_OF` of its signal."""
    if signal == "interference":
        return Nature.DIRECT if is_direct else Nature.INDIRECT
    if signal == "front end":
        return Nature.FRONT_END
    return Nature.MULTIPATH if signal == "own" and is_mirrored else Nature.UNEXPLAINED


def _near(detections: Detections, echoes: Echoes, gate: Gate) -> tuple[BoolArray, BoolArray]:
    """Masks of the paths within the margins of detections, ``(path, detection)``.

    The first is that of the paths within all margins, the second that of the paths within those of
    range and range rate, in any direction.
    """
    at_range = np.abs(detections.range - echoes.range[:, None]) <= gate.range
    at_range &= np.abs(detections.range_rate - echoes.range_rate[:, None]) <= gate.range_rate
    # directions take most of the time: only those of paths at a detection's range are compared
    path, of = np.nonzero(at_range)
    measured = detections.azimuth[of], detections.elevation[of]
    apart = angular_distances(measured, (echoes.azimuth[path], echoes.elevation[path]), gate)
    near = np.zeros_like(at_range)
    near[path, of] = apart <= 1.0
    return near, at_range


def _near_folded(detections: Detections, echoes: Echoes, gate: Gate) -> BoolArray:
    """Mask of the folded paths within the margins of detections, ``(path, detection)``.

    The margins are those of range and range rate.
    """
    span, shift = echoes.folds
    if not FEWEST_MARGINS * gate.range_rate < span < math.inf:
        return np.zeros((echoes.range.size, detections.num_detections), dtype=np.bool_)
    folds = np.rint((echoes.range_rate[:, None] - detections.range_rate) / span)
    rate = echoes.range_rate[:, None] - folds * span
    place = echoes.range[:, None] + folds * shift
    is_near = np.abs(rate - detections.range_rate) <= gate.range_rate
    is_near &= np.abs(place - detections.range) <= gate.range
    return np.asarray(is_near & (folds != 0.0))


def _strongest_signal(part: dict[str, FloatArray]) -> NDArray[np.str_]:
    """Key of `_PARTS_OF` whose parts have the most power in each detection, ``(detection,)``."""
    total = [np.sum([part[name] for name in names], axis=0) for names in _PARTS_OF.values()]
    return np.asarray(np.array(list(_PARTS_OF))[np.argmax(total, axis=0)])


def _has_plain_paths(echoes: Echoes, near: BoolArray) -> BoolArray:
    """Mask of the detections within whose margins paths without mirrors count, ``(detection,)``."""
    mirrored = np.where(echoes.is_mirrored, echoes.power, 0.0) @ near
    plain = np.where(echoes.is_mirrored, 0.0, echoes.power) @ near
    return np.asarray((plain > 0.0) & (mirrored <= MIRROR_RATIO * plain))


def _is_hidden(by_body: FloatArray, truth: Truth, echoes: Echoes) -> BoolArray:
    """Mask of the pairs whose target a body hides that is none, ``(target, detection)``."""
    is_target = np.isin(echoes.body, truth.name)
    others = by_body[~is_target].max(axis=0, initial=0.0)
    own = np.array(
        [by_body[[name == body for body in echoes.body]].sum(axis=0) for name in truth.name]
    ).reshape(len(truth.name), by_body.shape[1])
    return np.asarray(others > HIDING_RATIO * own)


def _nearest_of(may_be: BoolArray, apart: FloatArray, pairs: Association) -> BoolArray:
    """Mask ``may_be`` in which each detection has one target: that of its pair, or the nearest."""
    out = np.zeros_like(may_be)
    some = np.flatnonzero(np.any(may_be, axis=0))
    if some.size:  # without targets there is no nearest one
        out[np.argmin(np.where(may_be, apart, np.inf)[:, some], axis=0), some] = True
    out[:, pairs.detection] = False
    out[pairs.target, pairs.detection] = True
    return out
