"""Linear prediction of echoes: each sample from those before it, or from those after it."""

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray

REGULARISATION = 1e-13
"""Share of the Gram matrix's trace added to the normal equations, which tones without noise make
singular: the solution is then the smallest of all models that fit. Chosen near rounding."""


def covariance_model(samples: ComplexArray, is_good: BoolArray, order: int) -> ComplexArray | None:
    r"""Coefficients 1, a₁ … a_P with the least squared forward and backward prediction errors.

    .. math:: \min_a \sum \Big|\sum_{k=0}^{P} a_k x_{n-k}\Big|^2
              + \Big|\sum_{k=0}^{P} a_k \overline{x_{n-P+k}}\Big|^2

    over channels and all n whose P + 1 samples are good: the modified covariance method
    (Marple 1987). None if there are fewer than P pairs of a forward and a backward error.

    Parameters
    ----------
    samples : ``(channel, fast)``
    is_good : mask of the samples to be used, ``(fast,)``

    Examples
    --------
    One coefficient predicts a tone.

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
    inner = gram[1:, 1:] + (REGULARISATION * np.trace(gram).real + 1e-300) * np.eye(order)
    return np.concatenate([[1.0], np.linalg.solve(inner, -gram[1:, 0])])


def prediction_errors(samples: ComplexArray, order: int) -> FloatArray:
    """Errors of each sample's forward and backward prediction: V, rms over channels, ``(2, fast)``.

    A burst disturbs the forward prediction of the next ``order`` samples, and the backward
    prediction of the ``order`` samples before it: the smaller error shows the burst alone. Where a
    prediction would need samples beyond the ramp its error is infinite. On a ramp too short for a
    model of this order all errors are zero.

    Parameters
    ----------
    samples : one ramp, ``(channel, fast)``

    Examples
    --------
    Nothing is unexpected in a tone but the sample that is wrong.

    >>> tone = np.exp(0.5j * np.arange(40))[None]
    >>> tone[0, 20] += 9.0
    >>> int(prediction_errors(tone, 1).min(axis=0).argmax())
    20
    """
    from scipy.signal import lfilter

    length = samples.shape[1]
    model = covariance_model(samples, np.ones(length, dtype=bool), order)
    if model is None or length < 2 * order:
        return np.zeros((2, length))
    error = np.full((2, length), np.inf)
    for error_, line in zip(error, (samples, samples[:, ::-1].conj()), strict=True):
        error_[order:] = rms(lfilter(model, np.ones(1), line, axis=-1))[order:]
    error[1] = error[1, ::-1].copy()
    return error


def rms(samples: ComplexArray) -> FloatArray:
    """Root of the mean power over channels, which are the first axis."""
    return np.asarray(np.sqrt(np.mean(samples.real**2 + samples.imag**2, axis=0)))
