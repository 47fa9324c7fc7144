"""References for waves over two screens, or below: Kirchhoff integrals over both apertures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT


def over_two_screens(
    start: tuple[float, float],
    screens: tuple[tuple[float, float], tuple[float, float]],
    end: tuple[float, float],
    frequency: float,
    *,
    step: float = 2e-3,
    reach: float = 3.0,
) -> complex:
    r"""Field behind two half-planes with parallel edges, over that without them.

    Waves are cylindrical, which for the ratio makes no difference: the sum over the heights of both
    apertures of :math:`e^{-jk(r_1+r_2+r_3)}\cos\theta_1\cos\theta_2/\sqrt{r_1 r_2 r_3}`, with the
    exact distances and with the angles θ at which waves arrive at the apertures, without geometric
    waves, edges or Fresnel integrals. It is Rayleigh's and Sommerfeld's first integral from the
    point back to the transmitter (Goodman, Introduction to Fourier Optics, §3.5), so that endless
    apertures give 1. A smooth taper ends them here.

    Parameters
    ----------
    start, end : (depth, height) of transmitter and point, m
    screens : (depth, height) of both edges, m; the half-planes are below
    frequency : Hz
    step, reach : of the sums and height of the apertures over the edges, m
    """
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    above = np.asarray(step * (np.arange(round(reach / step)) + 0.5), dtype=np.float64)
    heights = [edge + above for _, edge in screens]
    (x1, _), (x2, _) = screens
    tapers = [_taper(height, reach) for height in heights]
    return step**2 * _through((x1, x2), heights, tapers, (start, end), k)


def below_a_floor(
    start: tuple[float, float],
    depths: tuple[float, float],
    clearance: float,
    end: tuple[float, float],
    frequency: float,
    *,
    step: float = 1e-3,
) -> complex:
    """Field of a transmitter's mirror image in a road, below a vehicle, over that without it.

    The road mirrors the vehicle too, so the wave from the image passes slits of twice the clearance
    at both ends of the vehicle: both sums are over heights from −clearance to clearance.

    Parameters
    ----------
    start, end : (depth, height) of the image, below the road, and of a point, m
    depths : of both ends of the vehicle, m; clearance : of its floor, m
    frequency : Hz; step : of the sums, m
    """
    k = 2 * np.pi * frequency / SPEED_OF_LIGHT
    count = round(2 * clearance / step)
    height = np.asarray(step * (np.arange(count) + 0.5) - clearance, dtype=np.float64)
    one = np.ones(count)
    return step**2 * _through(depths, [height, height], [one, one], (start, end), k)


def _through(
    depths: tuple[float, float],
    heights: Sequence[FloatArray],
    weights: Sequence[FloatArray],
    ends: tuple[tuple[float, float], tuple[float, float]],
    k: float,
) -> complex:
    """Sum over two apertures' places, over the field without screens, per square of the step."""
    (x1, x2), (start, end) = depths, ends
    first = _arriving(x1 - start[0], heights[0] - start[1], k) * weights[0]
    field = np.empty(len(heights[1]), dtype=np.complex128)
    for rows in np.array_split(np.arange(len(field)), 40):
        field[rows] = _arriving(x2 - x1, heights[1][rows, None] - heights[0], k) @ first
    last = _wave(np.hypot(end[0] - x2, end[1] - heights[1]), k) * weights[1]
    free = _wave(np.hypot(end[0] - start[0], end[1] - start[1]), k)
    # an aperture is a line of sources, each of √(jk/2π) times the wave there
    return complex(1j * k / (2 * np.pi) * np.sum(field * last) / free)


def _arriving(depth: float, height: FloatArray, k: float) -> ComplexArray:
    """Wave over a leg, times the cosine of the angle at which it arrives at an aperture."""
    length = np.hypot(depth, height)
    return np.asarray(_wave(length, k) * (depth / length), dtype=np.complex128)


def _wave(length: FloatArray | float, k: float) -> ComplexArray:
    return np.asarray(np.exp(-1j * k * length) / np.sqrt(length), dtype=np.complex128)


def _taper(height: FloatArray, reach: float) -> FloatArray:
    """1 up to half of the aperture, and a smooth fall to 0 at its end."""
    x = np.clip((height - height[0]) / reach * 2.0 - 1.0, 0.0, 1.0)
    return np.asarray(np.cos(0.5 * np.pi * x) ** 2, dtype=np.float64)
