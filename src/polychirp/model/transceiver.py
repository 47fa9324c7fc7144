r"""`Transceiver`, a software-defined radio with its errors, and the `Link` between two of them.

Three defaults are those that the paper prints: a sample rate of 130 MS/s, a bandwidth of 120 MHz
(the filter passes ±60 MHz) and carriers of 0.2 to 4.4 GHz. All other defaults are assumptions.
"""

from dataclasses import dataclass, field
from typing import Final, Self

from polychirp.constants import BOLTZMANN, REFERENCE_TEMPERATURE
from polychirp.errors import InputError, PhysicsError
from polychirp.model.front_end import Digitiser, GainControl, IqImbalance
from polychirp.model.if_filter import IfFilter
from polychirp.model.oscillator import PhaseNoise
from polychirp.spec import Spec
from polychirp.units import Fraction, Hertz, Ratio, SamplesPerSecond, Seconds, Watts, from_db

TYPICAL_NOISE: Final = PhaseNoise(
    offset=(1e4, 1e5, 1e6, 1e7),
    level=(from_db(-90.0), from_db(-100.0), from_db(-120.0), from_db(-140.0)),
)
"""Phase noise of a radio's carrier; offsets in Hz, levels per Hz relative to the carrier. Assumed:
−100 dBc/Hz at 100 kHz, and a fall by 20 dB per decade from there on."""

TYPICAL_CONVERTER: Final = Digitiser(
    full_scale=1e-3,
    bits=14,
    gain_control=GainControl(least=from_db(-100.0), greatest=from_db(150.0), back_off=from_db(3.0)),
)
"""Analogue-to-digital converter of a receiver. Assumed: 14 bits, and a gain control of 2 dB steps
that brings the strongest I or Q voltage to 3 to 5 dB below full scale."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Transceiver(Spec):
    r"""One radio. A parameter of None, or a clock offset of zero, switches that effect off.

    Transmitter: samples of magnitude 1 at most → quantisation → hold of each sample → `filter` →
    I/Q imbalance → carrier with phase noise → ``transmit_power``. Receiver: thermal noise →
    carrier with phase noise → I/Q imbalance → `filter` → sampling by a clock with an offset →
    ``converter``. All of a radio's frequencies come from one reference: the carrier of a radio
    whose clock is fast by δ is δ·f_c too high.

    Parameters
    ----------
    sample_rate : 1/s, of the transmitter's and of the receiver's converter
    lowest_carrier, highest_carrier : Hz, limits of the tuning range
    transmit_power : W, sent power when the samples have the magnitude 1
    transmit_bits : bits of I, and of Q, in the transmitter; None: no quantisation
    hold : time for which a sample is held, as a share of the sample interval; None: ideal
        reconstruction, without sin(x)/x and images
    filter : low-pass between converter and mixer of the transmitter, and of the receiver; None:
        ideal, with half the sample rate as its edge
    noise_figure : of the receiver; None: no thermal noise
    phase_noise : of the carrier; None: no phase noise
    imbalance : I/Q imbalance of the transmitter's and of the receiver's mixer
    converter : of the receiver; None: no quantisation and no saturation
    clock_offset : relative error δ of the reference frequency

    Examples
    --------
    >>> ideal = Transceiver.ideal()
    >>> ideal.noise_power, round(10 * __import__("math").log10(Transceiver().noise_power * 1e3), 1)
    (0.0, -85.0)
    """

    sample_rate: SamplesPerSecond = 130e6
    lowest_carrier: Hertz = 0.2e9
    highest_carrier: Hertz = 4.4e9
    transmit_power: Watts = 1e-3
    transmit_bits: int | None = 16
    hold: float | None = 1.0
    filter: IfFilter | None = field(
        default_factory=lambda: IfFilter(passband=60e6, stopband=70e6, attenuation=from_db(60.0))
    )
    noise_figure: Ratio | None = from_db(8.0)
    phase_noise: PhaseNoise | None = TYPICAL_NOISE
    imbalance: IqImbalance | None = field(
        default_factory=lambda: IqImbalance(gain=from_db(0.1), phase=0.01)
    )
    converter: Digitiser | None = TYPICAL_CONVERTER
    clock_offset: Fraction = 0.0

    def __post_init__(self) -> None:
        if not self.sample_rate > 0 or not self.transmit_power > 0:
            raise InputError("a transceiver needs a positive sample rate and transmit power")
        if not 0 < self.lowest_carrier < self.highest_carrier:
            raise InputError("a transceiver's carriers must be positive, the lowest one first")
        if self.transmit_bits is not None and not 2 <= self.transmit_bits <= 32:
            raise InputError(
                f"a transceiver cannot have {self.transmit_bits} bits; give it 2 to 32"
            )
        if self.hold is not None and not 0 < self.hold <= 1:
            raise InputError(
                "a transceiver's hold is the share of the sample interval for which a sample is "
                "held; use more than 0 and at most 1"
            )
        if self.noise_figure is not None and not self.noise_figure >= 1:
            raise InputError("a transceiver's noise figure cannot be below 0 dB")
        if not abs(self.clock_offset) < 0.01:
            raise InputError("a transceiver's clock offset must be between −10 000 and 10 000 ppm")

    @classmethod
    def ideal(cls) -> Self:
        """The same converters and carriers with every effect off."""
        return cls(
            transmit_bits=None,
            hold=None,
            filter=None,
            noise_figure=None,
            phase_noise=None,
            imbalance=None,
            converter=None,
        )

    @property
    def noise_bandwidth(self) -> float:
        """Equivalent noise bandwidth at the receiver's converter, Hz."""
        return self.sample_rate if self.filter is None else self.filter.noise_bandwidth

    @property
    def noise_power(self) -> float:
        """Thermal noise k T₀ F B, referred to the receiver's input, W; B is `noise_bandwidth`."""
        if self.noise_figure is None:
            return 0.0
        return BOLTZMANN * REFERENCE_TEMPERATURE * self.noise_figure * self.noise_bandwidth

    def check_carrier(self, frequency: float) -> None:
        """Refuse a carrier that cannot be tuned; raises `PhysicsError`."""
        if not self.lowest_carrier <= frequency <= self.highest_carrier:
            raise PhysicsError(
                f"a carrier of {frequency / 1e9:g} GHz is outside the transceiver's "
                f"{self.lowest_carrier / 1e9:g} to {self.highest_carrier / 1e9:g} GHz; "
                "choose one inside, or another radio"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Link(Spec):
    """A cable or one free path between two radios.

    Parameters
    ----------
    attenuation : ratio of sent to received power
    delay : s, from the transmitter's output to the receiver's input
    """

    attenuation: Ratio = from_db(30.0)
    delay: Seconds = 0.0

    def __post_init__(self) -> None:
        if not self.attenuation > 0 or not self.delay >= 0:
            raise InputError("a link needs a positive attenuation and a delay of 0 s or more")
