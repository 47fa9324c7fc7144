r"""Sums of many tones on a uniform grid of samples: the inner operation of `path_batches`.

.. math:: y_c[n] = \sum_p w_{pc}\, e^{j2\pi\nu_p (n - \lfloor N/2 \rfloor)}, \quad 0 \le n < N

for tones p of frequency ν, in cycles per sample, and with one weight w in every column c. Two
implementations share one interface. `GriddedTones` (compiled) is a non-uniform fast Fourier
transform of type 1 (Dutt and Rokhlin 1993) with the window of Kaiser and Bessel (Fessler and Sutton
2003): its cost for P tones grows like P + N log N. FINUFFT 2.5 is not used because it computes the
window again for every column: it needs 36 ns per tone and column and 0.27 ms per call, and
`GriddedTones` 7 ns and no fixed time, while a pair of ramps has some fifty columns. `BlockTones`
has matrix products alone, and works with any library of the Python array API, also on a GPU.
"""

import math
from collections.abc import Callable
from functools import lru_cache, partial
from importlib import import_module
from typing import Any, Final, Protocol

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.errors import InputError

WINDOW_WIDTH: Final = 12
"""Number of grid points over which a tone is spread (chosen)."""

GRID_DENSITY: Final = 1.7
"""Least grid points per sample: errors are below 1e-9 of the sum of |w|, with 2 below 1e-10."""

WINDOW_DEGREE: Final = 13
"""Degree of the polynomials that replace the window between two grid points (chosen)."""

NUMBERS_PER_BLOCK: Final = 1 << 21
"""Most complex numbers that `BlockTones` holds at once: 32 MiB (chosen)."""


class Tones(Protocol):
    """A running sum over tones."""

    def add(self, frequency: FloatArray, weight: ComplexArray) -> None:
        """Add tones of ``frequency`` (path,), cycles per sample, and ``weight`` (path, column)."""

    def sums(self) -> ComplexArray:
        """The sum so far, ``(sample, column)``."""


MakeTones = Callable[[int, int], Tones]
"""Function of the numbers of samples and columns that gives an empty running sum."""


class GriddedTones:
    """A sum of tones, each of which is spread over `WINDOW_WIDTH` points of one spectrum.

    >>> tones = GriddedTones(64, 1)
    >>> tones.add(np.array([0.1, -0.37]), np.array([[1.0], [2j]]))
    >>> n = np.arange(64) - 32
    >>> expected = np.exp(2j * np.pi * 0.1 * n) + 2j * np.exp(-2j * np.pi * 0.37 * n)
    >>> bool(np.all(np.abs(tones.sums()[:, 0] - expected) < 1e-9))
    True
    """

    def __init__(self, count: int, columns: int) -> None:
        self.count = count
        size, self.beta = grid_of(count, GRID_DENSITY)
        self.grid = np.zeros((size, columns), dtype=np.complex128)

    def add(self, frequency: FloatArray, weight: ComplexArray) -> None:
        """See `Tones.add`."""
        from polychirp.synthesis.stretch.nufft_kernels import spread

        numbers = np.ascontiguousarray(weight, dtype=np.complex128).view(np.float64)
        spread(self.grid.view(np.float64), frequency, numbers, _window_polynomials(self.beta))

    def sums(self) -> ComplexArray:
        """See `Tones.sums`."""
        from scipy.fft import ifft

        size, middle = len(self.grid), self.count // 2
        wave = ifft(self.grid, axis=0, norm="forward", workers=1)
        out = np.concatenate([wave[size - middle :], wave[: self.count - middle]])
        out *= correction(self.count, size, self.beta)[:, None]
        return out


