"""`Leakage` and `Bumper`: signals that a radar receives from itself without any scene."""

import math
from dataclasses import dataclass
from typing import Final

from polychirp.errors import InputError
from polychirp.spec import Spec
from polychirp.units import Metres, Radians, Ratio, Seconds, from_db

LONGEST_LEAKAGE: Final = 1e-6
"""Greatest delay of a leakage, s. Chosen: 300 m of air refuse wrong units, but no radar."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Leakage(Spec):
    r"""The transmitter's signal in the receiver through chip, package and board.

    Its power in every channel is :math:`P_t G_{ft} G_{fr} / I`: the radar's transmit power, times
    its transmit and receive gain, over the isolation I from transmit output to receive input.

    A `Radar` has a tuple of them.

    Parameters
    ----------
    isolation : I, ratio of powers, at least 1 (35 dB is 3162)
    delay : s, of the leakage after the mixer's reference signal; 0.2 ns, chosen, are 6 cm of air
    phase : rad, which is added to the phase that the delay causes
    """

    isolation: Ratio
    delay: Seconds = 0.2e-9
    phase: Radians = 0.0

    def __post_init__(self) -> None:
        if not self.isolation >= 1.0:
            raise InputError(
                "the isolation of a leakage is below 0 dB, which would amplify; write it like "
                "'35 dB', without a minus"
            )
        if self.delay < 0:
            raise InputError("the delay of a leakage is negative; use 0 s or more")
        if self.delay > LONGEST_LEAKAGE:
            raise InputError(
                f"the delay of a leakage is {self.delay:g} s, more than "
                f"{LONGEST_LEAKAGE * 1e6:g} us; write it like '0.2 ns'"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Bumper(Spec):
    """A flat reflecting sheet in front of the antennas, perpendicular to the radar's axis.

    The transmitter's image is on the axis at twice the sheet's distance; each receiving element
    has its own distance from that image.

    A `Radar` has one or none.

    Parameters
    ----------
    distance : m, from the antennas
    reflection : ratio of reflected to incident power; −15 dB is chosen
    phase : rad, of the reflected wave; π is that of a surface with a permittivity above air's
    """

    distance: Metres
    reflection: Ratio = from_db(-15.0)
    phase: Radians = math.pi

    def __post_init__(self) -> None:
        if not self.distance > 0:
            raise InputError("a bumper needs a positive distance from the antennas")
        if not 0 < self.reflection <= 1:
            raise InputError(
                "the reflection of a bumper must be a positive share of the power, at most 0 dB"
            )
