"""Antennas: an element's pattern, and the elements' positions in a radar's frame."""

import math
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import direction_angles
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Between, Metres, Radians, Ratio, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementPattern(Spec):
    r"""Power gain of one antenna element over azimuth and elevation.

    .. math:: \frac{G}{G_0} = -\min\left(12 (\phi/\phi_{3dB})^2 + 12 (\theta/\theta_{3dB})^2,
              A_{max}\right)\ \text{dB}

    is the Gaussian main lobe with a floor of 3GPP TR 38.901, table 7.3-1. φ is the azimuth, θ the
    elevation, the 3-dB beamwidths are full widths, and the floor is :math:`-A_{max}`. The defaults
    are the paper's beam of ±80° × ±10° and the 27 dBi of its table 2. The two contradict each
    other, since a beam that wide has about 11 dBi (errata 9 of the docs).

    Each element of an `AntennaArray` has it.

    Parameters
    ----------
    peak_gain : ratio over isotropic
    azimuth_beamwidth, elevation_beamwidth : rad; with ``inf`` the gain does not depend on the angle
    floor : least gain, as a ratio to the peak gain
    polarisation : linear polarisation of the element
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
"""Antenna element with the gain 1 in all directions, vertically polarised."""


_Multiple = Annotated[float, Between(least=-1e6, greatest=1e6)]
Place = tuple[_Multiple, _Multiple]
"""Place of an element to the left and up, in multiples of its array's spacing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AntennaArray(Spec):
    r"""Receiving and transmitting elements in the plane across the radar's axis.

    By default each form a horizontal line along y, evenly spaced; channel 0 and transmitting
    element 0 are the rightmost ones (most negative y). ``channel_positions`` and
    ``transmitter_positions`` place the elements anywhere in the plane instead, so that the array
    measures elevations too. Both sets are centred on the origin of the radar's frame.

    Real channels differ in gain g and phase ψ. Each channel multiplies the wave that it receives,
    and each transmitting element the wave that it sends, by its own :math:`\sqrt{g}\,e^{j\psi}`. A
    channel's error arises behind its low-noise amplifier, so that it scales the channel's noise as
    well. The simulated receivers do not correct these errors.

    Parameters
    ----------
    num_channels : number of receiving elements
    spacing : m, of the receiving elements, and unit of the positions below; by default half a
        wavelength at 79 GHz
    pattern : pattern of every element, receiving and transmitting
    num_transmitters : number of transmitting elements
    transmit_spacing : m, of the transmitting elements; by default ``num_channels * spacing``, so
        that the virtual elements form one evenly spaced line without a gap
    channel_positions : place (to the left, up) of each receiving element in multiples of
        ``spacing``, from any origin, since only differences count; empty for the line
    transmitter_positions : the same of each transmitting element
    channel_gains : g, ratio of powers, one for each channel; empty if there are no errors
    channel_phases : ψ, rad, one for each channel
    transmitter_gains : g, ratio of powers, one for each transmitting element
    transmitter_phases : ψ, rad, one for each transmitting element

    Examples
    --------
    >>> array = AntennaArray(num_channels=2, num_transmitters=2, spacing=2e-3)
    >>> array.position[:, 1] * 1e3, array.transmit_position[:, 1] * 1e3
    (array([-1.,  1.]), array([-2.,  2.]))

    Three transmitting elements, the middle one raised, as on TI's IWR6843L board (SWRU585):

    >>> array = AntennaArray(num_transmitters=3, transmitter_positions=((0, 0), (2, 1), (4, 0)))
    >>> (array.transmit_position[:, 1:] / array.spacing).round(2).tolist()
    [[-2.0, -0.33], [0.0, 0.67], [2.0, -0.33]]
    """

    num_channels: Annotated[int, Between(greatest=1024)] = 4
    spacing: Metres = 0.5 * SPEED_OF_LIGHT / 79e9
    pattern: ElementPattern = field(default_factory=ElementPattern)
    num_transmitters: Annotated[int, Between(greatest=1024)] = 1
    transmit_spacing: Metres | None = None
    channel_positions: tuple[Place, ...] = ()
    transmitter_positions: tuple[Place, ...] = ()
    channel_gains: tuple[Ratio, ...] = ()
    channel_phases: tuple[Radians, ...] = ()
    transmitter_gains: tuple[Ratio, ...] = ()
    transmitter_phases: tuple[Radians, ...] = ()

    def __post_init__(self) -> None:
        if self.num_channels < 1:
            raise InputError("an array needs at least one channel")
        if self.num_transmitters < 1:
            raise InputError("an array needs at least one transmitting element")
        if not self.spacing > 0:
            raise InputError("an array's spacing must be positive")
        if self.transmit_spacing is not None and not self.transmit_spacing > 0:
            raise InputError("the spacing of an array's transmitting elements must be positive")
        for what, count in (
            ("channel", self.num_channels),
            ("transmitter", self.num_transmitters),
        ):
            self._check_positions(what, count)
            self._check_errors(what, count)

    def _check_positions(self, what: str, count: int) -> None:
        name = f"{what}_positions"
        given = getattr(self, name)
        if any(len(place) != 2 for place in given):
            raise InputError(f"{name}: every position is a pair, as in [2, 1] for 2 left and 1 up")
        places = tuple((float(left), float(up)) for left, up in given)
        object.__setattr__(self, name, places)
        if len(places) not in (0, count):
            raise InputError(
                f"{name}: an array of {count} {what}s needs {count} positions or none, not "
                f"{len(places)}"
            )
        if len(set(places)) < len(places):
            twice = next(place for place in places if places.count(place) > 1)
            raise InputError(
                f"{name}: two elements are at {list(twice)}; give each its own position"
            )
        if places and what == "transmitter" and self.transmit_spacing is not None:
            raise InputError(
                "transmit_spacing: has no effect beside transmitter_positions; leave one of them "
                "out"
            )

    def _check_errors(self, what: str, count: int) -> None:
        for name in (f"{what}_gains", f"{what}_phases"):
            values = tuple(float(value) for value in getattr(self, name))
            object.__setattr__(self, name, values)
            if len(values) not in (0, count):
                raise InputError(
                    f"{name}: an array of {count} {what}s needs {count} values or none, not "
                    f"{len(values)}"
                )
        if not all(gain > 0 for gain in getattr(self, f"{what}_gains")):
            raise InputError(f"{what}_gains: every gain must be positive")

    @property
    def position(self) -> FloatArray:
        """m, ``(channel, xyz)`` of the receiving elements in the radar's frame."""
        if self.channel_positions:
            return _in_plane(self.channel_positions, self.spacing)
        return _line(self.num_channels, self.spacing)

    @property
    def transmit_position(self) -> FloatArray:
        """m, ``(element, xyz)`` of the transmitting elements in the radar's frame."""
        if self.transmitter_positions:
            return _in_plane(self.transmitter_positions, self.spacing)
        whole = self.num_channels * self.spacing
        return _line(self.num_transmitters, self.transmit_spacing or whole)

    @property
    def channel_response(self) -> ComplexArray:
        """Complex factor √g e^{jψ} of the wave that each channel receives, ``(channel,)``."""
        return _response(self.num_channels, self.channel_gains, self.channel_phases)

    @property
    def transmitter_response(self) -> ComplexArray:
        """Complex factor √g e^{jψ} of the wave that each element sends, ``(element,)``."""
        return _response(self.num_transmitters, self.transmitter_gains, self.transmitter_phases)


