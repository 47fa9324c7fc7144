"""Measures of mitigation: signal to disturbance, error vector magnitude, share of samples changed.

Amplitudes are those at a target's cell, ``(target, ramp)``. Once a frame has fixed which samples
mitigation changes and how, that change is linear, so that it can be applied separately to the
target's own echo and to the sum of all other parts.
"""

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray


def signal_to_disturbance(own: ComplexArray, rest: ComplexArray) -> FloatArray:
    r"""Power ratio of the own echo S (``own``) to the rest I, summed over ramps k: ``(target,)``.

    .. math:: \frac{\sum_k |S_k|^2}{\sum_k |I_k|^2}

    >>> signal_to_disturbance(np.array([[2.0, 2.0j]]), np.array([[0.1, -0.1]]))
    array([400.])
    """
    return np.asarray(_power(own) / np.maximum(_power(rest), 1e-300))


def error_vector_magnitude(found: ComplexArray, clean: ComplexArray) -> FloatArray:
    r"""Rms error of amplitudes A (``found``) relative to the rms of C (``clean``): ``(target,)``.

    .. math:: \sqrt{\frac{\sum_k |A_k - C_k|^2}{\sum_k |C_k|^2}}

    ``clean`` has no interference. The error includes the distortion of the echo by mitigation,
    which a ratio of powers does not show.

    >>> error_vector_magnitude(np.array([[1.0, 1.1]]), np.array([[1.0, 1.0]])).round(3)
    array([0.071])
    """
    return np.asarray(np.sqrt(_power(found - clean) / np.maximum(_power(clean), 1e-300)))


def sample_sinr(echo: ComplexArray, repaired: ComplexArray) -> float:
    r"""Power ratio of the echoes s (``echo``) to the error of the samples x (``repaired``).

    .. math:: \frac{\sum |s|^2}{\sum |s - x|^2}

    Both are V, of any shape. It counts errors in gaps like noise everywhere: a method that removes
    noise too exceeds the SNR.

    >>> sample_sinr(np.array([1.0, 1.0, 1.0]), np.array([1.0, 1.0, 0.0]))
    3.0
    """
    error = float(np.sum(np.abs(echo - repaired) ** 2))
    return float(np.sum(np.abs(echo) ** 2)) / max(error, 1e-300)


def share_touched(
    before: ComplexArray, after: ComplexArray, weight: FloatArray, is_sample: BoolArray
) -> float:
    """Share of the samples that mitigation changed, or whose weight it lowered.

    Changes of at most 1e-9 of the strongest sample's magnitude are ignored as rounding (chosen).

    Parameters
    ----------
    before, after : samples before and after mitigation, V, ``(channel, ramp, fast)``
    weight : weight that mitigation gives each sample, 0 … 1, ``(ramp, fast)``
    is_sample : false in the padding of short ramps, ``(ramp, fast)``

    Examples
    --------
    >>> present = np.array([[True, True, True, False]])
    >>> samples = np.array([[[1.0, 2.0, 3.0, 0.0]]])
    >>> weight = np.array([[1.0, 0.5, 1.0, 0.0]])
    >>> share_touched(samples, samples, weight, present)
    0.33
    """
    change = np.max(np.abs(after - before), axis=0)
    touched = (change > 1e-9 * float(np.max(np.abs(before)))) | (weight < 1.0)
    return float(np.mean(touched[is_sample]))


def _power(amplitude: ComplexArray) -> FloatArray:
    return np.asarray(np.sum(np.abs(amplitude) ** 2, axis=-1))
