r"""Range and range rate from equal ramps by two Fourier transforms, also with time division.

With :math:`y = s_{tx}\overline{s_{rx}}` and a target at :math:`R + vt`, the phase of the samples at
a time t' on an up-ramp of slope b that starts at frequency f is :math:`2\pi (f + b t')\,\tau` with
:math:`\tau = 2(R + vt)/c`. With :math:`f_m` the frequency in the middle of the sampling window, the
samples have the frequencies

.. math:: f_b = \frac{2bR}{c} + \frac{2 f_m v}{c} \quad\text{along a ramp,}\qquad
          f_d = \frac{2 f_m v}{c} \quad\text{from ramp to ramp,}

so a target that recedes is at a positive frequency on both axes. The range axis of the maps is
:math:`c f_b/2b`; from the range of a detection the second term is removed.

Transmitters that take turns, ramp by ramp, form a virtual array. Transmitter p sends p ramps, T
apart, later than the first one, so that its channels are ahead by :math:`2\pi f_d\,pT`; this phase
is removed before azimuths are measured. If a target's range rate is beyond the span of the map, it
is ambiguous, and the removed phase is wrong as well.
"""

from dataclasses import dataclass, field

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError, InputError
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.model.spectra import RangeProfiles, RangeRateMap, RangeRateSpectra
from polychirp.receiver.angle.doa import root_music
from polychirp.receiver.detection.cfar import CfarWindow, ordered_statistic
from polychirp.spec import Spec
from polychirp.units import Hertz

