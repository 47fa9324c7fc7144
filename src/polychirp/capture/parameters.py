"""`CaptureParameters`: ramps, converter, antennas and file layout of a recording."""

import math
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.antenna import ISOTROPIC, AntennaArray, Place
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, HertzPerSecond, Metres, SamplesPerSecond, Seconds, Unit

AxisName = Literal["frame", "sweep", "transmitter", "receiver", "channel", "ramp", "fast"]
Sampling = Literal["complex", "real"]
Storage = Literal["signed", "unsigned"]
Side = Literal["right", "left"]
Device = Literal["xwr14xx", "xwr16xx", "xwr18xx", "xwr68xx"]

COMBINED_AXES: Final = {"ramp": ("sweep", "transmitter"), "channel": ("transmitter", "receiver")}
"""Axes that combine two other axes; the second of the two changes faster."""

LARGEST_FRAME: Final = 4 << 30
"""Greatest size of a frame's samples in memory, bytes. Chosen."""

SLOPES: Final = (1e9, 1e15)
"""Least and greatest slope of a ramp, Hz/s. Chosen wide, so that wrong units are refused, but no
unusual radar."""

WIDEST_SPACING: Final = 100
"""Greatest distance of neighbouring receivers, wavelengths at the start of a ramp. Chosen wide, as
`SLOPES`."""

