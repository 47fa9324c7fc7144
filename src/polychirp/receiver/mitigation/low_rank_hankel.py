"""Sparse and low-rank Hankel decomposition: echoes are few tones, interference few samples.

It is slow, and needs no detector: the reference beside the faster methods.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_detectors.base import widened
from polychirp.receiver.mitigation.matrix_pencil import LEAST_SINGULAR, powers
from polychirp.receiver.mitigation.prediction import rms
from polychirp.spec import Spec
from polychirp.units import Between

FACTOR = 5.4
"""Multiple of the lower quartile of the residue above which a sample is interference. Chosen: noise
of one channel exceeds it in one of 4500 samples, and the quartile is right up to three quarters of
the ramp hit. A threshold that falls from iteration to iteration lets the first tones follow strong
interference, which they then keep."""

MOST_STEPS = 100
"""Greatest number of restarts of the search for singular vectors, from which on all vectors are
computed. Chosen: tones need some ten; of nearly equal singular values 2000 may not be enough."""

SPREAD = 2
"""Samples beside one above the last threshold that count as interference too; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LowRankHankel(Spec):
    r"""Split each ramp into few tones, whose Hankel matrix has a low rank, and sparse interference.

    .. math:: y = x + i, \qquad \operatorname{rank} H(x) \le r, \qquad i \text{ sparse}

    (J. Wang, Ding and Yarovoy 2022, by a sum of singular values and of magnitudes). Here the rank
    is given, and x and i are found in turns (Cai, Cai, Wang and Yin 2021): x has the means of the
    anti-diagonals of the r strongest singular parts of :math:`H(y - i)`, and i is what of y − x
    exceeds `FACTOR` times the lower quartile of all y − x. Channels share the tones' poles, as one
    matrix of all channels, and the samples of i. At last amplitudes are fitted to the poles by
    least squares over the samples without interference: "hit" replaces the others by these tones,
    "all" replaces the whole ramp, which removes noise too, and echoes beyond the rank.

    Ramps in which nothing exceeds the threshold are not changed. With N samples it takes some
    32 r N log₂ N real multiplications per singular step and channel, some ten steps per iteration.
    `MatrixPencil` is the faster one.

    Parameters
    ----------
    rank : r, number of tones; at least the number of strong echoes
    iterations : number of turns
    replaces : "hit" or "all"
    """

    kind: Literal["low-rank-hankel"] = "low-rank-hankel"
    rank: Annotated[int, Between(greatest=256)] = 10
    iterations: Annotated[int, Between(greatest=1000)] = 20
    replaces: Literal["hit", "all"] = "hit"

    def __post_init__(self) -> None:
        if self.rank < 1 or self.iterations < 2:
            raise InputError("a low-rank decomposition needs a rank of 1 and 2 iterations, or more")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with tones in place of interference."""
        present = frame.times.is_sample
        is_real = not np.any(frame.samples.imag)
        fitted = []
        for k, length in enumerate(frame.times.num_samples):
            line = frame.samples[:, k, :length]
            pole, hit = separate(line, rank=self.rank, iterations=self.iterations)
            if hit.any() and pole.size and np.count_nonzero(~hit) >= 2 * pole.size:
                good = np.flatnonzero(~hit)
                fit = np.asarray(np.linalg.pinv(powers(pole, good), rcond=LEAST_SINGULAR))
                put = np.flatnonzero(hit) if self.replaces == "hit" else np.arange(hit.size)
                tone = powers(pole, put)
                if is_real:  # the real part of the map: rounding parts a pole from its conjugate
                    fit = np.concatenate([0.5 * fit, 0.5 * fit.conj()])
                    tone = np.concatenate([tone, tone.conj()], axis=1)
                fitted.append((k, good, put, fit, tone))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, good, put, fit, tone in fitted:
                out[..., k, put] = samples[..., k, good] @ fit.T @ tone.T
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)


def separate(line: ComplexArray, *, rank: int, iterations: int) -> tuple[ComplexArray, BoolArray]:
    """Poles of the tones ``(tone,)`` and mask ``(fast,)`` of interference in a ramp.

    Parameters
    ----------
    line : ``(channel, fast)``
    """
    rank = min(rank, line.shape[1] // 4)
    if rank == 0 or not line.any():
        return np.zeros(0, dtype=np.complex128), np.zeros(line.shape[1], dtype=np.bool_)
    interference = np.zeros_like(line)
    basis = np.zeros((2, 0), dtype=np.complex128)
    hit = np.zeros(line.shape[1], dtype=np.bool_)
    for _ in range(iterations):
        tones, basis = low_rank(line - interference, rank)
        residue = rms(line - tones)
        # rounding of tones without noise is no interference
        floor = max(float(np.quantile(residue, 0.25)), 1e-10 * float(residue.max()))
        hit = residue > FACTOR * floor
        interference = np.where(hit, line - tones, 0.0)
    turn = np.linalg.lstsq(basis[:-1], basis[1:], rcond=None)[0]
    pole = np.linalg.eigvals(turn)
    return pole / np.maximum(np.abs(pole), 1e-300), widened(hit[None], SPREAD)[0]


def low_rank(line: ComplexArray, rank: int) -> tuple[ComplexArray, ComplexArray]:
    """Samples ``(channel, fast)`` of the nearest Hankel matrix of low rank, and its column space.

    It is the nearest matrix of this rank, with means of its anti-diagonals. Products of Hankel
    matrices with vectors are convolutions, so that the matrix is never made.

    >>> tone = np.exp(0.5j * np.arange(40))[None]
    >>> bool(np.abs(low_rank(tone, 1)[0] - tone).max() < 1e-12)
    True
    """
    from scipy import fft
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, svds

    channels, length = line.shape
    rows = length // 2 + 1
    columns = length + 1 - rows
    size = fft.next_fast_len(2 * length)
    spectrum = fft.fft(line, size, axis=1)

    def times(vector: ComplexArray) -> ComplexArray:
        turned = fft.fft(vector.reshape(channels, columns)[:, ::-1], size, axis=1)
        product = fft.ifft(np.sum(spectrum * turned, axis=0))
        return np.asarray(product[columns - 1 : columns - 1 + rows])

    def adjoint(vector: ComplexArray) -> ComplexArray:
        turned = fft.fft(vector.ravel().conj()[::-1], size)
        product = fft.ifft(spectrum * turned, axis=1)[:, rows - 1 : rows - 1 + columns]
        return np.asarray(product.conj().ravel())

    shape = (rows, channels * columns)
    matrix = LinearOperator(shape, matvec=times, rmatvec=adjoint, dtype=np.complex128)
    start = np.ones(min(shape), dtype=np.complex128)
    try:
        left, singular, right = svds(matrix, k=rank, v0=start, tol=1e-6, maxiter=MOST_STEPS)
    except ArpackNoConvergence:  # singular values of a chirp are nearly equal
        left = strongest_columns(line, rank)
        singular, right = np.ones(rank), np.stack([adjoint(u) for u in left.T]).conj()
    weighted = fft.fft(left * singular, size, axis=0)
    parts = right.reshape(rank, channels, columns)
    sums = fft.ifft(np.einsum("fr,rcf->cf", weighted, fft.fft(parts, size, axis=2)), axis=1)
    place = np.arange(length)
    count = np.minimum(np.minimum(place + 1, length - place), min(rows, columns))
    return sums[:, :length] / count, left


def strongest_columns(line: ComplexArray, rank: int) -> ComplexArray:
    """The strongest left singular vectors of the Hankel matrix of `low_rank`, ``(row, rank)``.

    They are eigenvectors of the product of the matrix with its adjoint, which takes N³/8 operations
    with N samples, however near to each other the singular values are.

    >>> tone = np.exp(0.5j * np.arange(40))[None]
    >>> bool(np.allclose(np.abs(strongest_columns(tone, 1)), 21**-0.5))
    True
    """
    rows = line.shape[1] // 2 + 1
    gram = np.zeros((rows, rows), dtype=np.complex128)
    for one in line:
        hankel = np.lib.stride_tricks.sliding_window_view(one, one.size + 1 - rows)
        gram += hankel @ hankel.conj().T
    return np.asarray(np.linalg.eigh(gram)[1][:, -rank:])
