"""`DerivedRadar`: resolution, limits and size of a radar's frame, from its ramps and receiver."""

from dataclasses import dataclass

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError
from polychirp.model.if_frame import sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.angle.ambiguity import Window, beam_of, unambiguous_window
from polychirp.receiver.angle.beams import too_large
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.subframes import (
    has_subframes,
    ramps_of,
    subframes,
    unambiguous_span,
)
from polychirp.receiver.selection import (
    AnyReceiver,
    FrameReceiver,
    angle_estimator,
    reason_of_choice,
    receiver_for,
)
from polychirp.receiver.signal_model.transmit_codes import virtual_channels
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.staircase import unreadable as unstepped
from polychirp.study.limits.bands import joint_band, sampled_band
from polychirp.study.limits.beams import half_power_width
from polychirp.study.limits.power import eirp, sample_noise
from polychirp.study.limits.size import frame_bytes
from polychirp.study.spec import StudyRadar

Limits = tuple[float, float]
"""Least and greatest value over the ramps of a frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivedRadar:
    r"""Resolution, limits and size of the frame of one radar.

    Parameters
    ----------
    name : name of the radar
    range_resolution : m, :math:`c/2B` with the bandwidth B of the sampled part of each ramp; if the
        coherent receiver adds ramps of different bands in phase, whose band together is wider than
        that of any of them, that band is B (`bands.joint_band`)
    speed_resolution : m/s, :math:`\lambda/2T_{frame}`
    unambiguous_speed : m/s, greatest speed, approaching or receding, that a Doppler transform over
        equal sweeps of the same transmitting elements gives without ambiguity:
        :math:`\lambda/4NT`. T is the interval from sweep to sweep, and N the number of sweeps after
        which the elements' code repeats, so that NT is the repetition interval of one transmitter;
        in subframes, it is the greatest speed that all of them tell apart together; of the
        receiver of MFSK, the speed up to which no two targets within its ranges look alike
    unfolded_speed : m/s, greatest speed that the receiver reports as it is: that with N = 1 if it
        is the range-Doppler receiver and tells the speeds that a code leaves open apart, by empty
        bands of the code or by the beams of the virtual array, else ``unambiguous_speed``
    code : number of sweeps after which the code of the transmitting elements repeats, and number of
        the elements; with Doppler division, the bands that their difference leaves are empty
    has_subframes : True if the range-Doppler receiver reads the frame in subframes, which tell
        speeds up to ``unambiguous_speed`` together
    has_equal_sweeps : True if all sweeps are equal; with different sweeps, speeds above
        ``unambiguous_speed`` can be told apart
    greatest_range : m, range whose beat on the steepest ramp is at the edge of the IF filter's pass
        band; of a coded carrier, the range after which echoes repeat; of steps, the range whose
        echo of a step arrives when the converter starts
    beat_band : Hz, beats of echoes from 0 m and from the receiver's greatest range, on the steepest
        ramp
    ramp_duration : s
    frame_duration : s, from the first ramp's start to the last one's end
    azimuth_window, elevation_window : rad, azimuth and elevation to either side within which the
        virtual array tells all directions apart; both hold together, and of several such windows it
        is the one that covers most of the elements' beam (`angle.ambiguity.unambiguous_window`);
        None if the array does not measure them
    azimuth_beamwidth, elevation_beamwidth : rad, width of the virtual array's beam at half of its
        power (`limits.beams`), about the distance at which two equal targets are resolved; None if
        the array does not measure the angle or is too small
    eirp : W, radiated by one transmitting element at the maximum of its beam, over isotropic
    antenna_gain : ratio over isotropic, of an element at the maximum of its beam
    noise_figure : ratio
    sample_noise : W, thermal noise of a sample, referred to the antenna's output (`limits.power`)
    chips_per_ramp : number of chips within a ramp, with repetitions; 0 without a code
    peak_to_average : ratio of the greatest to the mean power while a ramp lasts
    receiver : kind of the receiver of its frame
    receiver_reason : why `AutoReceiver` chose it, as the end of a sentence
    num_ramps : in a frame
    samples_per_ramp : number, of one channel
    samples_per_frame : number, of one channel
    sampling : "complex" or "real" samples
    memory : bytes of the samples of the frame and of its parts (echo, noise and so on), in all
        channels
    """

    name: str
    range_resolution: Limits
    speed_resolution: float
    unambiguous_speed: float
    unfolded_speed: float
    code: tuple[int, int]
    has_equal_sweeps: bool
    has_subframes: bool
    greatest_range: float
    beat_band: Limits
    ramp_duration: Limits
    frame_duration: float
    azimuth_window: float | None
    elevation_window: float | None
    azimuth_beamwidth: float | None
    elevation_beamwidth: float | None
    eirp: float
    antenna_gain: float
    noise_figure: float
    sample_noise: float
    chips_per_ramp: int
    peak_to_average: float
    receiver: str
    receiver_reason: str
    num_ramps: int
    samples_per_ramp: tuple[int, int]
    samples_per_frame: int
    sampling: str
    memory: int


def derived_radar(radar: StudyRadar, schedule: RampSchedule, receiver: AnyReceiver) -> DerivedRadar:
    """Derived values of one radar; nothing is traced or synthesised."""
    times = sample_times(schedule, radar.converter)
    chosen = receiver_for(receiver, schedule)
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    frame_duration = float(schedule.end_time[-1] - schedule.start_time[0])
    num_sweeps = int(schedule.sweep[-1]) + 1
    steepest = float(np.max(np.abs(schedule.slope)))
    joint = joint_band(chosen, schedule, times)
    band = sampled_band(schedule, times) if joint is None else np.full(schedule.num_ramps, joint)
    resolution = SPEED_OF_LIGHT / (2.0 * band)
    reader = chosen.reader() if isinstance(chosen, Decoding) else chosen
    code = _code_length(schedule), schedule.num_elements
    is_unfolded = isinstance(reader, RangeDoppler) and _tells_folds(reader, schedule, radar)
    place, _ = virtual_channels(radar.array, schedule.num_elements)
    elements = Elements.of(place, frequency=SPEED_OF_LIGHT / wavelength)
    window = Window(None, None)  # of an array whose lobes would take too long to find
    if not too_large(elements):
        window = unambiguous_window(
            elements, estimator=angle_estimator(chosen), beam=beam_of(radar.array.pattern)
        )
    widths = [half_power_width(elements, axis) for axis in (0, 1)]
    return DerivedRadar(
        name=radar.name,
        range_resolution=(float(resolution.min()), float(resolution.max())),
        speed_resolution=_speed_resolution(schedule, reader),
        unambiguous_speed=_unambiguous_speed(schedule, reader, code[0]),
        unfolded_speed=_unambiguous_speed(schedule, reader, 1 if is_unfolded else code[0]),
        code=code,
        has_equal_sweeps=_has_equal_sweeps(schedule, num_sweeps),
        has_subframes=isinstance(reader, RangeDoppler) and has_subframes(schedule),
        greatest_range=_greatest_range(radar, schedule),
        beat_band=(0.0, 2.0 * steepest * receiver.greatest_range / SPEED_OF_LIGHT),
        ramp_duration=(float(schedule.duration.min()), float(schedule.duration.max())),
        frame_duration=frame_duration,
        azimuth_window=window.azimuth,
        elevation_window=window.elevation,
        azimuth_beamwidth=widths[0],
        elevation_beamwidth=widths[1],
        eirp=eirp(radar),
        antenna_gain=radar.array.pattern.peak_gain,
        noise_figure=radar.noise_figure,
        sample_noise=sample_noise(radar),
        chips_per_ramp=_num_chips(schedule),
        peak_to_average=1.0 if schedule.code is None else 1.0 / schedule.code.mean_power,
        receiver=chosen.kind,
        receiver_reason=reason_of_choice(schedule),
        num_ramps=schedule.num_ramps,
        samples_per_ramp=(int(times.num_samples.min()), times.most_samples),
        samples_per_frame=int(times.num_samples.sum()),
        sampling=radar.converter.sampling,
        memory=frame_bytes(times, radar),
    )


def _greatest_range(radar: StudyRadar, schedule: RampSchedule) -> float:
    """See `DerivedRadar.greatest_range`."""
    steepest = float(np.max(np.abs(schedule.slope)))
    if steepest == 0.0 and schedule.code is not None:
        return 0.5 * SPEED_OF_LIGHT * float(np.min(schedule.code.repetition))
    if schedule.is_stepped:
        return 0.5 * SPEED_OF_LIGHT * radar.converter.start
    return SPEED_OF_LIGHT * radar.if_filter.passband / (2.0 * steepest)


def _num_chips(schedule: RampSchedule) -> int:
    """Greatest number of chips within a ramp, 0 without a code."""
    if schedule.code is None:
        return 0
    return round(float(np.max(schedule.duration / schedule.code.chip_duration)))


def _speed_resolution(schedule: RampSchedule, reader: object) -> float:
    """Doppler cell, m/s, of the ramps that the receiver transforms together."""
    if isinstance(reader, RangeDoppler) and has_subframes(schedule):
        return min(_doppler_cell(ramps_of(schedule, part)) for part in subframes(schedule))
    return _doppler_cell(schedule)


def _doppler_cell(schedule: RampSchedule) -> float:
    """Speed at which an echo's phase changes by one cycle over the frame, m/s."""
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    return wavelength / (2.0 * float(schedule.end_time[-1] - schedule.start_time[0]))