def _line(count: int, spacing: float) -> FloatArray:
    y = (np.arange(count) - 0.5 * (count - 1)) * spacing
    return np.stack([np.zeros_like(y), y, np.zeros_like(y)], axis=-1)


def _in_plane(places: tuple[Place, ...], unit: float) -> FloatArray:
    across = unit * np.array(places)
    return np.insert(across - across.mean(axis=0), 0, 0.0, axis=1)


def _response(count: int, gains: tuple[float, ...], phases: tuple[float, ...]) -> ComplexArray:
    amplitude = np.sqrt(gains or np.ones(count))
    return np.asarray(amplitude * np.exp(1j * np.asarray(phases or np.zeros(count))))


@dataclass(frozen=True, slots=True, kw_only=True)
class ArrayErrors(Spec):
    """Random errors of gain and phase of an array's channels and transmitting elements.

    All errors are independent. Phases are Gaussian, and so are the logarithms of the gains.

    Parameters
    ----------
    gain : rms deviation of a power gain as a ratio (``from_db(1)`` for 1 dB); 1 for no errors
    phase : rms deviation of a phase, rad

    Examples
    --------
    >>> real = ArrayErrors(phase=0.1).draw_array(AntennaArray(), streams=Streams(seed=1))
    >>> len(real.channel_phases), real.channel_gains[0]
    (4, 1.0)
    """

    gain: Ratio = 1.0
    phase: Radians = 0.0

    def __post_init__(self) -> None:
        if not (self.gain >= 1.0 and self.phase >= 0.0):
            raise InputError("the spread of an array's errors must be at least 0 dB and 0 degrees")

    def draw_array(self, array: AntennaArray, *, streams: Streams) -> AntennaArray:
        """The array with random errors, which replace any errors that it had.

        Each of the four tuples of errors has a random stream of its own, such as
        ``streams["array", "channel_gains"]``, so that an additional channel does not change the
        errors of the others.
        """

        def deviation(name: str, count: int) -> FloatArray:
            return streams["array", name].standard_normal(count)

        channels, elements = array.num_channels, array.num_transmitters
        level, phase = math.log(self.gain), self.phase
        return replace(
            array,
            channel_gains=tuple(np.exp(level * deviation("channel_gains", channels))),
            channel_phases=tuple(phase * deviation("channel_phases", channels)),
            transmitter_gains=tuple(np.exp(level * deviation("transmitter_gains", elements))),
            transmitter_phases=tuple(phase * deviation("transmitter_phases", elements)),
        )
