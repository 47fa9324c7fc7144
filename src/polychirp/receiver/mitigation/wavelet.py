"""Wavelets: coefficients above Stein's threshold are taken for interference and subtracted."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.units import Between

LOW_PASS: Final = np.array(
    [
        0.23037781330885523,
        0.7148465705525415,
        0.6308807679295904,
        -0.02798376941698385,
        -0.18703481171888114,
        0.030841381835986965,
        0.032883011666982945,
        -0.010597401784997278,
    ]
)
"""Low-pass filter of Daubechies' orthogonal wavelet with four vanishing moments ("db4"), of minimum
phase (Daubechies 1992, table 6.1). The tests derive it again by spectral factorization."""

HIGH_PASS: Final = LOW_PASS[::-1] * (-1.0) ** np.arange(LOW_PASS.size)
"""Quadrature mirror of `LOW_PASS`."""

MEDIAN_OF_REAL: Final = 0.4549364231195725
"""Median of the square of a real normal variable over its mean: the median of a chi-square variable
of one degree of freedom."""

MEDIAN_OF_COMPLEX: Final = float(np.log(2.0))
"""Median of the squared magnitude of a complex normal variable over its mean."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wavelet(BurstRepair):
    r"""Subtract the large coefficients of a wavelet transform of each ramp with bursts.

    A burst fills few coefficients of a wavelet transform, and an echo all coefficients of its bands
    alike. Echoes and noise are therefore the background here, and a coefficient above a threshold
    is interference (S. Lee, J.-Y. Lee and S.-C. Kim 2021). Those of interference are transformed
    back and subtracted.

    The threshold of each band is that of SureShrink (Donoho and Johnstone 1995): for coefficients c
    of d real components, and a background of variance σ² per component, Stein's unbiased estimate
    of the squared error of shrinking all amplitudes by t is

    .. math:: R(t) = \sum_{|c| \le t} (|c|^2 - d σ^2) + \sum_{|c| > t} \left(t^2 + d σ^2 -
        2 σ^2 t\,(d-1) / |c|\right),

    and t is where it is least, of no more than the universal threshold, which is :math:`σ\sqrt{2\ln
    n}` for n coefficients. If the band's mean power exceeds the background's by less than
    :math:`(\log_2 n)^{3/2} n^{-1/2}` of it, bursts are too sparse for the estimate, and the
    universal threshold is taken. The background is found from the median of :math:`|c|^2`. The rms
    amplitude over the channels stands for |c|, with d = 2, or 1 for real samples, so that all
    channels lose the same coefficients and azimuths are kept.

    Ramps are continued by their mirror image on both sides, as far as the filters reach. A ramp on
    which the detector finds nothing is not changed. It takes 64 real multiplications per sample and
    channel, those of the mirror images included in the samples.

    A coefficient of an echo that a burst hits is lost with the burst; and a burst that sweeps
    through a band more slowly than the band's filters ring fills the band like an echo, and stays.

    Parameters
    ----------
    levels : number of octaves into which a ramp is split, and a last band below them

    Examples
    --------
    >>> Wavelet(levels=3).levels
    3
    """

    kind: Literal["wavelet"] = "wavelet"
    levels: Annotated[int, Between(greatest=16)] = 4

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.levels < 1:
            raise InputError("a wavelet transform needs 1 level or more; 4 are usual")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without large coefficients on the ramps that are hit."""
        hit = self.hit(frame)
        present = frame.times.is_sample
        is_real = not np.any(frame.samples.imag)
        taken: list[tuple[int, int, list[BoolArray]]] = []
        for k in np.flatnonzero(hit.any(axis=1)):
            length = int(frame.times.num_samples[k])
            bands = split(self._continued(frame.samples[:, k, :length]), self.levels)
            masks = [above_threshold(band, is_real=is_real) for band in bands]
            taken.append((int(k), length, masks))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, length, masks in taken:
                bands = split(self._continued(out[..., k, :length]), self.levels)
                found = joined([band * mask for band, mask in zip(bands, masks, strict=True)])
                start = self._reach
                out[..., k, :length] -= found[..., start : start + length]
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    @property
    def _reach(self) -> int:
        """Samples by which a ramp is continued: length of the lowest band's filter, rounded up."""
        return int(LOW_PASS.size * 2**self.levels)

    def _continued(self, line: ComplexArray) -> ComplexArray:
        """A ramp ``(…, fast)`` between mirror images, of a length that all levels divide."""
        length = line.shape[-1]
        before = np.arange(-self._reach, length + self._reach + -length % 2**self.levels)
        place = np.mod(before, 2 * length)
        return np.asarray(line[..., np.minimum(place, 2 * length - 1 - place)])