def _unambiguous_speed(schedule: RampSchedule, receiver: FrameReceiver, code_length: int) -> float:
    """See `DerivedRadar`; ``code_length`` is that of a code whose folds are not told apart."""
    if isinstance(receiver, MfskReceiver):
        return 0.0 if unstepped(schedule) else receiver.unambiguous_speed(schedule)
    if isinstance(receiver, RangeDoppler) and has_subframes(schedule):
        return 0.5 * unambiguous_span(schedule, code_length=code_length)
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    return wavelength / (4.0 * _sweep_interval(schedule) * code_length)


def _sweep_interval(schedule: RampSchedule) -> float:
    """Mean time from the start of a sweep to that of the next one, s; a lone sweep's duration."""
    first_ramp = np.searchsorted(schedule.sweep, np.unique(schedule.sweep))
    starts = schedule.start_time[first_ramp]
    if starts.size == 1:
        return float(schedule.end_time[-1] - starts[0])
    return float(starts[-1] - starts[0]) / (starts.size - 1)


def _code_length(schedule: RampSchedule) -> int:
    """Number of sweeps after which the weights of the transmitting elements repeat."""
    num_sweeps = int(schedule.sweep[-1]) + 1
    weight = schedule.transmit_weight[:: schedule.num_ramps // num_sweeps]
    lengths = range(1, len(weight))
    return next((n for n in lengths if np.allclose(weight[n:], weight[:-n])), len(weight))


def _tells_folds(reader: RangeDoppler, schedule: RampSchedule, radar: StudyRadar) -> bool:
    """True if the receiver tells the speeds apart that a code leaves open."""
    try:
        return reader.tells_folds_apart(schedule, radar.array)
    except CapabilityError:  # a code that cannot be read is told by its radar's problems
        return False


def _has_equal_sweeps(schedule: RampSchedule, num_sweeps: int) -> bool:
    """True if all sweeps have the same ramps, at equal intervals."""
    if schedule.num_ramps % num_sweeps:
        return False
    starts = schedule.start_time.reshape(num_sweeps, -1)
    interval = np.diff(starts, axis=0)
    return all(
        np.allclose(values, values[:1], rtol=1e-6, atol=0.0)
        for values in (
            interval,
            *(
                each.reshape(num_sweeps, -1)
                for each in (schedule.duration, schedule.slope, schedule.start_frequency)
            ),
        )
    )