_USABLE_SHARE: Final = {"complex": 0.9, "real": 0.45}
"""Default edge of the pass band, that of TI's decimation filters, as a share of the sample rate."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureParameters(Spec):
    """Ramps, converter, antennas and file layout of a recording.

    Times are defined as in TI's tools: a ramp waits for ``idle_time``, then rises for
    ``ramp_end_time``; the first sample is taken ``adc_start`` after the start of the rise.

    `recording_parameters` reads them from files of TI's tools.

    Parameters
    ----------
    start_frequency : Hz, at the beginning of the rise
    slope : Hz/s, 1e9 to 1e15
    idle_time, ramp_end_time, adc_start : s
    num_ramps : number of ramps in a frame, those of all transmitters together
    sample_rate : 1/s
    num_samples : number of samples of a ramp
    sampling : "complex", or "real" if only the real part was stored
    highest_beat : Hz, edge of the converter's pass band; by default 0.9 of the sample rate (0.45
        for real samples)
    num_transmitters : number of transmitters; they take turns, ramp by ramp
    num_receivers : number of receivers, which are recorded together
    spacing : m, of the receiving elements; by default half a wavelength at `middle_frequency`.
        Transmitters are a whole receiving array apart, so that together they make one longer array
    channel_positions : place (to the left, up) of each receiver in multiples of ``spacing``, seen
        from behind the radar; empty for a line
    transmitter_positions : the same of each transmitter; empty for a line
    first_receiver : side of a line on which receiver 0 is, seen from behind the radar, and
        transmitter 0 too if transmitters form a line
    axes : names of the axes of the array in a NumPy or Zarr file, slowest first
    stored_as : "unsigned" if int16 samples were saved as if they were uint16
    adc_bits : bits of a converted sample, 16, 14 or 12; raw files of fewer than 16 bits hold them
        with zeros instead of the sign in front
    full_scale : stored value that is the converter's full scale, 0 dBFS; by default
        :math:`2^{b-1}` with ``adc_bits`` b
    conjugate : take the complex conjugate, for recordings whose targets beat at negative
        frequencies (or whose I and Q are swapped)
    device : TI device that wrote a raw file; needed for ``.bin`` only
    enabled_receivers : numbers, from 0, of the receivers that the device had switched on, in rising
        order; empty for the first ``num_receivers``. They are the lanes of an xWR14xx's raw file
    num_frames : number of frames that the recording should have; not checked if not given
    """

    start_frequency: Annotated[float, Unit("Hz", least="1 GHz", greatest="1000 GHz")]
    slope: HertzPerSecond
    idle_time: Seconds
    ramp_end_time: Seconds
    adc_start: Seconds
    num_ramps: Annotated[int, Between(greatest=1_000_000)]
    sample_rate: SamplesPerSecond
    num_samples: Annotated[int, Between(greatest=10_000_000)]
    sampling: Sampling = "complex"
    highest_beat: Hertz | None = None
    num_transmitters: Annotated[int, Between(greatest=1024)] = 1
    num_receivers: Annotated[int, Between(greatest=1024)] = 1
    spacing: Metres | None = None
    channel_positions: tuple[Place, ...] = ()
    transmitter_positions: tuple[Place, ...] = ()
    first_receiver: Side = "right"
    axes: tuple[AxisName, ...] = ("frame", "ramp", "receiver", "fast")
    stored_as: Storage = "signed"
    adc_bits: Annotated[int, Between(least=12, greatest=16)] = 16
    full_scale: Annotated[float, Between(least=0.0, greatest=1e30)] | None = None
    conjugate: bool = False
    device: Device | None = None
    enabled_receivers: tuple[Annotated[int, Between(least=0, greatest=1023)], ...] = ()
    num_frames: Annotated[int, Between(greatest=2**53)] | None = None

    def __post_init__(self) -> None:
        for name in ("start_frequency", "slope", "ramp_end_time", "sample_rate"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name}: must be positive")
        if self.adc_bits not in (12, 14, 16):
            raise InputError(f"adc_bits: must be 12, 14 or 16, not {self.adc_bits}")
        if self.full_scale is not None and not math.isfinite(self.full_scale):
            raise InputError("full_scale: must be finite")
        for name in ("idle_time", "adc_start"):
            if getattr(self, name) < 0:
                raise InputError(f"{name}: cannot be negative")
        for name in ("num_ramps", "num_samples", "num_transmitters", "num_receivers"):
            if getattr(self, name) < 1:
                raise InputError(f"{name}: must be at least 1")
        for name in ("highest_beat", "spacing", "num_frames", "full_scale"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise InputError(f"{name}: must be positive")
        self._check_units()
        self._check_band()
        self._check_counts()
        self._check_axes()
        self._check_receivers()
        if self.channel_positions and self.first_receiver == "left":
            raise InputError("first_receiver: has no effect beside channel_positions; leave it out")
        _ = self.array  # raises if positions do not fit

    def _check_units(self) -> None:
        """Refuse values that are wrong by a factor, as those in a wrong unit are."""
        least, greatest = SLOPES
        if not least <= self.slope <= greatest:
            raise InputError(
                f"slope: {self.slope * 1e-12:.4g} MHz/us is outside of {least * 1e-12:g} to "
                f"{greatest * 1e-12:g} MHz/us; write it like '30 MHz/us'"
            )
        wavelength = SPEED_OF_LIGHT / self.start_frequency
        if self.spacing is not None and self.spacing > WIDEST_SPACING * wavelength:
            raise InputError(
                f"spacing: {self.spacing:.4g} m is more than {WIDEST_SPACING} wavelengths, "
                f"{WIDEST_SPACING * wavelength:.4g} m; give the distance of neighbouring "
                "receivers, which is usually half a wavelength"
            )

    def _check_band(self) -> None:
        what, band = "sample rate", self.sample_rate
        if self.sampling == "real":
            what, band = "half of the sample rate", 0.5 * self.sample_rate
        if self.highest_beat is not None and self.highest_beat > band:
            raise InputError(
                f"highest_beat: {self.highest_beat * 1e-6:.4g} MHz is more than {what}, "
                f"{band * 1e-6:.4g} MHz, beyond which beats fold back; lower it"
            )
        half = 0.5 * self.sample_rate / self.num_samples
        if self.highest_beat is not None and self.highest_beat <= half:
            raise InputError(
                f"highest_beat: {self.highest_beat * 1e-3:.4g} kHz is not more than half a range "
                f"cell, {half * 1e-3:.4g} kHz; raise it"
            )

    def _check_counts(self) -> None:
        if self.num_samples < 2:
            raise InputError("num_samples: a ramp needs at least 2 samples")
        if self.num_ramps < 2 * self.num_transmitters:
            raise InputError("num_ramps: a frame needs at least two ramps of each transmitter")
        if self.num_ramps % self.num_transmitters:
            raise InputError(
                f"num_ramps: {self.num_ramps} ramps cannot be shared out evenly among "
                f"{self.num_transmitters} transmitters"
            )
        size = 16 * self.num_ramps * self.num_samples * self.num_receivers
        if size > LARGEST_FRAME:
            raise InputError(
                f"num_samples: a frame of {self.num_ramps} ramps, {self.num_samples} samples and "
                f"{self.num_receivers} receivers takes {size / 2**30:.3g} GiB of memory, more than "
                f"{LARGEST_FRAME >> 30} GiB; divide it into shorter frames"
            )
        if self.sampling == "real" and self.conjugate:
            raise InputError("conjugate: has no effect on real samples; leave it out")
        last = self.adc_start + (self.num_samples - 1) / self.sample_rate
        if last > self.ramp_end_time * (1 + 1e-9):
            raise InputError(
                f"ramp_end_time: the converter's last sample comes {last * 1e6:.4g} us after the "
                f"ramp's start, but the ramp ends at {self.ramp_end_time * 1e6:.4g} us; lengthen "
                "the ramp, take fewer samples or lower adc_start"
            )

    def _check_axes(self) -> None:
        single = [part for name in self.axes for part in COMBINED_AXES.get(name, (name,))]
        missing = {"sweep", "fast"} - set(single)
        missing |= {"transmitter"} - set(single) if self.num_transmitters > 1 else set()
        missing |= {"receiver"} - set(single) if self.num_receivers > 1 else set()
        if missing:
            raise InputError(
                f"axes: '{min(missing)}' is missing ('ramp' is sweep and transmitter, 'channel' "
                "is transmitter and receiver); name every axis of the array"
            )
        twice = sorted({name for name in single if single.count(name) > 1})
        if twice:
            raise InputError(f"axes: '{twice[0]}' is named twice; name each axis once")

    def _check_receivers(self) -> None:
        numbers = self.enabled_receivers
        if numbers and len(numbers) != self.num_receivers:
            raise InputError(
                f"enabled_receivers: names {len(numbers)} receivers, but num_receivers is "
                f"{self.num_receivers}; name every receiver that was switched on"
            )
        if list(numbers) != sorted(set(numbers)):
            raise InputError("enabled_receivers: must rise, as in [2, 3]; name each receiver once")

    @property
    def lengths(self) -> dict[str, int]:
        """Length of every axis except ``frame``."""
        return {
            "sweep": self.num_ramps // self.num_transmitters,
            "transmitter": self.num_transmitters,
            "receiver": self.num_receivers,
            "ramp": self.num_ramps,
            "channel": self.num_transmitters * self.num_receivers,
            "fast": self.num_samples,
        }

    @property
    def usable_beat(self) -> float:
        """Edge of the converter's pass band, Hz: ``highest_beat`` or its default."""
        if self.highest_beat is not None:
            return self.highest_beat
        return _USABLE_SHARE[self.sampling] * self.sample_rate

    @property
    def repetition_interval(self) -> float:
        """Time from the start of a ramp to that of the next one, s."""
        return self.idle_time + self.ramp_end_time

    @property
    def middle_frequency(self) -> float:
        """Frequency that is transmitted in the middle of the sampling window, Hz."""
        middle = self.adc_start + 0.5 * (self.num_samples - 1) / self.sample_rate
        return self.start_frequency + self.slope * middle

    @property
    def range_resolution(self) -> float:
        """Range resolution, m: c/2B with the sampled bandwidth B."""
        return SPEED_OF_LIGHT / (2.0 * self.slope * self.num_samples / self.sample_rate)

    @property
    def greatest_range(self) -> float:
        """Range whose echo beats at the edge of the pass band, m."""
        return self.usable_beat * SPEED_OF_LIGHT / (2.0 * self.slope)

    @property
    def speed_span(self) -> float:
        """Width of the unambiguous range rates, m/s: λ/2T, T between a transmitter's ramps."""
        wavelength = SPEED_OF_LIGHT / self.middle_frequency
        return wavelength / (2.0 * self.repetition_interval * self.num_transmitters)

    @property
    def speed_resolution(self) -> float:
        """Range-rate resolution, m/s: `speed_span` over the number of sweeps."""
        return self.speed_span / self.lengths["sweep"]

    @property
    def array(self) -> AntennaArray:
        """The elements; their pattern is not known, and taken to be isotropic."""
        spacing = self.spacing
        if spacing is None:
            spacing = 0.5 * SPEED_OF_LIGHT / self.middle_frequency
        transmitters = self.transmitter_positions
        if self.first_receiver == "left" and not transmitters:
            # a whole receiving array apart, from left to right
            transmitters = tuple((-n * self.num_receivers, 0) for n in range(self.num_transmitters))
        return AntennaArray(
            num_channels=self.num_receivers,
            num_transmitters=self.num_transmitters,
            spacing=spacing,
            pattern=ISOTROPIC,
            channel_positions=self.channel_positions,
            transmitter_positions=transmitters,
        )

    @property
    def stored_full_scale(self) -> float:
        """Stored value that is the converter's full scale: ``full_scale`` or its default."""
        return self.full_scale or 2.0 ** (self.adc_bits - 1)

    @property
    def schedule(self) -> RampSchedule:
        """Ramps of a frame; time 0 is the start of the first ramp's rise."""
        ramp = np.arange(self.num_ramps)
        start: FloatArray = ramp * np.float64(self.repetition_interval)
        turns = np.eye(self.num_transmitters, dtype=np.complex128)
        return RampSchedule(
            start_time=start,
            duration=np.full(self.num_ramps, self.ramp_end_time),
            start_frequency=np.full(self.num_ramps, self.start_frequency),
            slope=np.full(self.num_ramps, self.slope),
            start_phase=np.zeros(self.num_ramps),
            sweep=ramp,
            transmit_weight=np.tile(turns, (self.num_ramps // self.num_transmitters, 1)),
        )

    @property
    def times(self) -> SampleTimes:
        """Sample times of a frame, from the start of the first ramp's rise."""
        return SampleTimes(
            first=self.schedule.start_time + self.adc_start,
            num_samples=np.full(self.num_ramps, self.num_samples),
            rate=self.sample_rate,
        )
