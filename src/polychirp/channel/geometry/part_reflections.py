r"""Places and strengths of the reflections of moving parts, from one end to another.

**Ellipsoids** reflect by geometric optics. In the far field the cross section is

.. math:: \sigma = \pi\,\varrho\,R_1 R_2

with the reflectivity ϱ and the principal radii of curvature at the point whose normal bisects the
directions to both ends (Ruck, Radar Cross Section Handbook, 1970). It is divided by
:math:`(1 + R_1/d)(1 + R_2/d)`, where 1/d is the mean of the inverse distances to both ends: this
is exact for a sphere and equal ends, and makes a body echo less at short distances.

**Rods** are pieces of a round tube of radius a. A tube of length ℓ, seen from across, has

.. math:: \sigma = k a \ell^2

(physical optics; the exact value of a wire with ka > 1 is within 2 dB). A piece with the window
:math:`\cos^2`, of half its length w, has by integration along it

.. math:: \sqrt\sigma = \sqrt{\varrho\,k a \tfrac{|b|}2\cos\psi}\;w\,
          \frac{\sin x}{x\,(1 - (x/\pi)^2)}, \qquad x = k\,w\,|b| \sin\psi

where ψ is the angle between the bisector and the plane across the tube, and b the sum of the unit
vectors to both ends. The factor falls by 31 dB beyond its main lobe: a rod flashes when it is seen
from across. Between two ends at an angle β, |b|/2 is cos β/2. Polarisation is kept.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.channel.geometry.ellipsoids import bisector, crossed, reflections, towards
from polychirp.model.moving_parts import Ellipsoids, MovingParts, Rods
from polychirp.model.scene import Actor

TIME_STEP: Final = 2.5e-4
"""Distance of the times at which positions are differenced, s. Chosen: for a wheel of 100 rad/s the
velocity's error is 1e-8 of itself, and for positions of 100 m the rounding error of the
acceleration is below 1e-5 m/s²; errors grow with the fourth power of twice the step, and rounding
errors to four times their value at half of it."""
Ends = tuple[FloatArray, FloatArray]
"""Positions of both ends of some ways in the frame of a body, m ``(way, xyz)`` each."""


class Echoing(NamedTuple):
    """Reflecting points of all parts, ellipsoids before rods: shapes ``(way, part, …)``.

    ``point`` is in the body's frame, m ``(…, xyz)``; ``amplitude`` is the signed root of the cross
    section, m.
    """

    point: FloatArray
    amplitude: FloatArray


def echoing(parts: MovingParts, ends: Ends, *, wavenumber: float) -> Echoing:
    """Reflections of all parts from one end to another; nothing hides them.

    Parameters
    ----------
    ends : of every way, in the body's frame
    wavenumber : 2π/λ, 1/m

    Examples
    --------
    >>> ball = Ellipsoids(centre=np.zeros((1, 3)), axes=0.1 * np.eye(3)[None], reflectivity=[1.0])
    >>> eye = np.array([[1e4, 0.0, 0.0]])
    >>> found = echoing(MovingParts(ellipsoids=ball), (eye, eye), wavenumber=1655.0)
    >>> round(float(found.amplitude[0, 0] ** 2 / (np.pi * 0.1**2)), 3)
    1.0
    """
    of_ellipsoids = _of_ellipsoids(parts.ellipsoids, ends)
    of_rods = _of_rods(parts.rods, ends, wavenumber)
    return Echoing(
        *(np.concatenate(both, axis=1) for both in zip(of_ellipsoids, of_rods, strict=True))
    )


def _of_ellipsoids(parts: Ellipsoids, ends: Ends) -> Echoing:
    found = reflections(parts.centre, parts.axes, ends)
    away = [np.linalg.norm(end[:, None] - found.point, axis=-1) for end in ends]
    inverse = 0.5 * sum(1.0 / np.maximum(length, 1e-12) for length in away)
    near = 1.0 + found.radius_sum * inverse + found.radius_product * inverse**2
    area = np.pi * parts.reflectivity * found.radius_product / near
    return Echoing(found.point, np.sqrt(area))


def _of_rods(parts: Rods, ends: Ends, wavenumber: float) -> Echoing:
    from_end, to_end = ends[0][:, None], ends[1][:, None]
    half = np.linalg.norm(parts.reach, axis=-1)
    axis = parts.reach / np.maximum(half, 1e-12)[:, None]
    centre = np.broadcast_to(parts.centre, (len(ends[0]), *parts.centre.shape))
    middle = bisector(centre, (from_end, to_end))
    slope = np.sum(middle * axis, axis=-1)
    across = middle - slope[..., None] * axis
    cosine = np.linalg.norm(across, axis=-1)
    point = centre + parts.radius[:, None] * across / np.maximum(cosine, 1e-12)[..., None]
    both = towards(from_end, centre) + towards(to_end, centre)
    phase = wavenumber * half * np.sum(both * axis, axis=-1)
    lobe = half * window_transform(phase)
    # |b|/2 is 1 for an echo, and less between two ends far apart
    facing = 0.5 * np.linalg.norm(both, axis=-1) * cosine
    return Echoing(point, np.sqrt(parts.reflectivity * wavenumber * parts.radius * facing) * lobe)


def window_transform(phase: FloatArray) -> FloatArray:
    r"""Transform of :math:`\cos^2(\pi s/2)` from s = −1 to 1, for a phase of x at s = 1.

    .. math:: \frac{\sin x}{x\,(1 - (x/\pi)^2)}

    >>> window_transform(np.array([0.0, np.pi, 2 * np.pi])).round(12) + 0.0
    array([1. , 0.5, 0. ])
    """
    ratio = phase / np.pi
    # as a sum of three, which has no poles
    return np.asarray(np.sinc(ratio) + 0.5 * np.sinc(ratio - 1.0) + 0.5 * np.sinc(ratio + 1.0))


def hidden_by_own(parts: MovingParts, point: FloatArray, end: FloatArray) -> BoolArray:
    """Mask ``(way, part)`` of the reflecting points that the body's own ellipsoids hide.

    Parameters
    ----------
    point : reflecting points in the body's frame, m ``(way, part, xyz)``, as in `Echoing`
    end : an end of every way in that frame, m ``(way, xyz)``
    """
    num_ways, num_parts = point.shape[:2]
    solid = parts.ellipsoids
    num_solid = len(solid.centre)
    ends = np.broadcast_to(end[:, None], point.shape)
    meets = crossed(solid.centre, solid.axes, point.reshape(-1, 3), ends.reshape(-1, 3))
    meets = meets.reshape(num_ways, num_parts, num_solid)
    own = np.arange(num_solid)
    meets[:, own, own] = False
    return np.asarray(np.any(meets, axis=-1))


class MovingReflections(NamedTuple):
    """Reflecting points of a body's parts in the world, and how they move.

    ``point`` m, ``velocity`` m/s, ``acceleration`` m/s² and ``jerk`` m/s³ are ``(way, part, xyz)``;
    ``amplitude`` ``(way, part)`` is that of `Echoing`; ``is_open`` ``(way, part)`` is false for
    points that the body hides from one of both ends.
    """

    point: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    amplitude: FloatArray
    is_open: BoolArray


def moving_reflections(
    body: Actor,
    time: float,
    ends: Sequence[tuple[FloatArray, FloatArray]],
    *,
    wavenumber: float,
) -> MovingReflections:
    """Reflections of a body with moving parts.

    Parameters
    ----------
    body : at ``time``, s
    ends : position, m, and velocity, m/s, of the first and of the second end of every way, in the
        world, ``(way, xyz)``
    wavenumber : 2π/λ, 1/m
    """
    found = [_shifted(body, time, ends, step, wavenumber) for step in TIME_STEP * np.arange(-2, 3)]
    parts, ways, middle = found[2]
    hidden = hidden_by_own(parts, middle.point, ways[0])
    if not np.array_equal(*ways):
        hidden |= hidden_by_own(parts, middle.point, ways[1])
    points = np.array(
        [
            body.at(step).pose.to_outer(one.point)
            for step, (_, _, one) in zip(TIME_STEP * np.arange(-2, 3), found, strict=True)
        ]
    )
    velocity, acceleration, jerk = derivatives(points)
    return MovingReflections(points[2], velocity, acceleration, jerk, middle.amplitude, ~hidden)


def _shifted(
    body: Actor,
    time: float,
    ends: Sequence[tuple[FloatArray, FloatArray]],
    step: float,
    wavenumber: float,
) -> tuple[MovingParts, Ends, Echoing]:
    """Parts of the body, ends of the ways and reflections in its frame, ``step`` s later."""
    assert body.movement is not None
    pose, parts = body.at(step).pose, body.movement.parts_at(time + step)
    first, second = (pose.to_inner(place + speed * step) for place, speed in ends)
    return parts, (first, second), echoing(parts, (first, second), wavenumber=wavenumber)


def derivatives(position: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """First three derivatives in the middle of five positions, `TIME_STEP` apart: ``(5, …)``.

    Central differences, the first two of fourth order, the third of second order.

    >>> time = TIME_STEP * np.arange(-2, 3)
    >>> [float(round(one, 6)) for one in derivatives(3 * time + 4 * time**2 + 2 * time**3)]
    [3.0, 8.0, 12.0]
    """
    a, b, c, d, e = position
    first = (a - 8 * b + 8 * d - e) / (12 * TIME_STEP)
    second = (-a + 16 * b - 30 * c + 16 * d - e) / (12 * TIME_STEP**2)
    third = (-a + 2 * b - 2 * d + e) / (2 * TIME_STEP**3)
    return first, second, third
