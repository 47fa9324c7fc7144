"""Two operands of a correlation at one rate and carrier, and their correlation in theory."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.capture.sigmf import SigmfRecording
from polychirp.correlation.alignment import aligned, at_baseband, comparable
from polychirp.correlation.ambiguity import Ambiguity, ambiguity
from polychirp.correlation.base import Correlation
from polychirp.correlation.theory import (
    are_opposite,
    crossing_peak,
    disjoint_peak,
    expected,
    opposite_peak,
)
from polychirp.errors import InputError, no_such
from polychirp.model.baseband import Baseband, Progress, no_progress
from polychirp.model.ramp import RampSchedule
from polychirp.model.transceiver import Transceiver
from polychirp.radio.base import Radio, measured
from polychirp.rng import Streams
from polychirp.study.section_v.cases import ramp
from polychirp.study.spec import Study, schedule_of
from polychirp.synthesis.sdr.transceiver import link_for, transceived
from polychirp.waveform import AnyWaveform
from polychirp.waveform.playing import band_edges, played

NAMED: Final[dict[str, AnyWaveform]] = {
    "paper-100": ramp(4e9, 100e6),
    "paper-120": ramp(3.75e9, 120e6),
}
"""Chirps of section V of the paper, by the names of `polychirp correlate`."""

RATE_OVER_BANDWIDTH: Final = 1.3
"""Default ratio of sample rate to bandwidth, that of the paper: 130 MS/s for 100 MHz."""

DISJOINT_RATE_OVER_BANDWIDTH: Final = 8.0
r"""The same for two waveforms that share no frequency, whose correlation the ramps' ends make: a
sum of samples makes an end :math:`x/\sin x` times as strong as an integral does, with x = π times
the distance of the frequencies over the rate; 0.2 dB at most here, 11 dB at 1.3."""

FEWEST_ZONES: Final = 2.0
r"""Least time in which the faster of two ramps passes the band that they share, in units of
:math:`1/\sqrt{|\Delta\beta|}`, for a law of the peak. Chosen: the law is 0.5 dB off here, and 8 dB
at a fifth of it, where no whole Fresnel zone fits into the overlap."""

EDGE_SHARE: Final = 0.05
r"""Greatest distance of the edges of two bands that count as one, in units of
:math:`\sqrt{|\Delta\beta|}`. Chosen: the peak of opposite slopes is then within 0.1 dB."""

MOST_LAGS: Final = 1 << 23
"""Number of lags of a correlation above which `fine_step` reduces the lags per sample; chosen."""

MOST_TERMS: Final = 1 << 27
"""Greatest product of both numbers of ramps and the number of lags in closed form; chosen."""

MOST_IN_MEMORY: Final = 1 << 26
"""Greatest number of samples of a recording that is correlated as a whole; chosen: they take 1 GB,
and the correlation a few times as much."""

COMMON_CARRIER: Final = 1e11
"""Carrier to which schedules are moved to compare them at baseband, Hz; chosen: well above all
bandwidths, since ramps need positive frequencies."""

NUM_DOPPLERS: Final = 301
NUM_DELAYS: Final = 2000
"""Numbers of Doppler shifts and, at most, of lag steps (one sample each) in a picture of the
ambiguity function; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Operand:
    """One of the two signals of a correlation: a waveform or a recording.

    Parameters
    ----------
    name : name in messages
    schedule : ramps from time zero on; None for a recording whose ramps are unknown
    recording : the recording; None for a waveform
    """

    name: str
    schedule: RampSchedule | None = None
    recording: SigmfRecording | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pair:
    """Two signals of one rate about one carrier, and their schedules.

    Parameters
    ----------
    title : title of tables and pictures
    a, b : signals from time zero on
    a_schedule, b_schedule : ramps for the closed form; None if they are unknown
    is_ideal : True if neither signal comes from a recording, a radio or the model of a radio
    """

    title: str
    a: Baseband
    b: Baseband
    a_schedule: RampSchedule | None
    b_schedule: RampSchedule | None
    is_ideal: bool

    @property
    def law(self) -> tuple[float, str] | None:
        """Peak of two single ramps in theory, a power ratio, and its law's name; None if no law."""
        a, b = self.a_schedule, self.b_schedule
        if a is None or b is None or a.num_ramps != 1 or b.num_ramps != 1:
            return None
        if a.code is not None or b.code is not None:
            return None
        times = float(a.duration[0]), float(b.duration[0])
        gap = _gap(a, b)
        if gap > 0:
            return disjoint_peak(gap, *times), "bound for bands that share no frequency"
        slopes = float(a.slope[0]), float(b.slope[0])
        bend = abs(slopes[0] - slopes[1])
        zones = FEWEST_ZONES * max(abs(slopes[0]), abs(slopes[1]))
        if bend * times[0] * times[1] < 10.0 or -gap * math.sqrt(bend) < zones:
            return None
        if are_opposite(*slopes) and _edge_distance(a, b) < EDGE_SHARE * math.sqrt(bend):
            peak = opposite_peak(slopes[0], *times)
            return peak, "−10 log₁₀(2 B T) + 2.6 dB for opposite slopes"
        return crossing_peak(*slopes, *times), "−10 log₁₀(|ΔB| T) + 1.4 dB for crossing ramps"


