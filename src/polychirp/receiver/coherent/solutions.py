"""Small matrices in kernels."""

from typing import Any

import numpy as np

from polychirp.jit import inner

REGULARISATION = 1e-9
"""Share added to the diagonal of normalised equations for amplitudes; chosen: it bounds points that
coincide."""

LEAST_PIVOT = 1e-12
"""Least square of a pivot of equations with unit diagonals; chosen: rounding makes some 1e-14."""


@inner
def product_of(first: Any, second: Any) -> Any:  # pragma: no cover - compiled
    """Product of two complex matrices."""
    out = np.zeros((first.shape[0], second.shape[1]), dtype=np.complex128)
    for i in range(first.shape[0]):
        for n in range(first.shape[1]):
            for j in range(second.shape[1]):
                out[i, j] += first[i, n] * second[n, j]
    return out


@inner
def inverse_into(matrix: Any, share: float, out: Any) -> None:  # pragma: no cover - compiled
    """Inverse of a Hermitian matrix without negative eigenvalues.

    It is that of the matrix scaled to a unit diagonal, to which ``share`` is added, scaled back.
    ``matrix`` is overwritten by its Cholesky factor (Golub and Van Loan 2013, 4.2).
    """
    size = len(matrix)
    scale = np.empty(size)
    for i in range(size):
        scale[i] = 1.0 / np.sqrt(max(matrix[i, i].real, 1e-300))
    for i in range(size):
        for j in range(i + 1):
            matrix[i, j] *= scale[i] * scale[j]
        matrix[i, i] += share
    _factor(matrix)
    for column in range(size):
        _solve_unit(matrix, column, out[:, column])
    for i in range(size):
        for j in range(size):
            out[i, j] *= scale[i] * scale[j]


@inner
def _factor(matrix: Any) -> None:  # pragma: no cover - compiled
    """Cholesky factor in place of the lower triangle."""
    for j in range(len(matrix)):
        pivot = matrix[j, j].real
        for n in range(j):
            pivot -= matrix[j, n].real ** 2 + matrix[j, n].imag ** 2
        root = np.sqrt(max(pivot, LEAST_PIVOT))
        matrix[j, j] = root
        for i in range(j + 1, len(matrix)):
            value = matrix[i, j]
            for n in range(j):
                value -= matrix[i, n] * matrix[j, n].conjugate()
            matrix[i, j] = value / root


@inner
def _solve_unit(factor: Any, column: int, out: Any) -> None:  # pragma: no cover - compiled
    """One column of the inverse from the Cholesky factor."""
    for i in range(out.size):
        value = complex(1.0 if i == column else 0.0, 0.0)
        for n in range(column, i):
            value -= factor[i, n] * out[n]
        out[i] = value / factor[i, i].real if i >= column else complex(0.0, 0.0)
    for i in range(out.size - 1, -1, -1):
        value = out[i]
        for n in range(i + 1, out.size):
            value -= factor[n, i].conjugate() * out[n]
        out[i] = value / factor[i, i].real
