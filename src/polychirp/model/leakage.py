"""`Leakage` and `Bumper`: signals that a radar receives from itself without any scene."""

import math
from dataclasses import dataclass

from polychirp.errors import InputError
from polychirp.spec import Spec
from polychirp.units import Metres, Radians, Ratio, Seconds, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class Leakage(Spec):
    r"""The transmitter's signal in the receiver through chip, package and board.

    Every channel receives :math:`P_t G_{ft} G_{fr} / I`, with isolation I between the transmit
    amplifier's output and the receive amplifier's input.

    Parameters
    ----------
    isolation : ratio
    delay : s, against the mixer's own reference
    phase : rad, by which it leads the phase of the delay alone
    """

    isolation: Ratio
    delay: Seconds = 0.2e-9
    phase: Radians = 0.0

    def __post_init__(self) -> None:
        if not self.isolation > 0:
            raise InputError("a leakage needs an isolation; write it like '35 dB'")
        if self.delay < 0:
            raise InputError("a leakage cannot arrive before it is sent; give it a delay of 0 s")


@dataclass(frozen=True, slots=True, kw_only=True)
class Bumper(Spec):
    """A flat sheet before the antennas, perpendicular to the radar's axis, that reflects.

    The image of the transmitting element is at twice the sheet's distance; each receiving element
    has its own distance to that image.

    Parameters
    ----------
    distance : m, from the antennas
    reflection : ratio of reflected to incident power
    phase : rad, of the reflection; 180° for a sheet denser than air
    """

    distance: Metres
    reflection: Ratio = from_db(-15.0)
    phase: Radians = math.pi

    def __post_init__(self) -> None:
        if not self.distance > 0:
            raise InputError("a bumper needs a positive distance from the antennas")
        if not 0 < self.reflection <= 1:
            raise InputError("a bumper reflects some power, and no more than 0 dB of it")