def _gap(a: RampSchedule, b: RampSchedule) -> float:
    """Distance between two bands, Hz; if they overlap, minus the width of what they share."""
    (low, high), (other_low, other_high) = band_edges(a), band_edges(b)
    return max(low, other_low) - min(high, other_high)


def _edge_distance(a: RampSchedule, b: RampSchedule) -> float:
    """Distance of the lower or of the upper edges of two bands, the lesser one, Hz."""
    (low, high), (other_low, other_high) = band_edges(a), band_edges(b)
    return min(abs(low - other_low), abs(high - other_high))


def named(name: str) -> Operand:
    """One ramp of the waveform with this name in `NAMED`."""
    schedule = NAMED[name].schedule(num_sweeps=1, streams=Streams(1))
    return Operand(name=name, schedule=schedule)


def from_recording(name: str, recording: SigmfRecording) -> Operand:
    """A recording as an operand, with the ramps in its metadata if there are any."""
    schedule = None if recording.schedule is None else _from_zero(recording.schedule)
    return Operand(name=name, schedule=schedule, recording=recording)


def from_study(study: Study, radar: str, *, num_sweeps: int) -> Operand:
    """The first sweeps of a radar of a study as an operand, with the errors of the radar's clock.

    `InputError` is raised if the study has no such radar, or ``num_sweeps`` is zero.
    """
    if num_sweeps < 1:
        raise InputError(f"num_sweeps is {num_sweeps}; use 1 or more")
    for one in study.radars:
        if one.name == radar:
            schedule = schedule_of(study, replace(one, num_sweeps=num_sweeps))
            return Operand(name=radar, schedule=_from_zero(schedule))
    known = [one.name for one in study.radars]
    raise InputError(f"the study: {no_such('radar', radar, known)}")


def _from_zero(schedule: RampSchedule) -> RampSchedule:
    return replace(schedule, start_time=schedule.start_time - schedule.start_time[0])


