"""A person of ellipsoids: lengths and girths of the body's segments, placed by angles of joints."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.frames import rotation
from polychirp.model.moving_parts import Ellipsoids
from polychirp.traffic.articulated_bodies.gait import Joints

SKIN_REFLECTIVITY: Final = 0.34
"""Power that dry skin reflects at normal incidence at 77 GHz: ε = 6.6 − 8.9j, by the parameters of
Gabriel et al. 1996. Clothes are neglected; we assume that a dry layer changes the echo by less than
2 dB. All echoes of a person are proportional to it."""

HEAD, NECK, TRUNK = 0.130, 0.052, 0.288
"""Lengths of segments over the height of the body: Drillis and Contini 1966, as in the model of
`gait`; so are the following ones."""
SHOULDER, HIP = 0.129, 0.0955
"""Half distances of the shoulders and of the hips over the height."""
THIGH, SHANK, ANKLE, FOOT = 0.245, 0.246, 0.039, 0.152
"""Upper leg, lower leg, height of the ankle and length of the foot over the height."""
UPPER_ARM, FOREARM, HAND = 0.188, 0.145, 0.108
"""Upper arm, lower arm and hand over the height."""

GIRTHS: Final = {
    "head": (0.055, 0.044),
    "trunk": (0.065, 0.092),
    "pelvis": (0.062, 0.094),
    "thigh": (0.045, 0.045),
    "shank": (0.031, 0.031),
    "upper arm": (0.028, 0.028),
    "forearm": (0.023, 0.023),
}
"""Half depth and half breadth of segments over the height. Chosen: rounded from means of adults in
Pheasant and Haslegrave 2005, with 1.75 m; a segment's echo seen from the front is
proportional to the squared ratio of its breadth to its depth."""


def leg_length(height: float) -> float:
    """Height of the hips above the ankles of a person of this height, m.

    >>> round(leg_length(1.75), 2)
    0.86
    """
    return (THIGH + SHANK) * height


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A segment from ``start`` to ``end``, m; ``turn`` has its front and its left as columns."""

    name: str
    start: FloatArray
    end: FloatArray
    turn: FloatArray


def person(joints: Joints, *, height: float, base: FloatArray | None = None) -> Ellipsoids:
    """The ellipsoids of a person: pelvis, trunk, head, upper and lower limbs, right before left.

    The frame has x forward, y left, z up.

    Parameters
    ----------
    height : of the body, m
    base : middle between the hips in an upright, still body, m ``(xyz,)``; by default above the
        origin such that the feet are on the ground

    Examples
    --------
    >>> from polychirp.traffic.articulated_bodies.gait import STANDING
    >>> body = person(STANDING, height=1.75)
    >>> top = body.centre[:, 2] + np.abs(body.axes[:, :, 2]).max(axis=1)
    >>> round(float(top.max()), 2)
    1.75
    """
    if base is None:
        base = np.array([0.0, 0.0, leg_length(height) + ANKLE * height])
    hips = base + np.array(joints.offset)
    segments = [*_trunk(joints, hips, height), *_legs(joints, hips, height)]
    shanks = [one for one in segments if one.name == "shank"]
    feet = [foot(shank, joints.ankle[side], height) for side, shank in enumerate(shanks)]
    return solids_of(segments, feet, height)


def solids_of(
    segments: Sequence[Segment], feet: Sequence[tuple[FloatArray, FloatArray]], height: float
) -> Ellipsoids:
    """Ellipsoids of skin of segments, and of feet with a centre and semi-axes, m, each."""
    centre, axes = zip(*(_ellipsoid(one, height) for one in segments), *feet, strict=True)
    return Ellipsoids(
        centre=np.array(centre),
        axes=np.array(axes),
        reflectivity=np.full(len(centre), SKIN_REFLECTIVITY),
    )


