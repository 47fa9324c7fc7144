"""`FrontEnd` — what lies between mixer and samples besides the IF filter: each step optional."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.spec import Spec
from polychirp.units import Hertz, Radians, Ratio, Watts, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class HighPass(Spec):
    r"""High-pass behind the IF filter: first-order sections in a row.

    .. math:: H(f) = \prod_i \frac{jf}{f_i + jf}

    Radar chips have one or two such sections; they hold back leakage and bumper, and flatten
    what falls with range. Each ramp finds it at rest, and what rings until the converter's start
    is not sampled: :math:`e^{-2\pi f_i t}` of the step is left after the time t. Its causal phase
    stays in the samples.

    Parameters
    ----------
    corners : Hz, where each section's power has halved; one or two
    """

    corners: tuple[Hertz, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.corners) <= 2 or not all(corner > 0 for corner in self.corners):
            raise InputError("a high-pass needs one or two corners, each a positive frequency")

    def response(self, frequency: FloatArray) -> ComplexArray:
        """H(f) at frequencies ``(…,)`` in Hz.

        >>> power = np.abs(HighPass(corners=(200e3, 200e3)).response(np.array([0.0, 200e3]))) ** 2
        >>> power.round(12).tolist()
        [0.0, 0.25]
        """
        f = 1j * np.asarray(frequency, dtype=np.float64)
        out = np.ones(f.shape, dtype=np.complex128)
        for corner in self.corners:
            out *= f / (corner + f)
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class IqImbalance(Spec):
    r"""The quadrature branch is amplified by :math:`g` and turned by :math:`\varphi`.

    From :math:`y = i + jq` comes :math:`i + jg(q\cos\varphi - i\sin\varphi)`, that is

    .. math:: \alpha y + \beta \bar y, \qquad \alpha = \tfrac12(1 + g e^{-j\varphi}), \quad
              \beta = \tfrac12(1 - g e^{j\varphi}):

    a beat has an image at minus its frequency (Razavi, RF Microelectronics, 2nd ed., §4.2).

    Parameters
    ----------
    gain : power ratio g² of the quadrature branch over the other
    phase : rad, φ
    """

    gain: Ratio = 1.0
    phase: Radians = 0.0

    def __post_init__(self) -> None:
        if not (self.gain > 0 and abs(self.phase) < 0.5 * math.pi):
            raise InputError("an I/Q imbalance needs a positive gain and less than 90° of phase")

    @property
    def weights(self) -> tuple[complex, complex]:
        """α and β."""
        turned = cmath.rect(math.sqrt(self.gain), self.phase)
        return 0.5 * (1.0 + turned.conjugate()), 0.5 * (1.0 - turned)

    @property
    def image_rejection(self) -> float:
        r"""Power ratio \|α/β\|² of a beat to its image; infinite where there is none.

        >>> round(10 * math.log10(IqImbalance(phase=math.radians(1.0)).image_rejection), 1)
        41.2
        """
        straight, image = self.weights
        return abs(straight) ** 2 / abs(image) ** 2 if image else math.inf

    def applied(self, samples: ComplexArray) -> ComplexArray:
        """What becomes of samples ``(…,)``."""
        straight, image = self.weights
        return np.asarray(straight * samples + image * np.conj(samples))


@dataclass(frozen=True, slots=True, kw_only=True)
class Offset(Spec):
    """A constant added to every sample: the mixer's self-mixing, the amplifiers' offsets.

    Parameters
    ----------
    power : W, of the constant at the converter's input
    phase : rad, of I + jQ
    """

    power: Watts
    phase: Radians = 0.0

    def __post_init__(self) -> None:
        if not self.power > 0:
            raise InputError("an offset needs a positive power; leave it out where there is none")

    @property
    def voltage(self) -> complex:
        """V."""
        return cmath.rect(math.sqrt(self.power), self.phase)


@dataclass(frozen=True, slots=True, kw_only=True)
class GainControl(Spec):
    """An amplifier before the converter, set for each ramp by what came before.

    Its gain takes the strongest I or Q voltage of the former ramps, over all channels and ahead
    of the converter, to the back-off below full scale or just beneath it. The first ramp is set
    by itself: the radar has been running. Samples are divided by the gain afterwards, so that
    only saturation and quantisation feel it.

    Parameters
    ----------
    step : ratio between neighbouring gains, in power
    least, greatest : ratio, limits of the gain
    back_off : ratio of full scale to the strongest power that is aimed at
    num_ramps : how many former ramps are looked at
    """

    step: Ratio = from_db(2.0)
    least: Ratio = from_db(-24.0)
    greatest: Ratio = from_db(24.0)
    back_off: Ratio = from_db(6.0)
    num_ramps: int = 1

    def __post_init__(self) -> None:
        if not self.step > 1:
            raise InputError("a gain control's step must be above 0 dB")
        if not 0 < self.least <= self.greatest:
            raise InputError("a gain control's least gain must not exceed its greatest")
        if not self.back_off >= 1:
            raise InputError("a gain control's back-off cannot be below 0 dB")
        if self.num_ramps < 1:
            raise InputError("a gain control must look at one former ramp or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class Digitiser(Spec):
    r"""Amplifier and quantiser, each for I and Q alike and apart.

    Beyond :math:`\pm V`, :math:`V^2` = full scale, a voltage is clipped. With ``softness`` p it
    bends before that (Rapp 1991):

    .. math:: v \to \frac{v}{(1 + |v/V|^{2p})^{1/2p}}

    The quantiser is mid-tread, with steps of :math:`2V/2^b` and codes from :math:`-2^{b-1}` to
    :math:`2^{b-1}-1`: a full-scale tone has a signal-to-noise ratio of 6.02 b + 1.76 dB.

    Parameters
    ----------
    full_scale : W, power of the strongest complex tone that is not clipped
    bits : of I and of Q; without, the steps are infinitely fine
    softness : Rapp's p, 1 is soft, 10 nearly hard; without, nothing bends below full scale
    gain_control : sets the gain ahead; without, it is 1
    """

    full_scale: Watts
    bits: int | None = None
    softness: float | None = None
    gain_control: GainControl | None = None

    def __post_init__(self) -> None:
        if not self.full_scale > 0:
            raise InputError("a digitiser needs a positive full scale")
        if self.bits is not None and not 2 <= self.bits <= 32:
            raise InputError(f"a digitiser cannot have {self.bits} bits; give it 2 to 32")
        if self.softness is not None and not self.softness > 0:
            raise InputError("a digitiser's softness must be positive; 1 is soft, 10 nearly hard")


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontEnd(Spec):
    """From the IF filter to the samples: in this order, and without any of it by default.

    Parameters
    ----------
    high_pass : behind the IF filter
    imbalance : of the branches I and Q
    offset : a constant voltage
    digitiser : gain control, saturation and quantisation
    """

    high_pass: HighPass | None = None
    imbalance: IqImbalance | None = None
    offset: Offset | None = None
    digitiser: Digitiser | None = None

    @property
    def distorts(self) -> bool:
        """Whether it adds what is in no proportion to any one signal."""
        return self.offset is not None or self.digitiser is not None
