"""Spectra and maps of a frame, with their axes.

`RangeProfiles`, `RangeRateSpectra` and `RangeRateMap` are what a receiver detects in; `RangePower`,
`RangeAzimuthMap` and `Spectrogram` are for figures.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, FloatArray, SingleComplexArray, seal
from polychirp.errors import InputError

PerRange = Annotated[FloatArray, Axes("range")]
PerRangeRate = Annotated[FloatArray, Axes("range_rate")]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangeProfiles:
    """Spectra of single ramps over range, in which an echo's peak has the echo's amplitude in V.

    Parameters
    ----------
    amplitude : V, ``(channel, ramp, range)``
    range : m, ``(range,)``, strictly increasing
    """

    amplitude: Annotated[SingleComplexArray, Axes("channel", "ramp", "range", dtype=np.complex64)]
    range: PerRange

    def __post_init__(self) -> None:
        seal(self)
        _check_growing("RangeProfiles.range", self.range)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangeRateSpectra:
    """Spectra of a whole frame over range rate and range, one for every channel.

    They are transforms over equal chirps, and periodic in the range rate.

    Parameters
    ----------
    amplitude : V, ``(channel, range_rate, range)``
    range_rate : m/s, positive = away, ``(range_rate,)``, growing
    range : m, ``(range,)``, growing
    """

    amplitude: Annotated[
        SingleComplexArray, Axes("channel", "range_rate", "range", dtype=np.complex64)
    ]
    range_rate: PerRangeRate
    range: PerRange

    def __post_init__(self) -> None:
        seal(self)
        _check_growing("RangeRateSpectra.range", self.range)
        _check_growing("RangeRateSpectra.range_rate", self.range_rate)

    @property
    def mean_power(self) -> "RangeRateMap":
        """Mean over channels of the power of each cell; phases between channels have no effect."""
        power = np.zeros(self.amplitude.shape[1:])
        for one in self.amplitude:
            power += one.real**2 + one.imag**2
        return RangeRateMap(
            power=power / len(self.amplitude),
            range_rate=self.range_rate,
            range=self.range,
            is_periodic=True,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangeRateMap:
    """Power over range rate and range.

    Parameters
    ----------
    power : W at the analogue-to-digital converter, ``(range_rate, range)``
    range_rate : m/s, positive = away, ``(range_rate,)``, growing
    range : m, ``(range,)``, growing
    is_periodic : True if echoes whose range rates are beyond the map appear within it, whole spans
        of it away, as over equal chirps; False if they are not in it
    """

    power: Annotated[FloatArray, Axes("range_rate", "range")]
    range_rate: PerRangeRate
    range: PerRange
    is_periodic: bool = False

    def __post_init__(self) -> None:
        seal(self)
        _check_growing("RangeRateMap.range", self.range)
        _check_growing("RangeRateMap.range_rate", self.range_rate)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangePower:
    """Power over range.

    Parameters
    ----------
    power : W at the analogue-to-digital converter, ``(range,)``
    range : m, ``(range,)``, growing
    """

    power: PerRange
    range: PerRange

    def __post_init__(self) -> None:
        seal(self)
        _check_growing("RangePower.range", self.range)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangeAzimuthMap:
    """Power over range and azimuth, of elements at several heights the greatest over elevations.

    Parameters
    ----------
    power : W at the analogue-to-digital converter, ``(beam, range)``
    sine : direction cosine of each beam to the left, ``(beam,)``, growing: the sine of the azimuth
        times the cosine of the elevation
    range : m, ``(range,)``, growing
    """

    power: Annotated[FloatArray, Axes("beam", "range")]
    sine: Annotated[FloatArray, Axes("beam")]
    range: PerRange

    def __post_init__(self) -> None:
        seal(self)
        _check_growing("RangeAzimuthMap.range", self.range)
        _check_growing("RangeAzimuthMap.sine", self.sine)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spectrogram:
    """Power over time and beat, ramp by ramp.

    Parameters
    ----------
    power : W at the analogue-to-digital converter, ``(ramp, window, beat)``
    share : middle of each window as a share of its ramp's samples, 0 … 1, ``(window,)``
    beat : Hz, ``(beat,)``, growing
    """

    power: Annotated[FloatArray, Axes("ramp", "window", "beat")]
    share: Annotated[FloatArray, Axes("window")]
    beat: Annotated[FloatArray, Axes("beat")]

    def __post_init__(self) -> None:
        seal(self)
        _check_growing("Spectrogram.share", self.share)
        _check_growing("Spectrogram.beat", self.beat)


def _check_growing(name: str, values: FloatArray) -> None:
    if values.size == 0 or not np.all(np.diff(values) > 0):
        raise InputError(f"{name} must grow from entry to entry and have at least one")
