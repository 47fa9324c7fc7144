"""`Radar`: front end, antenna, filter, converter and mounting pose of one radar."""

from dataclasses import dataclass, field
from typing import Literal

from polychirp.errors import InputError
from polychirp.field_types import need_field_types
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray
from polychirp.model.front_end import FrontEnd
from polychirp.model.if_filter import IfFilter
from polychirp.model.leakage import Bumper, Leakage
from polychirp.model.oscillator import Oscillator
from polychirp.spec import Spec
from polychirp.units import Ratio, SamplesPerSecond, Seconds, Watts, from_db, need_numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Converter(Spec):
    r"""Sample rate of the dechirped signal, its window on a ramp, and the branches that it takes.

    On every ramp the first sample is taken ``start`` after the ramp's start, the last one no
    later than ``margin`` before its end. The defaults are chosen so that the IF filter
    settles and echoes from 30 m arrive before the window starts, as in real radars.

    A converter takes both branches I and Q (``sampling`` = "complex"), or I alone ("real"). A real
    mixer's output is the in-phase branch :math:`\mathrm{Re}\,y` of the complex beat y, so that
    beats at −f fold on f: the noise of both sides adds up (3 dB), and so does interference on
    either side of the victim's slope. The samples of a frame are then
    :math:`2\,\mathrm{Re}\,y = y + \bar y`, in which the tone at an echo's beat has the echo's
    amplitude. Beats above half the sample rate fold back into the band of the echoes, whereas
    complex samples have them at negative frequencies.

    A `Radar` has one.
    """

    sample_rate: SamplesPerSecond = 1e6
    start: Seconds = 10e-6
    margin: Seconds = 10e-6
    sampling: Literal["complex", "real"] = "complex"

    def __post_init__(self) -> None:
        need_numbers(self, "a converter")
        if not self.sample_rate > 0:
            raise InputError("a converter's sample rate must be positive")
        if self.start < 0 or self.margin < 0:
            raise InputError("a converter's start and margin cannot be negative")
        if self.sampling not in ("complex", "real"):
            raise InputError(f"a converter's sampling '{self.sampling}' is not complex or real")

    @property
    def is_real(self) -> bool:
        """True if the branch I alone is sampled."""
        return self.sampling == "real"


@dataclass(frozen=True, kw_only=True)
class Radar(Spec):
    """One radar without its waveform.

    Gains are power ratios. The defaults follow the paper's table 2 as printed: its 36 dB of
    transmit gain and 42 dB of receive gain each include an antenna of 27 dBi, so that 9 dB and
    15 dB remain for the front end. The paper gives no
    noise figure; 4.5 dB is an assumption.

    `StudyRadar` adds the waveform, the vehicle and the clock.

    Parameters
    ----------
    name : unique among the radars of a scene
    mount : pose in the frame of the vehicle that carries it (x forward, y left, z up)
    transmit_power : W, into the front end's transmit amplifier; 0 for a radar that only receives
    transmit_gain, receive_gain : ratio, gain of the front end without the antenna
    noise_figure : ratio, 1 or more
    oscillator : phase noise and ramp errors of the signal that is transmitted and drives the mixer
    front_end : stages after the IF filter; by default there are none
    leakage : couplings from transmitter to receiver inside the radar
    bumper : sheet in front of the antennas, which reflects to the receiver; None if there is none
    """

    name: str
    mount: Pose = field(default_factory=Pose)
    array: AntennaArray = field(default_factory=AntennaArray)
    transmit_power: Watts = from_db(10.0 - 30.0)
    transmit_gain: Ratio = from_db(9.0)
    receive_gain: Ratio = from_db(15.0)
    noise_figure: Ratio = from_db(4.5)
    if_filter: IfFilter = field(default_factory=IfFilter)
    converter: Converter = field(default_factory=Converter)
    oscillator: Oscillator = field(default_factory=Oscillator)
    front_end: FrontEnd = field(default_factory=FrontEnd)
    leakage: tuple[Leakage, ...] = ()
    bumper: Bumper | None = None

    def __post_init__(self) -> None:
        need_numbers(self, f"radar '{self.name}'")
        need_field_types(self)
        if not (self.transmit_power >= 0 and self.transmit_gain > 0 and self.receive_gain > 0):
            raise InputError(
                f"radar '{self.name}' needs a transmit power of 0 W or more and positive gains"
            )
        if not self.noise_figure >= 1.0:
            raise InputError(f"radar '{self.name}' has a noise figure below 0 dB; use 0 dB or more")
        if self.converter.is_real and self.front_end.imbalance is not None:
            raise InputError(
                f"radar '{self.name}' samples the branch I alone, which has no I/Q imbalance; "
                "leave the imbalance out or set converter.sampling to 'complex'"
            )

    @property
    def receives_itself(self) -> bool:
        """True if leakage or a bumper returns the radar's own signal even in an empty scene."""
        return bool(self.leakage) or self.bumper is not None