TAPER_SHAPE = 7.0
"""Kaiser's β of both transforms (chosen): side lobes 51 dB down, noise bandwidth 1.58 cells."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SawtoothReceiver(Spec):
    """Receiver with windowed range and Doppler transforms, ordered-statistic CFAR and root-MUSIC.

    Parameters
    ----------
    highest_beat : Hz, highest beat of the maps: the edge of the IF filter's pass band
    num_transmitters : number of transmitters that take turns, ramp by ramp; each is one length of
        the receiving array to the left of the former, so that virtual elements continue that array
    false_alarm_probability : probability per cell of the map, on white noise
    window : training cells of the CFAR, over (range rate, range); made smaller on a small map
    quantile : rank of the training cell that gives the floor, as a share of their number

    Examples
    --------
    A point at 12 m that recedes at 3 m/s, as strong as the noise of a sample:

    >>> from polychirp.model.antenna import AntennaArray
    >>> from polychirp.model.if_frame import SampleTimes
    >>> from polychirp.model.ramp import RampSchedule
    >>> k = np.arange(64)
    >>> ramps = RampSchedule(start_time=k * 60e-6, duration=0 * k + 50e-6,
    ...     start_frequency=0 * k + 77e9, slope=0 * k + 10e12, start_phase=0 * k, sweep=k)
    >>> times = SampleTimes(first=ramps.start_time + 5e-6, num_samples=0 * k + 128, rate=4e6)
    >>> delay = 2 * (12.0 + 3.0 * times.time) / SPEED_OF_LIGHT
    >>> in_ramp = times.time - ramps.start_time[:, None]
    >>> samples = np.exp(2j * np.pi * (77e9 + 10e12 * (in_ramp - delay / 2)) * delay)
    >>> noise = np.random.default_rng(1).normal(scale=0.7, size=(2, *samples.shape))
    >>> samples = samples + noise[0] + 1j * noise[1]
    >>> frame = IfFrame(samples=samples[None], times=times, schedule=ramps,
    ...     array=AntennaArray(num_channels=1))
    >>> found = SawtoothReceiver(highest_beat=2e6).detect(frame)
    >>> found.range.round(1), found.range_rate.round(2)  # 12 m, and 1.9 ms at 3 m/s
    (array([12.]), array([3.]))
    """

    highest_beat: Hertz
    num_transmitters: int = 1
    false_alarm_probability: float = 1e-4
    window: CfarWindow = field(
        default_factory=lambda: CfarWindow(
            guard=(3, 3), training=(8, 8), step=(2, 2), is_circular=(True, False)
        )
    )
    quantile: float = 0.6

    def __post_init__(self) -> None:
        if not self.highest_beat > 0:
            raise InputError("a receiver's highest beat must be positive")
        if self.num_transmitters < 1:
            raise InputError("a receiver needs at least one transmitter")

    def spectra(self, frame: IfFrame) -> RangeRateSpectra:
        """Spectra ``(virtual channel, range_rate, range)``, in the order of the transmitters."""
        profiles = range_profiles(frame, highest_beat=self.highest_beat)
        return range_rate_spectra(profiles, frame, num_transmitters=self.num_transmitters)

    def detect(self, frame: IfFrame) -> Detections:
        """Detections, strongest first; range and azimuth are those in the middle of the frame."""
        return self.detect_in(self.spectra(frame), frame)

    def detect_in(self, spectra: RangeRateSpectra, frame: IfFrame) -> Detections:
        """Detections, as of `detect`, from the `spectra` of the frame."""
        map_ = spectra.mean_power
        found = ordered_statistic(
            map_.power,
            window=self.window.fitted(map_.power.shape),
            false_alarm_probability=self.false_alarm_probability,
            quantile=self.quantile,
            num_looks=spectra.amplitude.shape[0],
        )
        is_peak = is_local_maximum(map_.power)[found.row, found.column]
        row, column = found.row[is_peak], found.column[is_peak]
        rate, beat_range, power = interpolated_peaks(map_, row=row, column=column)
        middle = _middle_frequency(frame)
        azimuth = np.full(row.size, np.nan)
        if spectra.amplitude.shape[0] > 1:
            sine = root_music(
                spectra.amplitude[:, row, column].T[:, :, None],
                spacing=frame.array.spacing * middle / SPEED_OF_LIGHT,
            )
            azimuth = np.arcsin(np.clip(sine, -1.0, 1.0))
        order = np.argsort(-power, kind="stable")
        schedule = frame.schedule
        return Detections(
            time=float(0.5 * (schedule.start_time[0] + schedule.end_time[-1])),
            range=(beat_range - rate * middle / schedule.slope[0])[order],
            range_rate=rate[order],
            azimuth=azimuth[order],
            power=power[order],
            snr=(found.power / found.floor)[is_peak][order],
        )


def taper(size: int) -> FloatArray:
    """Kaiser's window with the sum 1, so that a tone's amplitude is that of its spectral peak."""
    window = np.kaiser(size, TAPER_SHAPE)
    return np.asarray(window / window.sum())


def range_profiles(frame: IfFrame, *, highest_beat: float) -> RangeProfiles:
    """Tapered spectrum of every ramp, from range zero to the range of the highest beat.

    Phases refer to the middle of the sampling window.

    Raises
    ------
    CapabilityError
        The ramps differ in slope, start frequency or number of samples, or are down-ramps.
    InputError
        The highest beat is above the sample rate.
    """
    _check_equal_ramps(frame)
    size = frame.times.most_samples
    rate = frame.times.rate
    if highest_beat > rate * (1 + 1e-12):
        raise InputError(
            f"a highest beat of {highest_beat / 1e6:g} MHz is above the sample rate of "
            f"{rate / 1e6:g} MS/s; it can be at most that"
        )
    num_ranges = min(size, int(np.floor(highest_beat / rate * size * (1 + 1e-12))) + 1)
    spectrum = np.fft.fft(frame.samples * taper(size), axis=2)[:, :, :num_ranges]
    beat = np.arange(num_ranges) * rate / size
    to_middle = np.exp(1j * np.pi * np.arange(num_ranges) * (size - 1) / size)
    return RangeProfiles(
        amplitude=spectrum * to_middle,
        range=beat * SPEED_OF_LIGHT / (2.0 * float(frame.schedule.slope[0])),
    )


def range_rate_spectra(
    profiles: RangeProfiles, frame: IfFrame, *, num_transmitters: int = 1
) -> RangeRateSpectra:
    """Tapered transform over the ramps of every transmitter, its phases at one common time.

    Raises
    ------
    CapabilityError
        The ramps do not follow each other at equal intervals.
    InputError
        The number of ramps is no multiple of that of transmitters, or a transmitter has only one.
    """
    channels, ramps, ranges = profiles.amplitude.shape
    if ramps % num_transmitters or ramps < 2 * num_transmitters:
        raise InputError(
            f"{ramps} ramps cannot be shared out evenly among {num_transmitters} transmitters, "
            "at least two for each"
        )
    interval = _repetition_interval(frame)
    sweeps = ramps // num_transmitters
    turns = profiles.amplitude.reshape(channels, sweeps, num_transmitters, ranges)
    virtual = turns.transpose(2, 0, 1, 3)  # (transmitter, channel, sweep, range)
    spectrum = np.fft.fft(virtual * taper(sweeps)[:, None], axis=2)
    frequency: FloatArray = np.asarray(np.fft.fftfreq(sweeps, d=num_transmitters * interval))
    turn = np.arange(num_transmitters)[:, None, None, None]
    late = np.exp(-2j * np.pi * frequency[:, None] * turn * interval)
    order = np.argsort(frequency, kind="stable")
    return RangeRateSpectra(
        amplitude=(spectrum * late)[:, :, order].reshape(-1, sweeps, ranges),
        range_rate=frequency[order] * SPEED_OF_LIGHT / (2.0 * _middle_frequency(frame)),
        range=profiles.range,
    )


def is_local_maximum(power: FloatArray) -> BoolArray:
    """Mask of cells above all eight neighbours, ``(range_rate, range)``; range rates are circular.

    >>> is_local_maximum(np.array([[0.0, 1.0], [0.0, 3.0], [2.0, 0.0]])).astype(int)
    array([[0, 0], [0, 1], [0, 0]])
    """
    rows, columns = power.shape
    padded = np.pad(power, ((1, 1), (0, 0)), mode="wrap")
    padded = np.pad(padded, ((0, 0), (1, 1)), constant_values=-np.inf)
    above = np.ones(power.shape, dtype=np.bool_)
    for i in (0, 1, 2):
        for j in (0, 1, 2):
            if (i, j) != (1, 1):
                above &= power > padded[i : i + rows, j : j + columns]
    return above


def interpolated_peaks(
    map_: RangeRateMap, *, row: IntArray, column: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    r"""Range rate, range and power, ``(detection,)``, of maxima between the cells of a map.

    Along each axis, a parabola through the logarithms a, b, c of the powers of three cells has its
    vertex :math:`\delta = \tfrac12 (a - c)/(a - 2b + c)` cells from the middle one, and
    :math:`-\tfrac14 (a - c)\delta` above its b. With this taper the errors are less than 1 % of a
    cell and 0.16 dB. At the edges of the range axis the peak is put at the cell's own range.
    """
    level = np.log(np.maximum(map_.power, 1e-300))
    rows, columns = level.shape
    here = level[row, column]
    rate_offset, rate_gain = _vertex(
        level[(row - 1) % rows, column], here, level[(row + 1) % rows, column]
    )
    left, right = np.maximum(column - 1, 0), np.minimum(column + 1, columns - 1)
    range_offset, range_gain = _vertex(level[row, left], here, level[row, right])
    inside = (column > 0) & (column < columns - 1)
    return (
        map_.range_rate[row] + rate_offset * (map_.range_rate[1] - map_.range_rate[0]),
        map_.range[column] + inside * range_offset * (map_.range[1] - map_.range[0]),
        np.exp(here + rate_gain + inside * range_gain),
    )


def _vertex(
    before: FloatArray, here: FloatArray, after: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Offset of a parabola's vertex from the middle cell, in cells, and its height above it."""
    curvature = before - 2.0 * here + after
    flat = curvature > -1e-12
    offset = 0.5 * (before - after) / np.where(flat, -1.0, curvature)
    offset = np.where(flat, 0.0, np.clip(offset, -0.5, 0.5))
    return offset, -0.25 * (before - after) * offset


