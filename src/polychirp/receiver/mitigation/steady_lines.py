r"""Steady lines of a ramp, by which the cells that an excision removes are filled.

An echo is a tone over the whole ramp. What an excision keeps of a ramp's samples y is :math:`P y`,
with the matrix P of the short-time transform, its gain and the inverse transform. Tones
:math:`e_k` with the amplitudes

.. math:: a = \arg\min_a \Big\lVert P y - \sum_k a_k P e_k \Big\rVert^2, \qquad
          z = P y + (1 - P) \sum_k a_k e_k

fill what is missing. A sum of these tones is then restored exactly, whatever was removed. The tones
are found one by one: each is the strongest one of what all before it leave (orthogonal matching
pursuit; Pati, Rezaiifar and Krishnaprasad 1993), and the frequencies of all are refined after each
(Newtonised pursuit; Mamandipoor, Ramasamy and Madhow 2016): otherwise a tone between two that are
tried would leave others in its place, not the same ones on every ramp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple, Self

import numpy as np
from scipy.fft import fft, ifft

from polychirp.axes import ComplexArray, FloatArray

if TYPE_CHECKING:
    from scipy.signal import ShortTimeFFT

TONES_PER_CELL: Final = 4
"""Tones that are tried per cell of the ramp's spectrum. Chosen: the refinement begins within an
eighth of a cell."""

STEPS: Final = 2
"""Number of steps of the refinement after each tone. Chosen."""

DAMPING: Final = 1e-3
"""Share by which the curvature of each frequency is raised. Chosen."""

LEAST_RISE: Final = 8.0
"""Least ratio of a tone's power to the median of what remains in the spectrum. Chosen: on the
highway of docs/validation, 16 fills less of the echoes, and 4 fits noise."""

MOST_LINES: Final = 24
"""Greatest number of tones. Chosen: the time of a ramp grows with its square."""

LEAST_SINGULAR: Final = 1e-3
"""Singular values of the tones below this share of the greatest one are not used. Chosen: the
amplitudes of almost equal tones would be large and of opposite sign."""


class Lines(NamedTuple):
    """Steady lines of one ramp as a linear map of the samples that an excision keeps.

    tone : the tones, ``(fast, line)``
    missing : the part of the tones that the excision removes, ``(fast, line)``
    fit : amplitudes of the tones from the samples that are kept, ``(line, fast)``
    """

    tone: ComplexArray
    missing: ComplexArray
    fit: ComplexArray

    def real(self) -> Lines:
        """The real part of the map, as real samples need: each line with its conjugate, halved.

        The excision's matrix must be real.
        """
        return Lines(
            tone=np.concatenate([self.tone, self.tone.conj()], axis=1),
            missing=np.concatenate([self.missing, self.missing.conj()], axis=1),
            fit=np.concatenate([0.5 * self.fit, 0.5 * self.fit.conj()]),
        )


def excision_matrix(transform: ShortTimeFFT, gain: FloatArray, length: int) -> ComplexArray:
    """Matrix P of an excision on a ramp of ``length`` samples, ``(fast, fast)``.

    Parameters
    ----------
    gain : factor of every cell ``(frequency, slice)``; slices as of the transform of the ramp,
        perhaps of a longer padded one
    """
    size = transform.m_num
    reach = np.subtract.outer(np.arange(size), np.arange(size)) % size
    # the slice's transform, gain and inverse transform are a circular convolution
    kernel = ifft(gain, axis=0)
    out = np.zeros((length + 2 * size, length + 2 * size), dtype=np.complex128)
    outer = np.outer(transform.dual_win, transform.win.conj())
    for column in range(gain.shape[1]):
        start = (column + transform.p_min) * transform.hop - transform.m_num_mid + size
        if 0 <= start <= length + size:
            block = slice(start, start + size)
            out[block, block] += outer * kernel[reach, column]
    return out[size:-size, size:-size]


def steady_lines(kept: ComplexArray, matrix: ComplexArray, share: FloatArray) -> Lines:
    """The steady lines of a ramp, strongest first, and the fit of their amplitudes.

    Parameters
    ----------
    kept : samples that the excision keeps, ``(channel, fast)``; their mean power over the channels
        decides
    matrix : P of the excision, ``(fast, fast)``
    share : of each row's cells that the excision keeps, ``(frequency,)``
    """
    length = kept.shape[1]
    size = TONES_PER_CELL * length
    # a tone of which little is kept is as strong as its part
    weight = np.interp(np.arange(size) / size, np.arange(share.size) / share.size, share)
    weight = np.maximum(weight, 0.1) ** 2
    frequency = np.zeros(0)
    model = _Model.of(frequency, matrix)
    rest = kept
    for _ in range(min(MOST_LINES, length // 8)):
        spectrum = fft(rest, n=size, axis=1)
        power = np.mean(spectrum.real**2 + spectrum.imag**2, axis=0) / weight
        best = int(np.argmax(power))
        if power[best] < LEAST_RISE * np.median(power):
            break
        frequency = np.append(frequency, best / size)
        for _ in range(STEPS):
            model = _Model.of(frequency, matrix)
            frequency = frequency + model.step(kept, matrix)
        model = _Model.of(frequency, matrix)
        rest = kept - kept @ model.fit.T @ model.seen.T
    return Lines(tone=model.tone, missing=model.tone - model.seen, fit=model.fit)


class _Model(NamedTuple):
    """Tones, what the excision keeps of them, ``(fast, line)``, and `Lines.fit`."""

    tone: ComplexArray
    seen: ComplexArray
    fit: ComplexArray

    @classmethod
    def of(cls, frequency: FloatArray, matrix: ComplexArray) -> Self:
        """The tones with these frequencies, cycles per sample ``(line,)``."""
        time = np.arange(len(matrix))
        tone = np.exp(2j * np.pi * np.outer(time, frequency))
        seen = matrix @ tone
        return cls(tone, seen, np.linalg.pinv(seen, rcond=LEAST_SINGULAR))

    def step(self, kept: ComplexArray, matrix: ComplexArray) -> FloatArray:
        """Gauss-Newton step of the frequencies, cycles per sample, for all channels together."""
        time = np.arange(len(matrix)) - 0.5 * (len(matrix) - 1)
        slope = matrix @ (2j * np.pi * time[:, None] * self.tone)
        amplitude = kept @ self.fit.T
        rest = kept - amplitude @ self.seen.T
        common = amplitude.conj().T @ amplitude
        curvature = (common * (slope.conj().T @ slope)).real
        gradient = np.sum(amplitude.conj() * (rest @ slope.conj()), axis=0).real
        # a multiple of the diagonal keeps steps of tones that are almost equal small
        curvature[np.diag_indices_from(curvature)] *= 1.0 + DAMPING
        cell = 1.0 / len(matrix)
        return np.clip(np.linalg.solve(curvature, gradient), -0.25 * cell, 0.25 * cell)
