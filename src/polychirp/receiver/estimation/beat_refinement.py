"""Range and range rate of a cell of the map from the beats on all ramps, of any slopes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import FloatArray, IntArray
from polychirp.jit import compiled, inner

TYPICAL_ACCELERATION = 20.0
"""Standard deviation of the prior on a range's second derivative, m/s². Chosen for streets: larger
than braking alone, since the range of a body that passes by has a second derivative also."""

LARGEST_RANGE_CHANGE = 0.3
"""Largest correction of a range, m. Chosen: less than two range cells of a ramp of 900 MHz (0.17 m
each), since a peak farther from the guess is that of another point."""

LARGEST_RATE_CHANGE = 0.8
"""Largest correction of a range rate, m/s. Chosen for the same reason."""


def range_and_rate_from_beats(
    logs: NDArray[np.float32],
    guess: FloatArray,
    *,
    beam: IntArray,
    place: FloatArray,
    slope: FloatArray,
    reach: int,
    resolution: float,
) -> FloatArray:
    r"""Least-squares range and rate from the beats measured on all ramps: ``(point, 2)``.

    Near the guess the beat of ramp k is linear in (R, v). The fit to the peaks :math:`\hat f_k` of
    the spectra extends eqs 9 and 10 of the paper to any number of ramps of any slopes. Tukey's
    biweight gives little weight to ramps on which another echo or interference shifts the peak. A
    point keeps its guess if its correction exceeds `LARGEST_RANGE_CHANGE` or `LARGEST_RATE_CHANGE`.

    Parameters
    ----------
    logs : ln(power), ``(ramp, bin, beam)``
    guess : range and range rate, m and m/s, ``(point, 2)``
    beam : number of each point's beam, ``(point,)``
    place : bin, as a real number, of the beat of each point's guess, ``(point, ramp)``
    slope : derivatives of the beat, bins per m and per m/s, ``(ramp, 2)``
    reach : bins on either side of the prediction in which the peak is searched
    resolution : bins per resolution cell of a ramp
    """
    return np.asarray(_from_beats(logs, guess, beam, place, slope, reach, resolution))


@compiled
def _from_beats(  # pragma: no cover - compiled
    logs: Any, guess: Any, beam: Any, place: Any, slope: Any, reach: int, resolution: float
) -> Any:
    """Compiled `range_and_rate_from_beats`."""
    points, ramps = place.shape
    out = guess.copy()
    error, size = np.empty(ramps), np.empty(ramps)
    for n in range(points):
        distance, rate = 0.0, 0.0
        for _ in range(3):
            for k in range(ramps):
                predicted = place[n, k] + slope[k, 0] * distance + slope[k, 1] * rate
                error[k] = _peak_near(logs[k, :, beam[n]], predicted, reach) - predicted
                size[k] = abs(error[k])
            spread = max(1.5 * _median(size), 0.01 * resolution)
            aa, ab, bb, ay, by = 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(ramps):
                weight = max(0.0, 1.0 - (error[k] / (4.0 * spread)) ** 2) ** 2
                aa += weight * slope[k, 0] ** 2
                ab += weight * slope[k, 0] * slope[k, 1]
                bb += weight * slope[k, 1] ** 2
                ay += weight * slope[k, 0] * error[k]
                by += weight * slope[k, 1] * error[k]
            determinant = aa * bb - ab * ab
            if determinant > 1e-12 * aa * bb:
                distance += (bb * ay - ab * by) / determinant
                rate += (aa * by - ab * ay) / determinant
        if abs(distance) <= LARGEST_RANGE_CHANGE and abs(rate) <= LARGEST_RATE_CHANGE:
            out[n, 0] += distance
            out[n, 1] += rate
    return out


@inner
def _median(values: Any) -> float:  # pragma: no cover - compiled
    """The median of a few values, sorted in place; numba's own median takes seconds to compile."""
    for n in range(1, values.size):
        value, place = values[n], n
        while place > 0 and values[place - 1] > value:
            values[place] = values[place - 1]
            place -= 1
        values[place] = value
    half = values.size // 2
    if values.size % 2 == 1:
        return float(values[half])
    return float((values[half - 1] + values[half]) / 2)


@inner
def _peak_near(values: Any, predicted: float, reach: int) -> float:  # pragma: no cover - compiled
    """Bin of the peak near a prediction; a parabola through three bins interpolates it."""
    centre = int(np.rint(predicted))
    low, high = max(1, centre - reach), min(values.size - 1, centre + reach + 1)
    if high <= low:
        return predicted
    best = low
    for i in range(low, high):
        if values[i] > values[best]:
            best = i
    left, middle = float(values[best - 1]), float(values[best])
    right = float(values[best + 1])
    bend = left - 2.0 * middle + right
    if bend >= 0.0:
        return float(best)
    return best + min(0.5, max(-0.5, 0.5 * (left - right) / bend))


def motion_steps(
    errors: FloatArray, strength: FloatArray, sensitivity: FloatArray, resolution: FloatArray
) -> FloatArray:
    r"""Corrections of (R, v, a) from the beat errors of all ramps: ``(point, 3)``.

    R is the range, v its first and a its second derivative. The fit is one of least squares over
    ramps, weighted by the point's power on each ramp and by Tukey's biweight, which gives little
    weight to ramps that another echo or interference disturbs. The prior on the correction of a
    has the mean 0 and the standard deviation `TYPICAL_ACCELERATION`.

    Parameters
    ----------
    errors : measured minus predicted beats, Hz, ``(point, ramp)``
    strength : power of the point in any unit, ``(point, ramp)``
    sensitivity : derivatives of the beat, Hz per m, per m/s and per m/s², ``(ramp, 3)``
    resolution : 1 over the length of a ramp's window, Hz, ``(ramp,)``
    """
    bounded = np.clip(errors, -0.5 * resolution, 0.5 * resolution)
    spread = np.median(np.abs(bounded), axis=1, keepdims=True) + 1e-4 * resolution
    tukey = np.clip(1.0 - (bounded / (6.0 * spread)) ** 2, 0.0, 1.0) ** 2
    weight = tukey * strength / (spread**2 * np.mean(strength, axis=1, keepdims=True) + 1e-300)
    normal = np.einsum("pk,ki,kj->pij", weight, sensitivity, sensitivity)
    right = np.einsum("pk,ki,pk->pi", weight, sensitivity, bounded)
    normal += np.diag([1e-6, 1e-6, 1.0 / TYPICAL_ACCELERATION**2])
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])
