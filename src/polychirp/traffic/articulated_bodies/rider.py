"""A rider: a person who sits, with hands and feet at given places."""

import math
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.frames import rotation
from polychirp.model.moving_parts import Ellipsoids
from polychirp.traffic.articulated_bodies.person import (
    FOREARM,
    HAND,
    HEAD,
    HIP,
    NECK,
    SHANK,
    SHOULDER,
    THIGH,
    TRUNK,
    UPPER_ARM,
    Segment,
    foot,
    solids_of,
)

FORWARDS: Final = np.array([1.0, 0.0, 0.2])
"""Direction to which knees bend."""

OUTWARDS: Final = np.array([-0.3, 0.6, -0.8])
"""Direction to which the left elbow bends."""


def rider(
    *, height: float, seat: FloatArray, lean: float, hands: FloatArray, ankles: FloatArray
) -> Ellipsoids:
    """The ellipsoids of a rider in the order of `person`.

    Knees and elbows follow from the lengths of the limbs.

    Parameters
    ----------
    height : of the body, m
    seat : middle between the hips, m ``(xyz,)``
    lean : of the trunk to the front, rad
    hands, ankles : m, right and left, ``(side, xyz)``

    Examples
    --------
    >>> places = np.array([[0.5, -0.3, 1.0], [0.5, 0.3, 1.0]])
    >>> low = np.array([[0.1, -0.1, 0.2], [0.1, 0.1, 0.2]])
    >>> body = rider(height=1.75, seat=np.array([0.0, 0.0, 0.95]), lean=0.5, hands=places,
    ...     ankles=low)
    >>> body.centre.shape
    (13, 3)
    """
    spine = rotation(0.0, -lean)
    up = spine[:, 2]
    neck = seat + TRUNK * height * up
    upright = rotation(0.0, -0.3 * lean)
    segments = [
        Segment(name="pelvis", start=seat - 0.05 * height * up, end=seat + 0.07 * height * up,
                turn=spine),
        Segment(name="trunk", start=seat, end=neck + 0.02 * height * up, turn=spine),
        Segment(name="head", start=neck + NECK * height * upright[:, 2],
                end=neck + (NECK + HEAD) * height * upright[:, 2], turn=upright),
    ]  # fmt: skip
    side = np.array([0.0, 1.0, 0.0])
    lengths = UPPER_ARM * height, (FOREARM + 0.3 * HAND) * height
    for sign, hand in zip((-1.0, 1.0), hands, strict=True):
        shoulder = neck + sign * SHOULDER * height * side
        bend = OUTWARDS * np.array([1.0, sign, 1.0])
        elbow, end = bent(shoulder, hand, lengths, bend)
        segments += [segment("upper arm", shoulder, elbow), segment("forearm", elbow, end)]
    feet = []
    for sign, ankle in zip((-1.0, 1.0), ankles, strict=True):
        joint = seat + sign * HIP * height * side
        knee, end = bent(joint, ankle, (THIGH * height, SHANK * height), FORWARDS)
        shank = segment("shank", knee, end)
        segments += [segment("thigh", joint, knee), shank]
        feet.append(foot(shank, _level(shank), height))
    return solids_of(segments, feet, height)


def bent(
    start: FloatArray, end: FloatArray, lengths: tuple[float, float], side: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Joint in the middle of a limb of two lengths, m, which bends to ``side``, and the limb's end.

    If ``end`` is too far away, the limb is straight and ends before it.

    >>> bent(np.zeros(3), np.array([0.0, 0, -1.4]), (1.0, 1.0), np.array([1.0, 0, 0]))[0].round(2)
    array([ 0.71,  0.  , -0.7 ])
    """
    way = end - start
    distance = float(np.linalg.norm(way))
    along = way / distance
    distance = min(distance, 0.999 * sum(lengths))
    near = (lengths[0] ** 2 - lengths[1] ** 2 + distance**2) / (2 * distance)
    off = math.sqrt(max(lengths[0] ** 2 - near**2, 0.0))
    across = side - (side @ along) * along
    joint = start + near * along + off * across / np.linalg.norm(across)
    return joint, start + distance * along


def segment(name: str, start: FloatArray, end: FloatArray) -> Segment:
    """A round segment from ``start`` to ``end``, m, with its front towards +x as far as it can."""
    along = (end - start) / np.linalg.norm(end - start)
    front = np.array([1.0, 0.0, 0.0]) - along[0] * along
    front /= np.linalg.norm(front)
    return Segment(
        name=name, start=start, end=end, turn=np.stack([front, np.cross(front, along), along], 1)
    )


def _level(shank: Segment) -> float:
    """Angle by which toes are raised from the right angle to a shank if the foot is level, rad."""
    front = shank.turn[:, 0]
    return -math.atan2(front[2], math.hypot(front[0], front[1]))
