"""Number of independent looks that the channels of an array have at the background of a map."""

from __future__ import annotations

from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, SingleComplexArray

BACKGROUND: Final = 0.9
"""Share of a range's cells, the weaker ones, that are taken for background; chosen: bodies fill
fewer than the others."""

INDEPENDENT: Final = 0.25
"""Share of the cells that are independent; chosen: tapers correlate neighbours along both axes."""

MOST_ROWS: Final = 64
"""Number of range rates that are used; chosen: enough, at a small cost."""

EXCESS: Final = 1.15
"""Factor by which the largest eigenvalue must exceed that of independent channels; chosen."""

NEIGHBOURS: Final = 8
"""Ranges on either side whose covariances are averaged; chosen as the reach of the CFAR window."""

STEP: Final = 0.25
"""Step of the numbers of looks, which are rounded down; chosen, so that few thresholds exist."""


def independent_looks(amplitude: ComplexArray | SingleComplexArray) -> FloatArray:
    r"""Number of independent looks at each range of a map, ``(range,)``.

    Thermal noise of C channels is independent, and the mean of their powers has C looks. The signal
    of another radar that is spread over the map, by a code or by other slopes, has one direction:
    all channels receive the same, and there is one look. A threshold for C looks would then be
    crossed much too often. With the covariance R of the channels in background cells, whose largest
    eigenvalue is λ, there are

    .. math:: \frac{\operatorname{tr} R}{\lambda}

    looks: as many exponential variables of equal means λ have the same mean power, and a tail that
    is not below that of the channels' power. λ is first freed of the excess
    :math:`(1 + \sqrt{C/n})^2` that it has with n cells of independent channels (Marchenko and
    Pastur 1967). If little more is left, there are C looks.

    Parameters
    ----------
    amplitude : ``(channel, range_rate, range)``

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> noise, other = random.normal(size=(2, 4, 64, 40)) + 1j * random.normal(size=(2, 4, 64, 40))
    >>> independent_looks(noise)[:3]
    array([4., 4., 4.])
    >>> independent_looks(noise + 30.0 * other[:1])[:3]
    array([1., 1., 1.])
    """
    channels, rows, ranges = amplitude.shape
    used = amplitude[:, :: -(-rows // MOST_ROWS)]
    used = np.where(np.isfinite(used), used, np.complex64(0.0))
    strongest = np.abs(used).max(initial=0.0)
    if channels == 1 or strongest == 0.0:
        return np.full(ranges, float(channels))
    used = used / strongest  # squares of any recording stay finite
    cells = BACKGROUND * INDEPENDENT * used.shape[1] * min(ranges, 2 * NEIGHBOURS + 1)
    share = _excess(_averaged(_background_covariances(used)), cells)
    looks = channels / (1.0 + share * (channels - 1.0))
    return np.asarray(np.floor(looks / STEP + 1e-9) * STEP)


def looks_of_a_spectrum(amplitude: ComplexArray) -> float:
    """Number of independent looks that the channels have at the background of one spectrum.

    It is that of `independent_looks`, with one number for all cells: they are dealt out to maps of
    `MOST_ROWS` cells each, whose covariances are averaged.

    Parameters
    ----------
    amplitude : ``(channel, cell)``

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> noise, other = random.normal(size=(2, 4, 1024)) + 1j * random.normal(size=(2, 4, 1024))
    >>> looks_of_a_spectrum(noise), looks_of_a_spectrum(noise + 30.0 * other[:1])
    (4.0, 1.0)
    """
    channels, cells = amplitude.shape
    columns = max(1, cells // MOST_ROWS)
    rows = cells // columns
    dealt = amplitude[:, : rows * columns].reshape(channels, rows, columns)
    return float(independent_looks(dealt).min())


def _background_covariances(amplitude: ComplexArray) -> ComplexArray:
    """Covariance of the channels in the weaker cells of each range, of trace 1."""
    power = np.sum(amplitude.real**2 + amplitude.imag**2, axis=0)
    is_weak = power <= np.quantile(power, BACKGROUND, axis=0)
    total = np.sum(power * is_weak, axis=0)
    kept = np.moveaxis(amplitude * (is_weak / np.sqrt(np.where(total > 0.0, total, 1.0))), 2, 0)
    return np.asarray(kept @ np.conj(np.swapaxes(kept, 1, 2)))


def _averaged(covariance: ComplexArray) -> ComplexArray:
    """Mean of each range's covariance and those of its `NEIGHBOURS`."""
    from scipy.ndimage import uniform_filter1d

    size = min(len(covariance), 2 * NEIGHBOURS + 1)
    parts = (uniform_filter1d(part, size, axis=0) for part in (covariance.real, covariance.imag))
    return np.asarray(next(parts) + 1j * next(parts))


def _excess(covariance: ComplexArray, cells: float) -> FloatArray:
    """Excess of the largest eigenvalue: 0 if channels are independent, 1 if they are alike."""
    channels = covariance.shape[-1]
    largest = channels * np.linalg.eigvalsh(covariance)[..., -1]
    least = (1.0 + np.sqrt(channels / cells)) ** 2
    if least * EXCESS >= channels:  # too few cells to tell
        return np.zeros(largest.shape)
    share = np.clip((largest - least) / (channels - least), 0.0, 1.0)
    return np.where(largest > EXCESS * least, share, 0.0)
