"""IMAT: a spectrum of few lines replaces the samples that interference hits."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.mitigation.prediction import rms
from polychirp.units import Between, Ratio, from_db

LEAST_LINE_FACTOR = 3.0
"""Multiple of the spectrum's median amplitude below which a line may be noise and is not used.
Chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Imat(BurstRepair):
    r"""Replace bursts by an iterative method with adaptive thresholding (IMAT).

    Echoes are few lines in a ramp's spectrum. With the samples y, the mask m of the samples that
    are hit and the Fourier transform F over the ramp, the iteration is

    .. math:: z \leftarrow (1-m)\,y + m\,F^{-1}\,T_k\{F z\},

    where :math:`T_k` keeps the lines above a threshold that falls from the strongest line by
    equal factors to ``depth`` below it (Marvasti et al. 2012; Bechter, Roos, Rahman and
    Waldschmidt 2017), but not below three times the spectrum's median amplitude. All channels keep
    the same lines, chosen by their mean power, so that azimuths are kept. Every burst is filled,
    whatever its length; no test tells whether the filled samples are right.

    `Blanking` sets the bursts to zero instead.

    Parameters
    ----------
    iterations : number of thresholds
    depth : power ratio of the first threshold to the last
    """

    kind: Literal["imat"] = "imat"
    iterations: Annotated[int, Between(greatest=1000)] = 10
    depth: Ratio = from_db(60.0)

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.iterations < 2:
            raise InputError("IMAT needs 2 iterations or more, for its threshold to fall")
        if not self.depth > 1.0:
            raise InputError("IMAT's depth must be above 0 dB, for its threshold to fall")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with all hit ones replaced."""
        hit = self.hit(frame)
        present = frame.times.is_sample
        samples = frame.samples * present
        lines = []
        for k in np.flatnonzero(hit.any(axis=1)):
            length = int(frame.times.num_samples[k])
            chosen, samples[:, k, :length] = sparse_lines(
                frame.samples[:, k, :length],
                hit[k, :length],
                iterations=self.iterations,
                depth=self.depth,
            )
            lines.append((int(k), chosen))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, chosen in lines:
                length = chosen.shape[1]
                out[..., k, :length] = filled(samples[..., k, :length], hit[k, :length], chosen)
            return np.asarray(out)

        return Mitigated(samples=samples, weight=present.astype(np.float64), repair=repair)


def sparse_lines(
    samples: ComplexArray, hit: BoolArray, *, iterations: int, depth: float
) -> tuple[BoolArray, ComplexArray]:
    """Lines that each iteration keeps, and the samples filled from them; see `Imat`.

    Parameters
    ----------
    samples : one ramp, ``(channel, fast)``
    hit : ``(fast,)``

    Returns
    -------
    chosen : ``(iteration, frequency)``
    filled : ``(channel, fast)``
    """
    from scipy import fft

    known = np.where(hit, 0.0, samples)
    z = known
    first = 0.0
    chosen = np.zeros((iterations, samples.shape[-1]), dtype=bool)
    for k in range(iterations):
        spectrum = fft.fft(z, axis=-1)
        level = rms(spectrum)
        first = first or float(level.max())
        threshold = first * depth ** (-0.5 * k / (iterations - 1))
        chosen[k] = level > max(threshold, LEAST_LINE_FACTOR * float(np.median(level)))
        z = known + hit * fft.ifft(spectrum * chosen[k], axis=-1)
    return chosen, z


def filled(samples: ComplexArray, hit: BoolArray, chosen: BoolArray) -> ComplexArray:
    """Samples ``(…, fast)`` with those that are hit replaced by the chosen lines of their spectrum.

    Parameters
    ----------
    hit : ``(fast,)``
    chosen : lines that each iteration keeps, ``(iteration, frequency)``
    """
    from scipy import fft

    known = np.where(hit, 0.0, samples)
    z = known
    for lines in chosen:
        z = known + hit * fft.ifft(lines * fft.fft(z, axis=-1), axis=-1)
    return np.asarray(z)