def paired(
    a: Operand, b: Operand, *, sample_rate: float | None = None, compare_basebands: bool = False
) -> Pair:
    """Both operands at one rate about one carrier.

    Parameters
    ----------
    sample_rate : 1/s; by default that of a recording (of ``b`` if both are), else 1.3 times the
        band that contains both waveforms (8 times, if they share no frequency), or at baseband the
        wider one of their bands
    compare_basebands : True to remove the carriers: those of waveforms are the middle of the band

    Raises
    ------
    InputError
        A waveform does not fit into the band, both share no frequency, or a recording is too long.
    """
    recorded = [one.recording for one in (b, a) if one.recording is not None]
    planned = [one.schedule for one in (a, b) if one.recording is None]
    schedules = [schedule for schedule in planned if schedule is not None]
    if compare_basebands:
        spans = [high - low for low, high in map(band_edges, schedules)]
        wide = RATE_OVER_BANDWIDTH * max(spans, default=0.0)
        rate = sample_rate or (recorded[0].sample_rate if recorded else wide)
        signals = [at_baseband(_signal(one, rate, None)) for one in (a, b)]
    else:
        edges = [edge for one in schedules for edge in band_edges(one)]
        centre = recorded[0].centre_frequency if recorded else 0.5 * (min(edges) + max(edges))
        wide = _rate_over_bandwidth(schedules) * (max(edges) - min(edges)) if edges else 0.0
        rate = sample_rate or (recorded[0].sample_rate if recorded else wide)
        signals = [_signal(one, rate, centre) for one in (a, b)]
        signals[0] = comparable(signals[0], signals[1])
    about = [_about_zero(one, compare_basebands) for one in (a, b)]
    return Pair(
        title=_title(a, b, signals[1], compare_basebands),
        a=signals[0],
        b=signals[1],
        a_schedule=about[0],
        b_schedule=about[1],
        is_ideal=not recorded,
    )


def _rate_over_bandwidth(schedules: list[RampSchedule]) -> float:
    if len(schedules) == 2 and _gap(*schedules) > 0:
        return DISJOINT_RATE_OVER_BANDWIDTH
    return RATE_OVER_BANDWIDTH


def _title(a: Operand, b: Operand, signal: Baseband, compare_basebands: bool) -> str:
    what = f"{a.name} with itself" if a is b else f"{a.name} with {b.name}"
    where = "at baseband" if compare_basebands else f"about {signal.centre_frequency / 1e9:.6g} GHz"
    return f"{what}, {where}, {signal.sample_rate / 1e6:.6g} MS/s"


def _signal(one: Operand, rate: float, centre: float | None) -> Baseband:
    if one.recording is not None:
        return replace(_whole(one.name, one.recording), start_time=0.0).resampled(rate)
    assert one.schedule is not None
    return played(one.schedule, sample_rate=rate, centre_frequency=centre)


def _whole(name: str, recording: SigmfRecording) -> Baseband:
    """All samples of a recording; raises `InputError` if they are more than `MOST_IN_MEMORY`."""
    if recording.num_samples > MOST_IN_MEMORY:
        raise InputError(
            f"'{name}' has {recording.num_samples:.3g} samples, too many for memory at "
            "once; look for a shorter reference in it with --search"
        )
    return recording.signal()


def _about_zero(one: Operand, compare_basebands: bool) -> RampSchedule | None:
    """Schedule for the closed form; for basebands, its band is centred on `COMMON_CARRIER`."""
    if one.schedule is None or not compare_basebands:
        return one.schedule
    low, high = band_edges(one.schedule)
    moved = one.schedule.start_frequency + (COMMON_CARRIER - 0.5 * (low + high))
    return replace(one.schedule, start_frequency=moved)


def fine_step(pair: Pair) -> int:
    """Lags per sample: 16, or halved until there are `MOST_LAGS` at most or 1 per sample."""
    lags = pair.a.num_samples + pair.b.num_samples
    step = 16
    while step > 1 and step * lags > MOST_LAGS:
        step //= 2
    return step


def closed_form(pair: Pair, lag: FloatArray) -> Correlation | None:
    """Correlation of an ideal pair in closed form; None if ramps are unknown, too many or coded."""
    a, b = pair.a_schedule, pair.b_schedule
    if not pair.is_ideal or a is None or b is None:
        return None
    if a.code is not None or b.code is not None:
        return None
    if a.num_ramps * b.num_ramps * lag.size > MOST_TERMS:
        return None
    return expected(a, b, lag)


