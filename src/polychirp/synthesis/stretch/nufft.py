r"""Sums of many tones on a uniform grid of samples: the inner operation of `bundles`.

.. math:: y_c[n] = \sum_p w_{pc}\, e^{j2\pi\nu_p (n - \lfloor N/2 \rfloor)}, \quad 0 \le n < N

Two implementations with one interface. `GriddedTones` (compiled) is a non-uniform fast Fourier
transform of type 1 (Dutt and Rokhlin 1993) behind Kaiser and Bessel's window (Fessler and Sutton
2003): its cost is P + N log N. Its own because a library's takes the window anew for every column:
FINUFFT 2.5 needs 36 ns per path and column and 0.27 ms per call, this some 7 ns and none, and a
pair of ramps has some fifty columns. `BlockTones` is made of matrix products alone, for any array
library with the functions of the Python array API: it is what runs on a GPU.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial
from importlib import import_module
from typing import Any, Final, Protocol

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.errors import InputError

WIDTH: Final = 12
"""Grid points that a tone is spread over."""

DENSITY: Final = 1.7
"""Grid points per sample, at least: with these the result is right to 1e-9, with 2 to 1e-10."""

DEGREE: Final = 13
"""Of the polynomials that stand for the window between two grid points."""

BLOCK: Final = 1 << 21
"""Numbers that `BlockTones` holds at once."""


class Tones(Protocol):
    """A running sum over tones."""

    def add(self, frequency: FloatArray, weight: ComplexArray) -> None:
        """Add tones of ``frequency`` (path,), cycles per sample, and ``weight`` (path, column)."""
        ...

    def sums(self) -> ComplexArray:
        """All that was added, ``(sample, column)``."""
        ...


MakeTones = Callable[[int, int], Tones]
"""From numbers of samples and columns to a running sum."""


class GriddedTones:
    """A sum of tones by spreading every tone over `WIDTH` points of one spectrum.

    >>> tones = GriddedTones(64, 1)
    >>> tones.add(np.array([0.1, -0.37]), np.array([[1.0], [2j]]))
    >>> n = np.arange(64) - 32
    >>> expected = np.exp(2j * np.pi * 0.1 * n) + 2j * np.exp(-2j * np.pi * 0.37 * n)
    >>> bool(np.all(np.abs(tones.sums()[:, 0] - expected) < 1e-9))
    True
    """

    def __init__(self, count: int, columns: int) -> None:
        self.count = count
        size, self.beta = grid_of(count, DENSITY)
        self.grid = np.zeros((size, columns), dtype=np.complex128)

    def add(self, frequency: FloatArray, weight: ComplexArray) -> None:
        """See `Tones.add`."""
        from polychirp.synthesis.stretch.batch_kernels import spread

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
    """A sum of tones by matrix products: with n = a·B + b a tone is a product of two.

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
        """See `Tones.add`; NumPy's arrays are carried to the library's device."""
        paths, columns = weight.shape
        step = max(1, BLOCK // (columns * self.outer + self.inner))
        for first in range(0, paths, step):
            part = slice(first, first + step)
            self._add(self.xp.asarray(frequency[part]), self.xp.asarray(weight[part].T))

    def _add(self, frequency: Any, weight: Any) -> None:
        """One block: ``frequency`` (path,) and ``weight`` (column, path) of the library's own."""
        xp = self.xp
        outer = xp.arange(self.outer, dtype=xp.float64) * self.inner - self.count // 2
        inner = xp.arange(self.inner, dtype=xp.float64)
        coarse = _turned(xp, outer[:, None] * frequency[None, :])
        fine = _turned(xp, frequency[:, None] * inner[None, :])
        self.total = self.total + (weight[:, None, :] * coarse[None, :, :]) @ fine

    def sums(self) -> ComplexArray:
        """See `Tones.sums`; NumPy's array."""
        flat = self.xp.reshape(self.total, (self.total.shape[0], -1))
        host = flat.get() if hasattr(flat, "get") else np.asarray(flat)
        return np.asarray(host[:, : self.count].T)


def tones_of(backend: str) -> MakeTones:
    """What makes sums of tones: "numpy" and "cupy" by blocks, else compiled.

    Raises
    ------
    InputError
        CuPy is asked for and cannot be imported.
    """
    if backend == "numpy":
        return partial(BlockTones, xp=np)
    if backend != "cupy":
        return GriddedTones
    try:
        return partial(BlockTones, xp=import_module("cupy"))
    except ImportError:
        raise InputError(
            "backend 'cupy' needs CuPy, which is not installed; install polychirp[gpu] or take "
            "backend 'auto'"
        ) from None


def _turned(xp: Any, cycles: Any) -> Any:
    return xp.exp(2j * math.pi * (cycles - xp.floor(cycles)))


# ── the window ────────────────────────────────────────────────────────────────────────────────


def grid_of(count: int, density: float) -> tuple[int, float]:
    """Points of a grid with ``density`` of them per sample, and the shape of the window there."""
    from scipy.fft import next_fast_len

    beta = math.pi * math.sqrt((WIDTH * (1.0 - 0.5 / density)) ** 2 - 0.8)
    return next_fast_len(max(math.ceil(density * count), 2 * WIDTH)), beta


def window_at(place: FloatArray, beta: float) -> tuple[IntArray, FloatArray]:
    """The first of the points around each place, and the window there, ``(place, tap)``."""
    edge = place - 0.5 * WIDTH
    first = np.ceil(edge)
    x = 2.0 * (first - edge) - 1.0
    powers = x[:, None] ** np.arange(DEGREE + 1)
    return first.astype(np.int64), powers @ _window_polynomials(beta)


@lru_cache(maxsize=4)
def _window_polynomials(beta: float) -> FloatArray:
    """Coefficients of the window about every tap, ``(power, tap)``.

    For a tone that lies ``x`` in [0, 1) beyond the first tap's place less half a width, the taps
    are at i + x − WIDTH/2; powers are of 2x − 1.
    """
    place = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    off = 0.5 * (place[:, None] + 1.0) + np.arange(WIDTH) - 0.5 * WIDTH
    inside = np.maximum(1.0 - (2.0 * off / WIDTH) ** 2, 0.0)
    values = np.i0(beta * np.sqrt(inside)) / np.i0(beta)
    return np.ascontiguousarray(np.linalg.solve(place[:, None] ** np.arange(DEGREE + 1), values))


@lru_cache(maxsize=128)
def correction(count: int, size: int, beta: float) -> FloatArray:
    """What takes the window off every sample again."""
    return 1.0 / _window_spectrum((np.arange(count) - count // 2) / size, beta)


def _window_spectrum(frequency: FloatArray, beta: float) -> FloatArray:
    """The window's Fourier transform, at cycles per grid point."""
    root = np.sqrt(beta**2 - (np.pi * WIDTH * frequency) ** 2)
    return np.asarray(WIDTH * np.sinh(root) / (root * np.i0(beta)))
