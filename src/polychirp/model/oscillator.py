r"""`Oscillator`: errors of a radar's signal source, phase noise and nonlinear ramps.

Both are an error θ(t) of the transmitted phase, in cycles: with the phase φ(t) of the ideal
ramps, the radar sends :math:`e^{j2\pi(\varphi(t) + \theta(t))}`.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.spec import ByKind, Spec
from polychirp.units import Hertz, PerHertz, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseNoise(Spec):
    r"""Phase noise by its spectrum, as in data sheets.

    .. math:: L(f) = \tfrac12 S_\varphi(f)

    (IEEE Std 1139), with the one-sided spectrum :math:`S_\varphi` of the phase in rad²/Hz: L is
    the spectrum on **each** side of the carrier, and the phase's variance is :math:`2\int L\,df`.
    Between entries, log L is linear in log f. Below the first offset L is zero; above the last
    offset L keeps its last value.

    The default is an assumption, not a data sheet's table: L is −93 dBc/Hz at 1 MHz, of the order
    of 77–81-GHz CMOS transceivers. Around it L has the usual shape of a synthesiser: 5 to 8 dB per
    decade inside the loop's bandwidth, 20 dB per decade from 1 MHz on, and a floor above 300 MHz.

    Parameters
    ----------
    offset : Hz, offsets from the carrier, rising
    level : L at these offsets, 1/Hz: ratio of the power in 1 Hz to the carrier's (not in dB)

    Raises
    ------
    InputError
        The lists differ in length, an offset is not positive and larger than the one before, or a
        level is not positive.

    Examples
    --------
    >>> from polychirp.units import to_db
    >>> noise = PhaseNoise(offset=(1e5, 1e6), level=(from_db(-80.0), from_db(-100.0)))
    >>> to_db(noise.density(np.array([1e4, 1e5, 10**5.5, 1e9])))
    array([-400.,  -80.,  -90., -100.])
    """

    offset: tuple[Hertz, ...] = (1e4, 1e5, 1e6, 1e7, 1e8, 3e8)
    level: tuple[PerHertz, ...] = (
        from_db(-80.0),
        from_db(-85.0),
        from_db(-93.0),
        from_db(-113.0),
        from_db(-133.0),
        from_db(-142.0),
    )

    def __post_init__(self) -> None:
        if not self.offset or len(self.offset) != len(self.level):
            raise InputError(
                f"phase noise has {len(self.offset)} offsets and {len(self.level)} levels; "
                "give one level or more, each with its offset"
            )
        if not (self.offset[0] > 0 and np.all(np.diff(self.offset) > 0)):
            raise InputError(
                "the offsets of phase noise must be positive and grow from entry to entry"
            )
        if not min(self.level) > 0:
            raise InputError("a level of phase noise must be above zero; leave zero noise out")
        if max(self.level) > 1.0:
            raise InputError(
                f"a level of phase noise is {10 * np.log10(max(self.level)):.3g} dBc/Hz; levels "
                "are at most 0, as in '-93 dBc/Hz'"
            )

    def density(self, frequency: FloatArray) -> FloatArray:
        """L, rad²/Hz on each side of the carrier, at offsets ``(…,)`` in Hz of either sign."""
        f = np.abs(np.asarray(frequency, dtype=np.float64))
        known = np.log(np.maximum(f, self.offset[0]))
        level = np.exp(np.interp(known, np.log(self.offset), np.log(self.level)))
        return np.asarray(np.where(f >= self.offset[0], level, 0.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class SinusoidalError(Spec):
    r"""A sinusoidal error of a ramp's frequency, equal on all ramps.

    .. math:: \epsilon(x) = \hat\epsilon \sin 2\pi n x, \qquad x = (t - t_k)/T_k

    Ramp k starts at :math:`t_k` and lasts :math:`T_k`. The beat of an echo of delay τ contains the
    difference of :math:`\epsilon` at two times τ apart. The beat's phase is modulated by
    :math:`m = 2\hat\epsilon\sin(\pi n\tau/T)\,T/n \approx 2\pi\hat\epsilon\tau` rad, so that it
    has paired echoes at ±n/T from the beat, with :math:`J_1(m)/J_0(m) \approx \pi\hat\epsilon\tau`
    of the beat's amplitude.

    Parameters
    ----------
    peak : ε̂, Hz
    cycles : n, periods per ramp; if n is whole, the error is zero at both ends of a ramp
    """

    kind: Literal["sinusoidal"] = "sinusoidal"
    peak: Hertz
    cycles: float = 1.0

    def __post_init__(self) -> None:
        if not self.cycles > 0:
            raise InputError("a sinusoidal ramp error needs a positive number of cycles")

    def phase(self, fraction: FloatArray) -> FloatArray:
        """∫ε dx from the ramp's start to fractions ``(…,)`` of it, Hz; times T_k it is θ."""
        turn = 2.0 * np.pi * self.cycles
        # 2 sin²(a/2) = 1 − cos a, without loss of digits at small a
        return np.asarray(2.0 * self.peak / turn * np.sin(0.5 * turn * fraction) ** 2)

    def bandwidth(self, duration: float) -> float:
        """By how much the error widens a ramp's spectrum on each side, Hz (Carson's rule)."""
        return abs(self.peak) + self.cycles / duration


@dataclass(frozen=True, slots=True, kw_only=True)
class QuadraticError(Spec):
    r"""A quadratic error of a ramp's frequency, equal on all ramps.

    .. math:: \epsilon(x) = 4\hat\epsilon\, x (1 - x), \qquad x = (t - t_k)/T_k

    Ramp k starts at :math:`t_k` and lasts :math:`T_k`; ε is zero at both of its ends. The error of
    the beat of an echo of delay τ is
    :math:`\dot\epsilon\tau = 4\hat\epsilon(1 - 2x)\tau/T`, so that the beat is spread over
    :math:`8\hat\epsilon\tau/T`.

    Parameters
    ----------
    peak : ε̂, Hz, the error in the middle of the ramp
    """

    kind: Literal["quadratic"] = "quadratic"
    peak: Hertz

    def phase(self, fraction: FloatArray) -> FloatArray:
        """∫ε dx from the ramp's start to fractions ``(…,)`` of it, Hz; times T_k it is θ."""
        x = np.asarray(fraction, dtype=np.float64)
        return np.asarray(self.peak * x**2 * (2.0 - x * (4.0 / 3.0)))

    def bandwidth(self, duration: float) -> float:
        """By how much the error widens a ramp's spectrum on each side, Hz (Carson, n = 1)."""
        return abs(self.peak) + 1.0 / duration


AnyRampError = Annotated[SinusoidalError | QuadraticError, ByKind(method="phase")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Oscillator(Spec):
    """Phase errors of one radar's signal source; none by default.

    Parameters
    ----------
    phase_noise : spectrum of the random phase error; None: no phase noise
    ramp_error : frequency error, the same on every ramp; None: ramps are linear

    Examples
    --------
    >>> Oscillator().is_ideal, Oscillator(phase_noise=PhaseNoise()).is_ideal
    (True, False)
    """

    phase_noise: PhaseNoise | None = None
    ramp_error: AnyRampError | None = None

    @property
    def is_ideal(self) -> bool:
        """True without any phase error."""
        return self.phase_noise is None and self.ramp_error is None
