"""`FrontEnd`: optional stages between mixer and samples besides the IF filter."""

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
    r"""High-pass filter behind the IF filter: one or two first-order sections in cascade.

    .. math:: H(f) = \prod_i \frac{jf}{f_i + jf}

    Radar chips have one or two such sections. They attenuate leakage and the bumper's reflection,
    and compensate a part of the loss with range. The filter is at rest at the start of each ramp.
    The part of its transient before the converter's first sample is not in the samples; at the time
    t after the start of a ramp, a section's response to a step has decayed to
    :math:`e^{-2\pi f_i t}`. The samples keep the filter's phase shift, which the receiver
    'coherent' corrects.

    Parameters
    ----------
    corners : Hz, −3 dB frequencies :math:`f_i` of the sections; one or two
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
    r"""Errors of the quadrature branch: a gain :math:`g` and a phase :math:`\varphi`.

    From :math:`y = i + jq` comes :math:`i + jg(q\cos\varphi - i\sin\varphi)`, that is

    .. math:: \alpha y + \beta \bar y, \qquad \alpha = \tfrac12(1 + g e^{-j\varphi}), \quad
              \beta = \tfrac12(1 - g e^{j\varphi}):

    so a beat at a frequency f has an image at −f (Razavi, RF Microelectronics, 2nd ed., §4.2).

    Parameters
    ----------
    gain : ratio g² of the quadrature branch's power to the in-phase branch's
    phase : rad, φ, by which the branches differ from 90°
    """

    gain: Ratio = 1.0
    phase: Radians = 0.0

    def __post_init__(self) -> None:
        if not (self.gain > 0 and abs(self.phase) < 0.5 * math.pi):
            raise InputError("an I/Q imbalance needs a positive gain and less than 90° of phase")

    @property
    def weights(self) -> tuple[complex, complex]:
        """The factors α of the samples and β of their conjugates."""
        turned = cmath.rect(math.sqrt(self.gain), self.phase)
        return 0.5 * (1.0 + turned.conjugate()), 0.5 * (1.0 - turned)

    def applied(self, samples: ComplexArray) -> ComplexArray:
        """Samples ``(…,)`` with the imbalance."""
        straight, image = self.weights
        return np.asarray(straight * samples + image * np.conj(samples))


@dataclass(frozen=True, slots=True, kw_only=True)
class Offset(Spec):
    """A constant voltage on every sample, from self-mixing and from the amplifiers' offsets.

    Parameters
    ----------
    power : W, squared magnitude of the constant I + jQ at the converter's input
    phase : rad, angle of the constant I + jQ
    """

    power: Watts
    phase: Radians = 0.0

    def __post_init__(self) -> None:
        if not self.power > 0:
            raise InputError("an offset needs a positive power; leave it out if there is none")

    @property
    def voltage(self) -> complex:
        """Complex voltage of the constant, V."""
        return cmath.rect(math.sqrt(self.power), self.phase)


@dataclass(frozen=True, slots=True, kw_only=True)
class GainControl(Spec):
    """An amplifier before the converter, whose gain for a ramp follows from earlier ramps.

    Within its limits, the gain brings the strongest I or Q voltage of the last ``num_ramps`` ramps,
    over all channels, to ``back_off`` below full scale, or to less than one ``step`` below that.
    The gain of the first ramp follows from that ramp itself, as if the radar had been running
    before. Samples are divided by the gain afterwards, so that the gain changes only saturation and
    quantisation.

    Parameters
    ----------
    step : power ratio between adjacent gain settings
    least, greatest : power ratios, limits of the gain
    back_off : ratio of full scale to the strongest power after the amplifier
    num_ramps : number of earlier ramps whose strongest voltage sets the gain
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
            raise InputError("a gain control needs one former ramp or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class Digitiser(Spec):
    r"""Amplifier and quantiser of I and of Q; both branches are alike and do not interact.

    A voltage beyond :math:`\pm V`, with :math:`V^2` = full scale, is clipped. With ``softness`` p
    the amplifier compresses voltages below V also (Rapp 1991):

    .. math:: v \to \frac{v}{(1 + |v/V|^{2p})^{1/2p}}

    The quantiser is mid-tread, with steps of :math:`2V/2^b` and codes from :math:`-2^{b-1}` to
    :math:`2^{b-1}-1`: a full-scale tone has a signal-to-noise ratio of 6.02 b + 1.76 dB, less what
    the missing code at the top costs: 0.2 dB with 12 bits, 0.8 dB with 8, 2.6 dB with 4.

    Parameters
    ----------
    full_scale : W, power of the strongest complex tone that is not clipped
    bits : number of bits of I, and of Q; None: no quantisation
    softness : Rapp's p: 1 is gradual, 10 nearly clips; None: no compression below full scale
    gain_control : control of the amplifier before the quantiser; None: a gain of 1
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
    """Stages from the IF filter to the samples, in this order; none by default.

    A `Radar` has one.

    Parameters
    ----------
    high_pass : high-pass filter behind the IF filter
    imbalance : errors of gain and phase of the branch Q against I
    offset : constant voltage that is added
    digitiser : gain control, saturation and quantisation
    """

    high_pass: HighPass | None = None
    imbalance: IqImbalance | None = None
    offset: Offset | None = None
    digitiser: Digitiser | None = None

    @property
    def distorts(self) -> bool:
        """True if a stage is not linear or adds a constant."""
        return self.offset is not None or self.digitiser is not None
