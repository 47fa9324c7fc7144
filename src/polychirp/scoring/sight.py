r"""In sight: when a body counts as a target that a receiver could find.

A gap between two cars may show a hand's breadth of a third one. Its truth has visible metal, but
its echo may be 60 dB below that of the next car, and no radar reports it. A target is **in sight**
of a radar in a frame if two conditions hold:

1. **Geometry**: of the metal that faces the radar, at least `LEAST_SHARE` is in line of sight, by
   the solid angle that it fills at the radar (`Truth.visible_share`).
2. **Noise**: the coherent SNR of its echo is at least `LEAST_SNR`. It is the energy of the noise-
   free echo of this body alone in all samples of all channels, over the noise power of a sample,

   .. math:: \mathrm{SNR}_b = \frac{N M}{\sigma^2}\;
             \Big\langle\Big|\sum_{p \in b} a_p e^{-j 2\pi f \tau_p}\Big|^2\Big\rangle_f,

   with the amplitudes a and delays τ of its own paths without mirrors, averaged over the band of
   the frame, N samples on each of M channels, and the noise power σ².

Interference, stronger echoes and the receiver's processing do not enter: they may hide a target,
but do not take it out of sight. Of a fluctuating point, the SNR of the mean cross section counts:
a draw that fades is missed, as Swerling's cases say. The mean over the band hardly depends on the
ramps, so that the same street has the same targets in sight with every waveform that sends the
same energy. Targets out of sight are counted apart; detections of them are neither ghosts nor
part of the detection probability.
"""

from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.truth import Truth
from polychirp.units import from_db

LEAST_SHARE: Final = 0.1
"""Least share of the metal towards the radar that is in line of sight; chosen: of a car from behind
it is a strip of 15 cm beside the car in front."""

LEAST_SNR: Final = from_db(24.0)
"""Least coherent SNR of a body's echo, a ratio; chosen: 10 dB above the 14 dB at which four
channels have one false detection in 10⁶ cells. A body has its energy in up to ten places."""


def in_sight(truth: Truth, snr: FloatArray) -> BoolArray:
    """Mask of the targets that are in sight, ``(target,)``, given their coherent SNRs, ratios.

    Examples
    --------
    A car in the open, one of which 5 % can be seen, and one whose echo is as weak as noise:

    >>> zero = np.zeros(3)
    >>> cars = Truth(time=0.0, name=("a", "b", "c"), range=[10.0, 12.0, 25.0], range_rate=zero,
    ...     azimuth=zero, elevation=zero, point=np.zeros((3, 3)), is_visible=np.full(3, True),
    ...     visible_share=[0.8, 0.05, 0.3])
    >>> in_sight(cars, np.array([1e12, 1e9, 1.0])).tolist()
    [True, False, False]
    """
    is_shown = truth.is_visible & (truth.visible_share >= LEAST_SHARE)
    return np.asarray(is_shown & (snr >= LEAST_SNR), dtype=np.bool_)
