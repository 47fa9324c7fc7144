"""`IfFilter`: the IF low-pass filter, which all synthesis engines share."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.spec import Spec
from polychirp.units import Hertz, Ratio, Unit, from_db

LONGEST_RESPONSE: Final = 1e4
"""Greatest length of the impulse response, in periods of the stop edge; longer filters are refused.
Chosen: the filter's tables grow with this length, and the default filter has a length of 10."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IfFilter(Spec):
    r"""Low-pass between mixer and converter: a windowed sinc in continuous time.

    .. math:: h(s) = C\,2 f_c\,\mathrm{sinc}(2 f_c s)\,
              \frac{I_0\left(\beta\sqrt{1-(2s/S)^2}\right)}{I_0(\beta)}, \quad |s| \le S/2

    with :math:`f_c` half-way between pass and stop edge, which are :math:`\Delta f` apart, Kaiser's
    :math:`\beta` and length :math:`S = (A-7.95)/(14.36\,\Delta f)` for attenuation A dB (Kaiser
    1974), and C such that the gain at zero frequency is 1. The response h is real and even: **the
    delay of a causal filter is removed**, so that sample times are times at the antenna.

    Parameters
    ----------
    passband, stopband : Hz, edges of pass and stop band; the filter is symmetric about 0 Hz
    attenuation : power ratio in the stop band, e.g. 90 dB

    Examples
    --------
    >>> IfFilter(passband=0.3e6, stopband=0.7e6).response([0.0, 0.5e6, 0.7e6]).round(3) + 0.0
    array([1. , 0.5, 0. ])
    """

    passband: Annotated[float, Unit("Hz", least="1 Hz")] = 0.3e6
    stopband: Hertz = 0.7e6
    attenuation: Ratio = from_db(90.0)

    def __post_init__(self) -> None:
        if not 0 < self.passband < self.stopband:
            raise InputError("an IF filter's pass band must be positive and below its stop band")
        if not self.attenuation >= from_db(21.0):
            raise InputError("an IF filter needs at least 21 dB of attenuation")
        if self.support * self.stopband > LONGEST_RESPONSE:
            raise InputError(
                f"the IF filter's stop band is {self.stopband - self.passband:.3g} Hz above "
                f"its pass band, so that its response lasts {self.support:.3g} s; let the stop "
                "band begin further above the pass band"
            )

    @property
    def support(self) -> float:
        """Length S of the impulse response, s; it reaches from −S/2 to S/2."""
        level = 10.0 * np.log10(self.attenuation)
        return float((level - 7.95) / (14.36 * (self.stopband - self.passband)))

    @property
    def beta(self) -> float:
        """Kaiser's window parameter (scipy.signal.kaiser_beta's formula)."""
        level = 10.0 * np.log10(self.attenuation)
        if level > 50.0:
            return float(0.1102 * (level - 8.7))
        return float(0.5842 * (level - 21.0) ** 0.4 + 0.07886 * (level - 21.0))

    def impulse_response(self, time: FloatArray) -> FloatArray:
        """Impulse response h, 1/s, at times ``(…,)`` in s; it is zero outside the support."""
        return _scale(self) * _shape(self, np.asarray(time, dtype=np.float64))

    def response(self, frequency: FloatArray) -> FloatArray:
        """Frequency response H, real, dimensionless, at frequencies ``(…,)`` in Hz."""
        f = np.asarray(frequency, dtype=np.float64)
        time, weighted = _nodes(self, float(np.max(np.abs(f), initial=0.0)) + self.stopband)
        flat = f.reshape(-1)
        out = np.empty(flat.size)
        block = max(1, 4_000_000 // time.size)
        for first in range(0, flat.size, block):
            part = slice(first, first + block)
            out[part] = np.cos(2 * np.pi * np.outer(flat[part], time)) @ weighted
        return out.reshape(f.shape)

    def derivatives(self, time: FloatArray, order: int) -> FloatArray:
        r"""Value and derivatives of h up to ``order``: ``(order + 1, time)`` in s^-(1+order).

        Inside the support h equals an entire function, so Cauchy's integral over a circle gives
        every derivative with rounding errors only. At the ends of the support the results are the
        one-sided derivatives from inside; beyond the ends they are those of the entire function.

        >>> derivative = IfFilter().derivatives(np.array([0.0]), 1)[1, 0]
        >>> abs(float(derivative)) < 1e-6 * 0.7e6**2  # h is even
        True
        """
        t = np.asarray(time, dtype=np.float64)
        # 4 time scales of h (chosen): rounding errors grow on smaller circles, and on larger ones
        # too, because h grows like cosh along imaginary time
        radius = 4.0 / (2 * np.pi * self.stopband + self.beta**2 / self.support)
        circle = np.exp(2j * np.pi * np.arange(64) / 64)
        values = _analytic(self, t[:, None] + radius * circle)
        orders = np.arange(order + 1)
        factor = np.array([math.factorial(j) for j in orders]) / radius**orders
        return np.asarray(factor[:, None] * np.real(values @ circle[:, None] ** -orders).T / 64)

    @property
    def noise_bandwidth(self) -> float:
        """∫|H(f)|² df over positive and negative f, Hz; computed as ∫h² ds (Parseval)."""
        time, weighted = _nodes(self, 2.0 * self.stopband)
        return float(weighted @ self.impulse_response(time))


def _shape(filter_: IfFilter, time: FloatArray) -> FloatArray:
    cutoff = 0.5 * (filter_.passband + filter_.stopband)
    inside = 1.0 - (2.0 * time / filter_.support) ** 2
    window = np.i0(filter_.beta * np.sqrt(np.maximum(inside, 0.0))) / np.i0(filter_.beta)
    return np.where(inside >= 0.0, 2.0 * cutoff * np.sinc(2.0 * cutoff * time) * window, 0.0)


def _analytic(filter_: IfFilter, time: ComplexArray) -> ComplexArray:
    """The entire function that equals the impulse response in its support, at complex times."""
    from scipy.special import iv

    cutoff = 0.5 * (filter_.passband + filter_.stopband)
    root = np.sqrt(1.0 - (2.0 * time / filter_.support) ** 2)
    window = iv(0, filter_.beta * root) / np.i0(filter_.beta)
    return np.asarray(_scale(filter_) * 2.0 * cutoff * np.sinc(2.0 * cutoff * time) * window)


@lru_cache(maxsize=32)
def _scale(filter_: IfFilter) -> float:
    nodes, weights = gauss_panels(_num_panels(filter_, filter_.stopband))
    half = 0.5 * filter_.support
    return float(1.0 / np.sum(half * weights * _shape(filter_, half * nodes)))


def gauss_panels(count: int) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights on [−1, 1] of ``count`` panels with 16 Gauss–Legendre points each.

    The integral is exact to rounding if the integrand has at most two cycles in each panel.

    >>> node, weight = gauss_panels(3)
    >>> round(float(weight @ np.cos(node)), 12)  # 2 sin 1
    1.682941969616
    """
    inner, weight = np.polynomial.legendre.leggauss(16)
    centre = (2.0 * np.arange(count) + 1.0) / count - 1.0
    return (centre[:, None] + inner / count).ravel(), np.tile(weight / count, count)


def _num_panels(filter_: IfFilter, highest: float) -> int:
    return math.ceil(0.5 * filter_.support * highest)


def _nodes(filter_: IfFilter, highest: float) -> tuple[FloatArray, FloatArray]:
    """Times, s, and weights times h, to integrate h times a function of up to ``highest`` Hz."""
    nodes, weights = gauss_panels(_num_panels(filter_, highest))
    time = 0.5 * filter_.support * nodes
    return time, 0.5 * filter_.support * weights * filter_.impulse_response(time)
