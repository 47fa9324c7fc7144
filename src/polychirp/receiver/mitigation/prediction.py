"""Linear prediction of echoes: each sample from those before it, or from those behind it."""

from __future__ import annotations

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray

RIDGE = 1e-13
"""Share of the mean power added to the normal equations: tones without noise leave them singular,
and the smallest of all models that fit is taken."""


def covariance_model(samples: ComplexArray, is_good: BoolArray, order: int) -> ComplexArray | None:
    r"""Coefficients 1, a₁ … a_P of least forward and backward prediction error.

    .. math:: \min_a \sum \Big|\sum_{k=0}^{P} a_k x_{n-k}\Big|^2
              + \Big|\sum_{k=0}^{P} a_k \overline{x_{n-P+k}}\Big|^2

    over channels and all n whose P + 1 samples are good: the modified covariance method
    (Marple 1987). None where there are fewer such equations than twice the order.

    Parameters
    ----------
    samples : ``(channel, fast)``
    is_good : ``(fast,)``

    Examples
    --------
    A tone needs one coefficient.

    >>> tone = np.exp(0.5j * np.arange(20))[None]
    >>> float(np.angle(-covariance_model(tone, np.ones(20, dtype=bool), 1)[1]))
    0.500000
    """
    windows = np.lib.stride_tricks.sliding_window_view
    if is_good.size <= order:
        return None
    whole = windows(is_good, order + 1).all(axis=-1)
    if samples.shape[0] * np.count_nonzero(whole) < order:
        return None
    rows = windows(samples, order + 1, axis=-1)[:, whole, ::-1].reshape(-1, order + 1)
    forward = rows.conj().T @ rows
    gram = forward + forward[::-1, ::-1].conj()
    inner = gram[1:, 1:] + (RIDGE * np.trace(gram).real + 1e-300) * np.eye(order)
    return np.concatenate([[1.0], np.linalg.solve(inner, -gram[1:, 0])])


def surprise(samples: ComplexArray, order: int) -> FloatArray:
    """How far each sample is off its prediction: V, rms over channels, ``(fast,)``.

    The smaller of the forward and the backward error, because after a burst the forward one rings
    for ``order`` samples, and before it the backward one. A ramp too short for a model of this
    order surprises by all of its amplitude.

    Parameters
    ----------
    samples : one ramp, ``(channel, fast)``
    """
    from scipy.signal import lfilter

    length = samples.shape[1]
    model = covariance_model(samples, np.ones(length, dtype=bool), order)
    if model is None or length < 2 * order:
        return rms(samples)
    error = np.full((2, length), np.inf)
    for error_, line in zip(error, (samples, samples[:, ::-1].conj()), strict=True):
        error_[order:] = rms(lfilter(model, np.ones(1), line, axis=-1))[order:]
    return np.asarray(np.minimum(error[0], error[1, ::-1]))


def rms(samples: ComplexArray) -> FloatArray:
    """Root of the mean power over channels, the first axis."""
    return np.asarray(np.sqrt(np.mean(samples.real**2 + samples.imag**2, axis=0)))
