r"""Correlation of two signals by Fourier transforms.

.. math:: R(\tau) = \frac{\int a(t+\tau)\,\overline{b(t)}\,dt}{\sqrt{E_a E_b}}

All correlations have this scale: the correlation of a signal with itself has a peak of 1, and no
correlation exceeds 1 (Cauchy and Schwarz).
"""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Self

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, seal
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Correlation:
    """Normalised correlation over lag, in equal steps.

    `correlate` returns it.

    Parameters
    ----------
    amplitude : ``(lag,)``
    lag : s, ``(lag,)``, growing; positive where the first signal is later
    """

    amplitude: Annotated[ComplexArray, Axes("lag", dtype=np.complex128)]
    lag: Annotated[FloatArray, Axes("lag")]

    def __post_init__(self) -> None:
        seal(self)
        if self.lag.size < 3:
            raise InputError("a correlation needs three lags or more; give longer signals")

    @property
    def spacing(self) -> float:
        """Distance of neighbouring lags, s."""
        return float(self.lag[-1] - self.lag[0]) / (self.lag.size - 1)

    @property
    def power(self) -> FloatArray:
        """Power |R|², ``(lag,)``."""
        return np.asarray(self.amplitude.real**2 + self.amplitude.imag**2)

    def within(self, greatest_lag: float) -> Self:
        """Part of the correlation with lags of up to ± ``greatest_lag`` s."""
        inside = np.abs(self.lag) <= greatest_lag * (1 + 1e-12)
        return replace(self, amplitude=self.amplitude[inside], lag=self.lag[inside])


def need_comparable(a: Baseband, b: Baseband) -> None:
    """Refuse signals of different rates or carriers, or without energy."""
    if not math.isclose(a.sample_rate, b.sample_rate, rel_tol=1e-12):
        raise InputError(
            f"the signals have {a.sample_rate / 1e6:g} and {b.sample_rate / 1e6:g} MS/s; "
            "resample one of them to the other's rate"
        )
    if not math.isclose(a.centre_frequency, b.centre_frequency, rel_tol=1e-12, abs_tol=1e-3):
        raise InputError(
            f"the signals have carriers of {a.centre_frequency / 1e9:.9g} and "
            f"{b.centre_frequency / 1e9:.9g} GHz; retune one of them, or compare basebands"
        )
    if not (a.energy > 0 and b.energy > 0):
        raise InputError("a signal has no energy; check that its samples are not all zero")


def correlate(a: Baseband, b: Baseband, *, oversampling: int = 1) -> Correlation:
    """Correlation of two signals at every lag at which they overlap, by three Fourier transforms.

    ``oversampling`` is the number of lags per sample: zeros are inserted between the halves of the
    spectrum, which interpolates band-limited samples exactly. `InputError` is raised if the signals
    have different rates or carriers, or one has no energy.

    >>> ones = Baseband(samples=np.ones(4), sample_rate=1.0)
    >>> correlate(ones, ones).amplitude.real.round(12)
    array([0.25, 0.5 , 0.75, 1.  , 0.75, 0.5 , 0.25])
    """
    from scipy.fft import fft, ifft, next_fast_len

    need_comparable(a, b)
    size = next_fast_len(a.num_samples + b.num_samples - 1)
    product = fft(a.samples, size)
    other = fft(b.samples, size)
    np.conjugate(other, out=other)
    product *= other
    del other
    if oversampling > 1:
        half = (size + 1) // 2
        wide = np.zeros(oversampling * size, dtype=np.complex128)
        wide[:half] = product[:half]
        wide[half - size :] = product[half:]
        product = wide
    values = ifft(product, overwrite_x=True)
    before, behind = oversampling * (b.num_samples - 1), oversampling * (a.num_samples - 1)
    step = 1.0 / (oversampling * a.sample_rate)
    scale = oversampling / (a.sample_rate * math.sqrt(a.energy * b.energy))
    ordered = np.concatenate([values[values.size - before :], values[: behind + 1]])
    ordered *= scale
    lag = np.arange(-before, behind + 1) * step + (a.start_time - b.start_time)
    return Correlation(amplitude=ordered, lag=np.asarray(lag))
