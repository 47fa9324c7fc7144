"""World, vehicle and radar frames (ISO 8855: x forward, y left, z up; angles positive left, up)."""

import math
from dataclasses import dataclass

import numpy as np

from polychirp.axes import FloatArray
from polychirp.spec import Spec
from polychirp.units import Metres, Radians


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose(Spec):
    """Position and orientation of a body: yaw about z, then pitch about y, then roll about x.

    Positive pitch raises the nose (a rotation by −pitch about y in the right-hand sense).

    Examples
    --------
    >>> Pose(x=10.0, yaw=np.pi / 2).to_outer(np.array([2.0, 0.0, 0.0])).round(9) + 0.0
    array([10.,  2.,  0.])
    """

    x: Metres = 0.0
    y: Metres = 0.0
    z: Metres = 0.0
    yaw: Radians = 0.0
    pitch: Radians = 0.0
    roll: Radians = 0.0

    @property
    def position(self) -> FloatArray:
        """Position in the outer frame (the world's, or a radar's vehicle's), m, ``(xyz,)``."""
        return np.array([self.x, self.y, self.z])

    @property
    def rotation(self) -> FloatArray:
        """Matrix ``(xyz, xyz)`` from the inner frame (the body's own) to the outer frame."""
        return rotation(self.yaw, self.pitch, self.roll)

    def to_outer(self, points: FloatArray) -> FloatArray:
        """Coordinates in the outer frame of points ``(…, xyz)`` of the inner frame."""
        return np.asarray(points @ self.rotation.T + self.position)

    def to_inner(self, points: FloatArray) -> FloatArray:
        """Coordinates in the inner frame of points ``(…, xyz)`` of the outer frame."""
        return np.asarray((points - self.position) @ self.rotation)


def rotation(yaw: float, pitch: float = 0.0, roll: float = 0.0) -> FloatArray:
    """Matrix of a rotation by yaw (left), pitch (nose up) and roll (right side down) in rad.

    >>> rotation(np.pi / 2).round(12) @ np.array([1.0, 0.0, 0.0])
    array([0., 1., 0.])
    """
    cy, sy = np.cos(yaw), np.sin(yaw)
    cp, sp = np.cos(pitch), np.sin(pitch)
    cr, sr = np.cos(roll), np.sin(roll)
    about_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    about_y = np.array([[cp, 0.0, -sp], [0.0, 1.0, 0.0], [sp, 0.0, cp]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    return np.asarray(about_z @ about_y @ about_x)


def rotation_angles(matrix: FloatArray) -> FloatArray:
    """Yaw, pitch and roll, rad, of a rotation ``(xyz, xyz)``; the roll of a vertical nose is 0.

    >>> rotation_angles(rotation(0.3, -0.2, 0.1)).round(12)
    array([ 0.3, -0.2,  0.1])
    >>> rotation_angles(rotation(0.3, np.pi / 2)).round(12) + 0.0
    array([0.3       , 1.57079633, 0.        ])
    """
    forward, up = matrix[:, 0], matrix[2]
    pitch = math.atan2(up[0], math.hypot(forward[0], forward[1]))
    if math.hypot(forward[0], forward[1]) < 1e-9:
        return np.array([math.atan2(-matrix[0, 1], matrix[1, 1]), pitch, 0.0])
    return np.array([math.atan2(forward[1], forward[0]), pitch, math.atan2(up[1], up[2])])


def quaternion(yaw: float, pitch: float, roll: float) -> FloatArray:
    """Unit quaternion ``(w, x, y, z)`` of `rotation` by these angles, rad.

    >>> quaternion(np.pi / 2, 0.0, 0.0).round(6).tolist()
    [0.707107, 0.0, 0.0, 0.707107]
    """
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    cp, sp = math.cos(0.5 * pitch), -math.sin(0.5 * pitch)
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    return np.array(
        [
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        ]
    )


def turned_at_rate(yaw_rate: float | FloatArray, vector: FloatArray) -> FloatArray:
    r"""Rate of change of vectors ``(…, xyz)`` that turn to the left about z.

    .. math:: \omega \times r, \qquad \omega = (0, 0, \dot\psi)

    Parameters
    ----------
    yaw_rate : :math:`\dot\psi`, rad/s, of all vectors, or of each, ``(…,)``

    >>> turned_at_rate(0.5, np.array([4.0, 0.0, 1.0])).tolist()
    [0.0, 2.0, 0.0]
    """
    rate, vector = np.asarray(yaw_rate, dtype=np.float64), np.asarray(vector)
    return np.stack(
        [-rate * vector[..., 1], rate * vector[..., 0], np.zeros_like(vector[..., 2])], axis=-1
    )


def steady_turn(
    velocity: FloatArray, yaw_rate: float, elapsed: float
) -> tuple[FloatArray, FloatArray]:
    """Way of a point, m ``(xyz,)``, after some time, s, and its velocity then.

    Its ``velocity``, m/s ``(xyz,)``, turns to the left with a steady ``yaw_rate``, rad/s.

    >>> way, velocity = steady_turn(np.array([np.pi, 0.0, 1.0]), np.pi, 1.0)
    >>> (way.round(9) + 0.0).tolist(), (velocity.round(9) + 0.0).tolist()
    ([0.0, 2.0, 1.0], [-3.14159265, 0.0, 1.0])
    """
    if not yaw_rate:
        return velocity * elapsed, velocity
    vx, vy, vz = velocity.tolist()
    turn = yaw_rate * elapsed
    sine, cosine = math.sin(turn), math.cos(turn)
    # 1 − cos without cancellation
    ahead, aside = sine / yaw_rate, 2.0 * math.sin(0.5 * turn) ** 2 / yaw_rate
    return (
        np.array([ahead * vx - aside * vy, aside * vx + ahead * vy, vz * elapsed]),
        np.array([cosine * vx - sine * vy, sine * vx + cosine * vy, vz]),
    )


def direction_angles(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Azimuth and elevation, rad, of directions ``(…, xyz)`` in a radar's frame."""
    x, y, z = np.moveaxis(np.asarray(direction, dtype=np.float64), -1, 0)
    return np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))


def direction_of(azimuth: FloatArray, elevation: FloatArray) -> FloatArray:
    """Unit vectors ``(…, xyz)`` in a radar's frame, of azimuths and elevations ``(…)``, rad.

    >>> direction_of(np.array(0.0), np.array(np.pi / 6)).round(3)
    array([0.866, 0.   , 0.5  ])
    """
    across = np.cos(elevation)
    return np.stack(
        [across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], axis=-1
    )


def polarisation_basis(direction: FloatArray) -> FloatArray:
    """Unit vectors (V, H) perpendicular to outward directions ``(…, xyz)``: shape ``(…, 2, xyz)``.

    H = z × d, normalised; V = d × H, which points up. Both ends of a path use the *outward*
    direction (away from the antenna), so that the transfer matrix of the reversed path is the
    transpose. For a vertical direction H = y.
    """
    d = np.asarray(direction, dtype=np.float64)
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    horizontal = np.stack([-d[..., 1], d[..., 0], np.zeros(d.shape[:-1])], axis=-1)
    length = np.linalg.norm(horizontal, axis=-1, keepdims=True)
    horizontal = np.where(
        length > 1e-12, horizontal / np.maximum(length, 1e-12), np.array([0.0, 1.0, 0.0])
    )
    vertical = np.cross(d, horizontal)
    return np.stack([vertical, horizontal], axis=-2)