def _middle_frequency(frame: IfFrame) -> float:
    """Frequency transmitted in the middle of every ramp's sampling window, Hz."""
    times, schedule = frame.times, frame.schedule
    middle = times.first[0] + 0.5 * (times.most_samples - 1) / times.rate - schedule.start_time[0]
    return float(schedule.start_frequency[0] + schedule.slope[0] * middle)


def _repetition_interval(frame: IfFrame) -> float:
    start = frame.times.first
    interval = float(start[-1] - start[0]) / (start.size - 1)
    uneven = float(np.max(np.abs(start - start[0] - interval * np.arange(start.size))))
    if uneven > 1e-4 * interval:
        raise CapabilityError(
            f"the starts of the ramps deviate by up to {uneven:.3g} s from equal intervals, which "
            "a slow-time Fourier transform needs; use polychirp.receiver.chain.Receiver"
        )
    return interval


def _check_equal_ramps(frame: IfFrame) -> None:
    schedule, times = frame.schedule, frame.times
    same = all(
        np.allclose(values, values[0], rtol=1e-9, atol=0.0)
        for values in (schedule.slope, schedule.start_frequency, times.num_samples)
    )
    if not same or schedule.slope[0] <= 0:
        raise CapabilityError(
            "this receiver needs rising ramps of one slope, frequency and length; "
            "use polychirp.receiver.chain.Receiver for others"
        )