class BlockTones:
    """A sum of tones by matrix products: at n = aB + b a tone is a factor of a times one of b.

    Parameters
    ----------
    xp : an array library with the names of the Python array API, such as NumPy, CuPy or
        array_api_strict

    >>> tones = BlockTones(64, 1, np)
    >>> tones.add(np.array([0.25]), np.array([[1.0 + 0j]]))
    >>> bool(np.all(np.abs(tones.sums()[:, 0] - 1j ** (np.arange(64) - 32)) < 1e-13))
    True
    """

    def __init__(self, count: int, columns: int, xp: Any) -> None:
        self.xp, self.count = xp, count
        self.inner = max(1, math.isqrt(count))
        self.outer = -(-count // self.inner)
        self.total = xp.zeros((columns, self.outer, self.inner), dtype=xp.complex128)

    def add(self, frequency: FloatArray, weight: ComplexArray) -> None:
        """See `Tones.add`; NumPy's arrays are copied to the library's device."""
        paths, columns = weight.shape
        step = max(1, NUMBERS_PER_BLOCK // (columns * self.outer + self.inner))
        for first in range(0, paths, step):
            part = slice(first, first + step)
            self._add(self.xp.asarray(frequency[part]), self.xp.asarray(weight[part].T))

    def _add(self, frequency: Any, weight: Any) -> None:
        """Add a block: ``frequency`` (path,) and ``weight`` (column, path) of the library."""
        xp = self.xp
        outer = xp.arange(self.outer, dtype=xp.float64) * self.inner - self.count // 2
        inner = xp.arange(self.inner, dtype=xp.float64)
        coarse = _turned(xp, outer[:, None] * frequency[None, :])
        fine = _turned(xp, frequency[:, None] * inner[None, :])
        self.total = self.total + (weight[:, None, :] * coarse[None, :, :]) @ fine

    def sums(self) -> ComplexArray:
        """See `Tones.sums`; the array is NumPy's."""
        flat = self.xp.reshape(self.total, (self.total.shape[0], -1))
        host = flat.get() if hasattr(flat, "get") else np.asarray(flat)
        return np.asarray(host[:, : self.count].T)


def tones_of(backend: str) -> MakeTones:
    """Maker of `BlockTones` for the backends "numpy" and "cupy", of `GriddedTones` for all others.

    `InputError` is raised if the backend is "cupy", and CuPy cannot be imported.
    """
    if backend == "numpy":
        return partial(BlockTones, xp=np)
    if backend != "cupy":
        return GriddedTones
    try:
        return partial(BlockTones, xp=import_module("cupy"))
    except ImportError:
        raise InputError(
            "backend 'cupy' needs CuPy, which is not installed; install polychirp[gpu] or use "
            "backend 'auto'"
        ) from None


def _turned(xp: Any, cycles: Any) -> Any:
    return xp.exp(2j * math.pi * (cycles - xp.floor(cycles)))


def grid_of(count: int, density: float) -> tuple[int, float]:
    """Size of a grid of at least ``density`` points per sample, and the shape β of its window."""
    from scipy.fft import next_fast_len

    beta = math.pi * math.sqrt((WINDOW_WIDTH * (1.0 - 0.5 / density)) ** 2 - 0.8)
    return next_fast_len(max(math.ceil(density * count), 2 * WINDOW_WIDTH)), beta


def window_at(place: FloatArray, beta: float) -> tuple[IntArray, FloatArray]:
    """First grid point in the window about each ``place`` (grid points), and values at all taps."""
    edge = place - 0.5 * WINDOW_WIDTH
    first = np.ceil(edge)
    x = 2.0 * (first - edge) - 1.0
    powers = x[:, None] ** np.arange(WINDOW_DEGREE + 1)
    return first.astype(np.int64), powers @ _window_polynomials(beta)


@lru_cache(maxsize=4)
def _window_polynomials(beta: float) -> FloatArray:
    """Coefficients of the window at every tap, ``(power, tap)``.

    Tap i lies i + x − WINDOW_WIDTH/2 grid points from the tone, 0 ≤ x < 1; powers are of 2x − 1.
    """
    place = np.cos(np.pi * (np.arange(WINDOW_DEGREE + 1) + 0.5) / (WINDOW_DEGREE + 1))
    off = 0.5 * (place[:, None] + 1.0) + np.arange(WINDOW_WIDTH) - 0.5 * WINDOW_WIDTH
    inside = np.maximum(1.0 - (2.0 * off / WINDOW_WIDTH) ** 2, 0.0)
    values = np.i0(beta * np.sqrt(inside)) / np.i0(beta)
    return np.ascontiguousarray(
        np.linalg.solve(place[:, None] ** np.arange(WINDOW_DEGREE + 1), values)
    )


@lru_cache(maxsize=128)
def correction(count: int, size: int, beta: float) -> FloatArray:
    """Factor of every sample that undoes the window."""
    return 1.0 / _window_spectrum((np.arange(count) - count // 2) / size, beta)


def _window_spectrum(frequency: FloatArray, beta: float) -> FloatArray:
    """Fourier transform of the window at ``frequency``, in cycles per grid point."""
    root = np.sqrt(beta**2 - (np.pi * WINDOW_WIDTH * frequency) ** 2)
    return np.asarray(WINDOW_WIDTH * np.sinh(root) / (root * np.i0(beta)))