def _trunk(joints: Joints, hips: FloatArray, height: float) -> list[Segment]:
    """Pelvis, trunk, head and both upper limbs."""
    spine = rotation(joints.thorax_yaw, -joints.lean)
    pelvis = rotation(joints.pelvis_yaw, 0.0, joints.pelvis_roll)
    up = spine[:, 2]
    neck = hips + TRUNK * height * up
    found = [
        Segment(
            name="pelvis",
            start=hips - 0.055 * height * pelvis[:, 2],
            end=hips + 0.075 * height * pelvis[:, 2],
            turn=pelvis,
        ),
        Segment(name="trunk", start=hips, end=neck + 0.02 * height * up, turn=spine),
        Segment(
            name="head",
            start=neck + NECK * height * up,
            end=neck + (NECK + HEAD) * height * up,
            turn=spine,
        ),
    ]
    for side in (0, 1):
        shoulder = neck + (2 * side - 1) * SHOULDER * height * spine[:, 1]
        upper = spine @ _downwards(joints.shoulder[side])
        elbow = shoulder + UPPER_ARM * height * upper[:, 2]
        lower = spine @ _downwards(joints.shoulder[side] + joints.elbow[side])
        hand = elbow + (FOREARM + 0.5 * HAND) * height * lower[:, 2]
        found.append(Segment(name="upper arm", start=shoulder, end=elbow, turn=upper))
        found.append(Segment(name="forearm", start=elbow, end=hand, turn=lower))
    return found


def _legs(joints: Joints, hips: FloatArray, height: float) -> list[Segment]:
    """Thigh and shank, right and left.

    The pelvis turns and rolls with the hip joints, but the legs swing straight ahead: real hips
    rotate against the pelvis, which keeps the feet on their lines. In Chen's code the legs turn
    with the pelvis, by which a foot on the ground would move sideways with up to 1.1 m/s at a walk
    of 1.4 m/s.
    """
    pelvis = rotation(joints.pelvis_yaw, 0.0, joints.pelvis_roll)
    found = []
    for side in (0, 1):
        joint = hips + (2 * side - 1) * HIP * height * pelvis[:, 1]
        upper = _downwards(joints.hip[side])
        knee = joint + THIGH * height * upper[:, 2]
        lower = _downwards(joints.hip[side] - joints.knee[side])
        ankle = knee + SHANK * height * lower[:, 2]
        found.append(Segment(name="thigh", start=joint, end=knee, turn=upper))
        found.append(Segment(name="shank", start=knee, end=ankle, turn=lower))
    return found


def _downwards(flexion: float) -> FloatArray:
    """Frame of a hanging limb that is swung forwards by an angle, rad: its third axis is the limb.

    The first axis is its front, the second its left side.
    """
    sine, cosine = math.sin(flexion), math.cos(flexion)
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [sine, 0.0, -cosine]])


def _ellipsoid(segment: Segment, height: float) -> tuple[FloatArray, FloatArray]:
    """Centre and semi-axes of a segment's ellipsoid, m."""
    depth, breadth = GIRTHS[segment.name]
    axes = [
        depth * height * segment.turn[:, 0],
        breadth * height * segment.turn[:, 1],
        0.5 * (segment.end - segment.start),
    ]
    return 0.5 * (segment.start + segment.end), np.array(axes)


def foot(shank: Segment, pitch: float, height: float) -> tuple[FloatArray, FloatArray]:
    """Centre and semi-axes of a foot, m, of which a quarter is behind the ankle.

    ``pitch`` is the angle by which the toes are raised from the right angle to the shank, rad.
    """
    front, left, down = shank.turn.T
    ahead = math.cos(pitch) * front - math.sin(pitch) * down
    upwards = -math.cos(pitch) * down - math.sin(pitch) * front
    sole = 0.5 * ANKLE * height
    centre = shank.end + 0.25 * FOOT * height * ahead - sole * upwards
    axes = [0.5 * FOOT * height * ahead, 0.026 * height * left, sole * upwards]
    return centre, np.array(axes)
