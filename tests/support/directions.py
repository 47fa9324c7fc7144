"""Waves on arrays of elements anywhere, and the Cramér–Rao bound of their directions."""

from __future__ import annotations

import numpy as np

STEP = 1e-6
"""Step of the numerical derivatives, rad and relative; the second order is below 1e-9."""

ARRAYS = {
    "two rows": [(x, 0) for x in (0, 1, 2, 3, 4, 5, 6, 7)] + [(x, 1) for x in (2, 3, 4, 5)],
    "rectangle": [(x, z) for z in range(3) for x in range(4)],
    "row": [(x, 0) for x in range(8)],
    "column": [(0, z) for z in range(6)],
    "sparse row": [(x, 0) for x in (0, 1, 4, 9, 11)],
    "overlapping row": [(x, 0) for x in (0, 1, 2, 3, 2, 3, 4, 5)],
    "scattered": [(0, 0), (1.2, 0.4), (2.1, -1.3), (3.3, 0.9), (0.7, 2.2), (-1.4, 1.1), (-2, -1)],
}
"""Places of elements to the left and up, in half wavelengths."""


def places(name: str) -> np.ndarray:
    """Places of an array's elements, wavelengths, ``(channel, 2)``."""
    return 0.5 * np.array(ARRAYS[name], dtype=float)


def phases(place, azimuth, elevation) -> np.ndarray:
    """Beats ``(…, channel)`` of unit waves, from the way by which each element is nearer.

    An element that is nearer by x receives the wave earlier; its beat, the conjugate, has −2πx/λ.
    """
    azimuth, elevation = np.asarray(azimuth)[..., None], np.asarray(elevation)[..., None]
    nearer = place[:, 0] * np.cos(elevation) * np.sin(azimuth) + place[:, 1] * np.sin(elevation)
    return np.exp(-2j * np.pi * nearer)


def noisy_waves(place, azimuth, elevation, *, snr, rng) -> np.ndarray:
    """One snapshot ``(wave, channel, 1)`` of each wave, of a drawn phase; ``snr`` per channel."""
    wave = phases(place, azimuth, elevation)
    wave = np.sqrt(snr) * wave * np.exp(2j * np.pi * rng.uniform(size=(len(wave), 1)))
    return (wave + unit_noise(wave.shape, rng))[..., None]


def unit_noise(shape, rng) -> np.ndarray:
    """Complex noise of power 1."""
    return np.sqrt(0.5) * (rng.normal(size=shape) + 1j * rng.normal(size=shape))


def direction_bound(place, azimuth, elevation, *, snr) -> tuple[float, float]:
    """Least standard deviations of azimuth and elevation, rad; NaN for one that is not measured.

    The Fisher information 2 Re(∂m* ∂m) of unit noise is formed numerically from the model m of
    unknown azimuth, elevation, amplitude and phase.
    """
    true = np.array([azimuth, elevation, 1.0, 0.3])

    def model(values):
        return np.sqrt(snr) * values[2] * np.exp(1j * values[3]) * phases(place, *values[:2])

    slope = np.stack([(model(true + h) - model(true - h)) / (2 * STEP) for h in STEP * np.eye(4)])
    information = 2.0 * np.real(slope.conj() @ slope.T)
    is_measured = np.ptp(place, axis=0) > 0
    kept = [n for n, known in enumerate((*is_measured, True, True)) if known]
    bound = np.full(4, np.nan)
    bound[kept] = np.sqrt(np.diag(np.linalg.inv(information[np.ix_(kept, kept)])))
    return float(bound[0]), float(bound[1])


def drawn_directions(place, count, rng) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths within ±60° and elevations within ±30°; zero for an angle that is not measured."""
    has_width, has_height = np.ptp(place, axis=0) > 0
    azimuth = np.radians(rng.uniform(-60.0, 60.0, count)) * has_width
    return azimuth, np.radians(rng.uniform(-30.0, 30.0, count)) * has_height
