"""Antennas: an element's pattern, and the elements' places in a radar's frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Spec, direction_angles
from polychirp.units import Metres, Radians, Ratio, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementPattern(Spec):
    r"""Power gain of one antenna element over azimuth and elevation.

    .. math:: \frac{G}{G_0} = -\min\left(12 (\phi/\phi_{3dB})^2 + 12 (\theta/\theta_{3dB})^2,
              A_{max}\right)\ \text{dB}

    the Gaussian main lobe with a floor that 3GPP TR 38.901 table 7.3-1 uses; the beamwidths are
    full 3-dB widths. The default is the ±80° × ±10° beam of the paper with its 27 dBi of table 2,
    which contradict each other (a beam that wide has about 11 dBi: errata 9 of the docs).

    Parameters
    ----------
    peak_gain : ratio over isotropic
    azimuth_beamwidth, elevation_beamwidth : rad; ``inf`` for no dependence
    floor : ratio to the peak, below which the pattern does not fall
    polarisation : which of the two linear polarisations the element couples to
    """

    peak_gain: Ratio = from_db(27.0)
    azimuth_beamwidth: Radians = math.radians(160.0)
    elevation_beamwidth: Radians = math.radians(20.0)
    floor: Ratio = from_db(-30.0)
    polarisation: Literal["vertical", "horizontal"] = "vertical"

    def __post_init__(self) -> None:
        if not (self.azimuth_beamwidth > 0 and self.elevation_beamwidth > 0):
            raise InputError("an antenna's beamwidths must be positive")
        if not (self.peak_gain > 0 and 0 < self.floor <= 1):
            raise InputError("an antenna needs a positive gain, and a floor of at most 0 dB")

    def gain(self, direction: FloatArray) -> FloatArray:
        """Power gain ``(…,)`` towards directions ``(…, xyz)`` in the radar's frame."""
        azimuth, elevation = direction_angles(direction)
        loss = 12.0 * (
            (azimuth / self.azimuth_beamwidth) ** 2 + (elevation / self.elevation_beamwidth) ** 2
        )
        return self.peak_gain * np.maximum(10.0 ** (-loss / 10.0), self.floor)

    @property
    def jones(self) -> FloatArray:
        """Unit polarisation in the (V, H) basis of `frames.polarisation_basis`: ``(2,)``."""
        return np.array([1.0, 0.0] if self.polarisation == "vertical" else [0.0, 1.0])


ISOTROPIC = ElementPattern(
    peak_gain=1.0, azimuth_beamwidth=math.inf, elevation_beamwidth=math.inf, floor=1.0
)
"""An antenna with gain 1 everywhere, vertically polarised."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AntennaArray(Spec):
    """A uniform linear array of receiving elements along y, and one transmitting element.

    The phase centre of the receiving array and the transmitting element are at the origin of
    the radar's frame; channel 0 is the rightmost element (most negative y). Spacing defaults to
    half a wavelength at 79 GHz.
    """

    num_channels: int = 4
    spacing: Metres = 0.5 * SPEED_OF_LIGHT / 79e9
    pattern: ElementPattern = field(default_factory=ElementPattern)

    def __post_init__(self) -> None:
        if self.num_channels < 1:
            raise InputError("an array needs at least one channel")
        if not self.spacing > 0:
            raise InputError("an array's spacing must be positive")

    @property
    def position(self) -> FloatArray:
        """m, ``(channel, xyz)`` in the radar's frame."""
        y = (np.arange(self.num_channels) - 0.5 * (self.num_channels - 1)) * self.spacing
        return np.stack([np.zeros_like(y), y, np.zeros_like(y)], axis=-1)