def above_threshold(band: ComplexArray, *, is_real: bool) -> BoolArray:
    """Mask ``(place,)`` of the coefficients ``(channel, place)`` of a band that are interference.

    >>> band = np.ones((1, 64), dtype=complex)
    >>> band[0, 10] = 30.0
    >>> np.flatnonzero(above_threshold(band, is_real=False)).tolist()
    [10]
    """
    power = np.mean(band.real**2 + band.imag**2, axis=0)
    median = float(np.median(power))
    background = median / (MEDIAN_OF_REAL if is_real else MEDIAN_OF_COMPLEX)
    if background == 0.0:
        return np.asarray(power > 0.0)
    parts = 1 if is_real else 2
    amplitude = np.sqrt(power * parts / background)
    return np.asarray(amplitude > stein_threshold(amplitude, parts=parts))


def stein_threshold(amplitude: FloatArray, *, parts: int) -> float:
    """SureShrink's threshold of coefficients of ``parts`` real components of variance 1 each.

    Parameters
    ----------
    amplitude : magnitudes, ``(place,)``

    Examples
    --------
    >>> stein_threshold(np.array([1.0, 1.0, 1.0, 1.0]), parts=2) == np.sqrt(2 * np.log(4))
    np.True_
    """
    count = amplitude.size
    universal = float(np.sqrt(2.0 * np.log(count)))
    excess = np.mean(amplitude**2) / parts - 1.0
    if excess <= np.log2(count) ** 1.5 / np.sqrt(count):
        return universal
    candidates = np.append(amplitude[amplitude < universal], universal)
    return float(candidates[np.argmin(stein_risk(amplitude, candidates, parts=parts))])


def stein_risk(amplitude: FloatArray, thresholds: FloatArray, *, parts: int) -> FloatArray:
    """Stein's estimate of the squared error if amplitudes shrink by a threshold; see `Wavelet`.

    Parameters
    ----------
    amplitude : magnitudes of coefficients with noise of variance 1 per component, ``(place,)``
    thresholds : ``(threshold,)``
    parts : d, real components of a coefficient

    Returns
    -------
    ``(threshold,)``
    """
    level, t = amplitude, thresholds[:, None]
    slope = (parts - 1) / np.maximum(level, np.finfo(float).tiny)
    risk = np.where(level <= t, level**2 - parts, t**2 + parts - 2.0 * t * slope)
    return np.asarray(risk.sum(axis=-1))


def split(samples: ComplexArray, levels: int) -> list[ComplexArray]:
    """Bands of the orthogonal wavelet transform of samples ``(…, fast)`` that repeat.

    Returns
    -------
    The ``levels`` octaves from the highest one on, then the rest; the shape of octave l is
    ``(…, fast / 2**l)``.

    Raises
    ------
    InputError
        ``2**levels`` does not divide the number of samples.

    Examples
    --------
    >>> [band.shape for band in split(np.ones((2, 16), dtype=complex), 2)]
    [(2, 8), (2, 4), (2, 4)]
    """
    if samples.shape[-1] % 2**levels:
        raise InputError(f"{samples.shape[-1]} samples cannot be halved {levels} times")
    bands, rest = [], samples
    for _ in range(levels):
        low, high = np.zeros_like(rest[..., ::2]), np.zeros_like(rest[..., ::2])
        for lag, (of_low, of_high) in enumerate(zip(LOW_PASS, HIGH_PASS, strict=True)):
            shifted = np.roll(rest, -lag, axis=-1)[..., ::2]
            low += of_low * shifted
            high += of_high * shifted
        bands.append(high)
        rest = low
    return [*bands, rest]


def joined(bands: Sequence[ComplexArray]) -> ComplexArray:
    """Samples of bands: the inverse of `split`."""
    rest = bands[-1]
    for high in bands[-2::-1]:
        whole = np.zeros((*rest.shape[:-1], 2 * rest.shape[-1]), dtype=rest.dtype)
        for lag, (of_low, of_high) in enumerate(zip(LOW_PASS, HIGH_PASS, strict=True)):
            spread = np.zeros_like(whole)
            spread[..., ::2] = of_low * rest + of_high * high
            whole += np.roll(spread, lag, axis=-1)
        rest = whole
    return np.asarray(rest)
