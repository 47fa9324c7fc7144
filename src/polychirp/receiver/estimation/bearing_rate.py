r"""Bearings of what turns while it is measured: brought to the frame's start.

What passes at 5 m with 20 m/s turns by 1.5° in half a frame, and the mean bearing over a frame is
not that at its start. On a straight path, at steady velocity, the lateral coordinate
:math:`y = R\sin\theta` is linear in time. With :math:`s = \sin\theta` and its rate, both at the
frame's start, and :math:`\Delta` since then,

.. math:: s(t) = s_0\,\frac{R_0 + v\,\Delta}{R(t)} + \dot s_0\,\frac{R_0\,\Delta}{R(t)} .

R(t) is known from the beats and phases, so two unknowns are left.
"""

from __future__ import annotations

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.signal_model.point_signal import NEAREST, path_of

TYPICAL_CROSSING = 10.0
"""m/s across the line of sight: the prior on a bearing's rate, over the range."""

LEAST_LEFT = 1e-9
"""Of a ramp's power: below it what a wave leaves is rounding."""

LONGEST_STEP = 0.2
"""Of the sine, in one step of the fit: less than a beam of four channels is wide."""


def courses(motion: FloatArray, elapsed: FloatArray) -> FloatArray:
    """What the sine of a bearing on each ramp takes of s₀ and of its rate: ``(2, point, ramp)``.

    Parameters
    ----------
    motion : R, v, a at the frame's start, ``(point, 3)``
    elapsed : s since then, ``(ramp,)``

    Examples
    --------
    At 10 m, receding at 10 m/s, after 1 s: a tenth of its rate's worth is lost by distance.

    >>> courses(np.array([[10.0, 10.0, 0.0]]), np.array([1.0]))[:, 0, 0]
    array([1. , 0.5])
    """
    distance, rate = motion[:, 0, None], motion[:, 1, None]
    now = path_of(motion, elapsed)[0]
    steady = np.maximum(distance + rate * elapsed, NEAREST * distance)
    return np.stack([steady / now, distance * elapsed / now])


def trust(left: FloatArray) -> FloatArray:
    """How much each ramp counts, 0 … 1, by the power that a wave ``left``: ``(point, ramp)``.

    Ramps on which a burst is heard, or another echo that is not told apart from the point's own,
    stand out from the others: all that leave six times as much as the lower quartile are brought
    down to it. Of noise on four channels alone 0.2 % do.
    """
    place = 0.25 * (left.shape[1] - 1)
    below, above = int(place), min(int(place) + 1, left.shape[1] - 1)
    ordered = np.partition(left, (below, above), axis=1)
    quartile = ordered[:, below] + (place - below) * (ordered[:, above] - ordered[:, below])
    usual = 6.0 * quartile[:, None]
    return np.asarray(usual / np.maximum(left, usual + 1e-300))