def aligned_pair(pair: Pair, *, greatest_offset: float = 0.0) -> tuple[Pair, dict[str, float]]:
    """The pair without delay and frequency offset of ``a``, and the removed values, s and Hz."""
    found = aligned(pair.a, pair.b, greatest_offset=greatest_offset)
    taken = {"delay": found.delay}
    if greatest_offset > 0:
        taken["frequency offset"] = found.frequency_offset
    return replace(pair, a=found.signal), taken


def reference_for(
    recording: SigmfRecording, operand: Operand, *, compare_basebands: bool = False
) -> Baseband:
    """An operand as a reference for a long recording, at its rate and carrier.

    `InputError` is raised if the operand is a recording that is too long itself, or shares no
    frequency with the other.
    """
    rate = recording.sample_rate
    if compare_basebands:
        return at_baseband(_signal(operand, rate, None))
    if operand.recording is None:
        return _signal(operand, rate, recording.centre_frequency)
    other = _whole(operand.name, operand.recording)
    here = Baseband(
        samples=np.zeros(1, dtype=np.complex128),
        sample_rate=rate,
        centre_frequency=recording.centre_frequency,
    )
    return comparable(other, here)


def ambiguity_of(
    pair: Pair, *, greatest_doppler: float, progress: Progress = no_progress
) -> Ambiguity:
    """Ambiguity function of a pair about lag 0, for a picture; ``greatest_doppler`` is in Hz."""
    reach = min(0.5 * NUM_DELAYS / pair.a.sample_rate, pair.b.duration)
    doppler = np.linspace(-greatest_doppler, greatest_doppler, NUM_DOPPLERS)
    return ambiguity(pair.a, pair.b, doppler=doppler, greatest_lag=reach, progress=progress)


def through_model(pair: Pair, *, snr: float, seed: int) -> Pair:
    """The pair after ``a`` passed the model of the paper's transceivers; ``snr`` is a ratio."""
    radio = _radio_for(pair)
    signal = _tuned(pair.a, radio)
    record = transceived(
        signal,
        transmitter=radio,
        receiver=radio,
        link=link_for(snr, signal, transmitter=radio, receiver=radio),
        receive_frequency=signal.centre_frequency,
        streams=Streams(seed).of("correlate"),
    )
    received = replace(record, centre_frequency=pair.b.centre_frequency)
    return replace(pair, a=received, is_ideal=False)


def through_radio(pair: Pair, radio: Radio, *, i_hold_a_licence: bool) -> Pair:
    """The pair after a radio has played and recorded ``a``, aligned with the original ``a``.

    `InputError` is raised if the signal has no carrier but the radio needs one, or
    `radio.base.measured` refuses.
    """
    if pair.a.centre_frequency == 0.0 and radio.abilities.radiates:
        raise InputError("a radio needs a signal with a carrier; leave out --baseband")
    record = measured(radio, pair.a, repetitions=1, i_hold_a_licence=i_hold_a_licence)
    return replace(pair, a=aligned(record, pair.a).signal, is_ideal=False)


def _radio_for(pair: Pair) -> Transceiver:
    """Transceiver of the paper at the rate of the pair, with its filter scaled in proportion."""
    usual = Transceiver()
    scale = pair.a.sample_rate / usual.sample_rate
    assert usual.filter is not None
    return replace(
        usual,
        sample_rate=pair.a.sample_rate,
        filter=replace(
            usual.filter,
            passband=scale * usual.filter.passband,
            stopband=scale * usual.filter.stopband,
        ),
        highest_carrier=max(usual.highest_carrier, pair.a.centre_frequency),
    )


def _tuned(signal: Baseband, radio: Transceiver) -> Baseband:
    """The signal with magnitudes of 1 at most, at the radio's lowest carrier if it has none."""
    strongest = float(np.abs(signal.samples).max())
    return replace(
        signal,
        samples=signal.samples / max(1.0, strongest),
        centre_frequency=signal.centre_frequency or radio.lowest_carrier,
    )