def sines_and_rates(
    snapshots: ComplexArray,
    *,
    motion: FloatArray,
    along: FloatArray,
    frequency: FloatArray,
    elapsed: FloatArray,
) -> FloatArray:
    r"""Sine of every point's bearing at the frame's start, and its rate, 1/s: ``(point, 2)``.

    Maximum likelihood for amplitudes free on every ramp, in white noise,

    .. math:: \max_{s_0, \dot s_0} \sum_k \Big|\sum_m x_{mk}\,
              e^{j2\pi f_k y_m s(t_k)/c}\Big|^2 ,

    by Gauss's and Newton's steps from the mean phase between neighbours; ramps on which something
    else is heard count less (`trust`). The noise is what the wave leaves of the snapshots, so that
    where several scatterers share a cell the prior holds the rate: deviation
    ``TYPICAL_CROSSING``/R.

    Parameters
    ----------
    snapshots : of equal noise, ``(point, channel, ramp)``
    motion : R, v, a at the frame's start, ``(point, 3)``
    along : m, of the channels, evenly spaced, ``(channel,)``
    frequency : Hz, in the middle of the snapshots, ``(ramp,)``
    elapsed : s from the frame's start to there, ``(ramp,)``
    """
    channels = snapshots.shape[1]
    centred = along - np.mean(along)
    wave = 2.0 * np.pi / SPEED_OF_LIGHT * frequency
    course = courses(motion, elapsed)
    every = np.sum(np.abs(snapshots) ** 2, axis=1)
    prior = (motion[:, 0] / TYPICAL_CROSSING) ** 2
    found = np.zeros((len(motion), 2))
    if channels == 1:
        return found  # one channel tells no azimuth
    found[:, 0] = _mean_sines(snapshots, centred[1] - centred[0], float(np.mean(wave)))
    for _ in range(4):
        turned = snapshots * _turns(np.einsum("pi,ipk->pk", found, course), centred, wave)
        wanted = np.mean(turned, axis=1)
        left = np.maximum(every - channels * np.abs(wanted) ** 2, LEAST_LEFT * every)
        share = trust(left)
        noise = np.mean(share * left, axis=1) / (channels - 1) + 1e-300
        ahead = -np.einsum("m,pmk,pk->pk", centred, turned, wanted.conj()).imag * wave * share
        weight = np.abs(wanted) ** 2 * wave**2 * np.sum(centred**2) * share
        normal = np.einsum("ipk,jpk,pk->pij", course, course, weight)
        right = np.einsum("ipk,pk->pi", course, ahead)
        held = 0.5 * noise * prior
        normal[:, 1, 1] += held
        normal += 1e-300 * np.eye(2)
        right[:, 1] -= held * found[:, 1]
        step = np.linalg.solve(normal, right[..., None])[..., 0]
        most = np.max(np.abs(np.einsum("pi,ipk->pk", step, course)), axis=1, keepdims=True)
        found += step / np.maximum(1.0, most / LONGEST_STEP)
    return found


def brought_to_start(
    snapshots: ComplexArray,
    *,
    motion: FloatArray,
    along: FloatArray,
    frequency: FloatArray,
    elapsed: FloatArray,
) -> ComplexArray:
    """The snapshots as if everything had stood still at the frame's start; same axes.

    All are as of the mean frequency, and as loud as they are to be trusted. Parameters of
    `sines_and_rates`.
    """
    found = sines_and_rates(
        snapshots, motion=motion, along=along, frequency=frequency, elapsed=elapsed
    )
    wave = 2.0 * np.pi / SPEED_OF_LIGHT * frequency
    now = np.einsum("pi,ipk->pk", found, courses(motion, elapsed)) * wave
    start = np.broadcast_to(found[:, :1] * np.mean(wave), now.shape)
    centred, one = along - np.mean(along), np.ones_like(wave)
    turned = snapshots * _turns(now, centred, one)
    left = np.sum(np.abs(turned - np.mean(turned, axis=1, keepdims=True)) ** 2, axis=1)
    left = np.maximum(left, LEAST_LEFT * np.sum(np.abs(turned) ** 2, axis=1))
    return turned * _turns(-start, centred, one) * np.sqrt(trust(left))[:, None]


def _turns(sine: FloatArray, along: FloatArray, wave: FloatArray) -> ComplexArray:
    """Takes a wave's phases back, ``(point, channel, ramp)``."""
    return np.asarray(np.exp(1j * (sine * wave)[:, None] * along[:, None]))


def _mean_sines(snapshots: ComplexArray, spacing: float, wave: float) -> FloatArray:
    """From the mean phase between neighbours, every ramp as loud as the others: ``(point,)``."""
    products = np.sum(snapshots[:, 1:] * snapshots[:, :-1].conj(), axis=1)
    loudness = np.sum(np.abs(snapshots) ** 2, axis=1) + 1e-300
    return np.asarray(-np.angle(np.sum(products / loudness, axis=1)) / (wave * spacing))
