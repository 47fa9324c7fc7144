"""Attribution of detections and floor to echo, interference and noise, through linear steps."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.ndimage import uniform_filter1d

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import direction_of
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS, IfFrame, IfParts
from polychirp.model.ramp import RampSchedule
from polychirp.model.target_levels import TargetLevels
from polychirp.model.truth import Truth
from polychirp.receiver.angle.beamform import steering
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.parts import PartPowers
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.receiver.selection import FrameReceiver
from polychirp.receiver.signal_model.point_signal import (
    beat_frequency,
    beat_phase,
    hann_weights,
    matched_amplitudes,
)
from polychirp.receiver.signal_model.power_spectra import power_spectra, spectrum_size
from polychirp.receiver.stepped.chain import MfskReceiver, in_sequences, noise_of_sequences

NOISE_BINS: Final = 129
"""Number of bins, half a resolution cell apart, over which the noise of a ramp about a beat is
averaged. Chosen: with four channels, the noise of two ramps is then known to a quarter of a
decibel."""

ENOUGH_SPECTRA: Final = 8
"""Number of spectra, of channels times ramps, from which on fewer than `NOISE_BINS` bins tell the
noise of a cell as accurately. Chosen: four channels and two ramps."""

FEWEST_NOISE_BINS: Final = 3
"""Least number of these bins; chosen: they are narrower than the main lobe of a taper."""

FILLED_SPECTRA: Final = 1024
"""Number of spectra of which a single bin tells the noise of a cell where mitigation fills gaps, to
3 % where ramps count alike; chosen."""

MOST_COPIES: Final = 16
"""Greatest number of copies of the noise that are repaired; chosen: some repairs take half a second
for each copy. The noise of two ramps of four channels is then known to a tenth."""


def attribute(receiver: FrameReceiver, frame: IfFrame) -> tuple[Detections, PartPowers]:
    """Detections of a frame, and the function that gives the power of any parts in each.

    The coherent receiver fits its points to each part (`coherent.parts`). For other receivers it is
    the power of `part_amplitudes`, combined over ramps as the receiver combines them
    (``combined_power``; a plug-in without it combines them in phase). The part that has the
    detection's beats on all ramps causes it. A code is removed from the frame and from its parts
    first.
    """
    if isinstance(receiver, CoherentReceiver):
        return receiver.attribute(frame)
    if isinstance(receiver, Decoding):
        read = receiver.reading(frame)
        found = receiver.detect_in(read, frame)
        of_decoded = _matched_powers(read.receiver, read.frame, found)
        return found, lambda samples: of_decoded(read.decode(samples))
    found = receiver.detect(frame)
    return found, _matched_powers(receiver, frame, found)


def _matched_powers(receiver: FrameReceiver, frame: IfFrame, found: Detections) -> PartPowers:
    """The function that gives the power of any parts in each detection by `part_amplitudes`."""

    def powers_of(samples: ComplexArray) -> FloatArray:
        amplitude = part_amplitudes(receiver, frame, samples, found)
        combined = getattr(receiver, "combined_power", in_phase)
        return np.asarray(combined(amplitude, frame.schedule))

    return powers_of


def in_phase(amplitude: ComplexArray, schedule: RampSchedule) -> FloatArray:
    """Power, W, of amplitudes ``(…, ramp)`` that add up in phase over all ramps."""
    del schedule
    return np.asarray(np.abs(np.mean(amplitude, axis=-1)) ** 2)


def detected(
    receiver: FrameReceiver, frame: IfFrame, parts: IfParts
) -> tuple[Detections, FloatArray]:
    """Detections of a frame, and the power of each part in each, W, ``(detection, part)``.

    The parts are in the order of `PARTS`; those that the frame lacks have 0.
    """
    found, powers_of = attribute(receiver, frame)
    return found, powers_in(parts, powers_of)


def powers_in(parts: IfParts, powers_of: PartPowers) -> FloatArray:
    """Power of each of `PARTS` in each detection, W, ``(detection, part)``; 0 if absent."""
    power = powers_of(parts.samples)
    out = np.zeros((len(power), len(PARTS)))
    out[:, [PARTS.index(part) for part in parts.names]] = power
    return out


def part_amplitudes(
    receiver: FrameReceiver,
    frame: IfFrame,
    parts: ComplexArray,
    detections: Detections,
    *,
    motion: ComplexArray | None = None,
) -> ComplexArray:
    """Amplitude of each of ``parts`` at each detection: V, ``(detection, part, ramp)``.

    ``parts`` are samples before mitigation, V ``(part, channel, ramp, fast)``. ``motion`` are
    factors of the channels of a decoded frame, ``(detection, channel)`` (`phases_in_motion`); None
    for ones.

    The mitigation that was chosen for the whole frame is applied to each part. The part is then
    steered to the detection's direction and matched to a point of its range and range rate on every
    ramp, with the receiver's taper along the ramp. These steps are linear, so that the amplitudes
    of all parts add up to that of the frame.
    """
    cleaned = mitigated(receiver.mitigation, frame)
    weight = _tapered(receiver, cleaned.weight)
    place = np.stack(
        [detections.range, detections.range_rate, np.zeros(detections.num_detections)], axis=-1
    )
    phases = beat_phase(frame.schedule, frame.times, motion=place, time=detections.time)
    _, sine, rise = direction_of(
        np.nan_to_num(detections.azimuth), np.nan_to_num(detections.elevation)
    ).T
    frequency = float(np.mean(frame.schedule.centre_frequency))
    weights = steering(frame.array, frequency=frequency, sine=sine, rise=rise)
    if motion is not None:
        weights = weights * motion.conj()
    stacked = cleaned.repair(parts).reshape(-1, *weight.shape)  # part × channel
    amplitude = matched_amplitudes(stacked, weight, phases, frame.times.rate)
    by_part = amplitude.reshape(len(place), *parts.shape[:3])
    return np.asarray(np.einsum("nc,npck->npk", weights, by_part))


def _tapered(receiver: FrameReceiver, present: FloatArray) -> FloatArray:
    """Weights of samples ``(ramp, fast)``, those left by mitigation times the receiver's taper."""
    if isinstance(receiver, RangeDoppler):
        return present * taper(present.shape[1])
    if isinstance(receiver, MfskReceiver):
        return present  # the mean of a step's samples
    return hann_weights(present)


def _noise_powers(
    receiver: FrameReceiver, frame: IfFrame, noise: ComplexArray, cells: Detections
) -> FloatArray:
    """Expected noise power of `part_amplitudes` in cells, W ``(cell, ramp)``.

    In the cell alone, one draw of noise would stand for its power. A ramp's noise is therefore the
    mean over channels and `NOISE_BINS` bins of the spectra about the beat, times the share of that
    mean that the few bins about the cell have in all ramps together (`_num_noise_bins`): behind a
    high-pass, and at the edge of the IF filter, the noise changes within `NOISE_BINS` bins.

    Where mitigation fills gaps, it continues the noise of the echo's own beat into them, as it does
    the echo: that noise is in the echo's bin, and differs from ramp to ramp. Each ramp's noise is
    then that of the nearest bin, and copies of the noise at other frequencies, each repaired like
    the noise itself, make up for few ramps.
    """
    cleaned = mitigated(receiver.mitigation, frame)
    weight, times = _tapered(receiver, cleaned.weight), frame.times
    size = spectrum_size(times)
    repaired = cleaned.repair(noise)
    is_filled = not np.array_equal(repaired, noise * (cleaned.weight > 0.0))
    copies = _num_copies(len(noise) * len(weight)) if is_filled else 1
    power = power_spectra(repaired, weight, size).mean(axis=0) / copies
    for copy in _shifted_copies(noise, copies - 1, size):
        power += power_spectra(cleaned.repair(copy), weight, size).mean(axis=0) / copies
    beat = beat_frequency(
        frame.schedule,
        times,
        distance=cells.range,
        range_rate=cells.range_rate,
        time=cells.time,
    )
    number = np.rint(beat / times.rate * size).astype(np.int64) % size
    ramp = np.arange(len(power))

    def about_the_beat(bins: int) -> FloatArray:
        return uniform_filter1d(power, min(bins, size), axis=1, mode="wrap")[ramp, number]

    # a ramp that mitigation has taken out has neither noise nor echo
    scale = np.sum(weight**2, axis=1) / np.maximum(np.sum(weight, axis=1), 1e-100) ** 2
    if is_filled:
        return np.asarray(power[ramp, number] * scale)
    wide = about_the_beat(NOISE_BINS)
    near = about_the_beat(_num_noise_bins(len(noise) * len(weight)))
    share = near.sum(axis=1) / np.maximum(wide.sum(axis=1), 1e-300)
    return np.asarray(share[:, None] * wide * scale)


def _num_copies(num_spectra: int) -> int:
    """Number of copies of the noise of so many spectra with which a single bin tells it.

    >>> [_num_copies(number) for number in (1, 8, 64, 4096)]
    [16, 16, 16, 1]
    """
    return min(MOST_COPIES, math.ceil(FILLED_SPECTRA / num_spectra))


def _shifted_copies(noise: ComplexArray, count: int, size: int) -> Iterator[ComplexArray]:
    """Copies of the noise, up to half of `NOISE_BINS` bins of ``size`` away.

    Copies of real noise are real, and are shifted up and down at once.
    """
    half = NOISE_BINS // 2
    cycles = np.linspace(-half, half, count)[:, None] / size * np.arange(noise.shape[-1])
    is_real = not np.any(noise.imag)
    for number, turn in enumerate(2.0 * np.pi * cycles):
        # a quarter turn between copies lets the envelopes of real ones add up to a constant
        tone = np.sqrt(2.0) * np.cos(turn + 0.5 * np.pi * number) if is_real else np.exp(1j * turn)
        yield noise * tone


def _num_noise_bins(num_spectra: int) -> int:
    """Odd number of bins over which the noise of so many spectra together is averaged.

    >>> [_num_noise_bins(number) for number in (1, 8, 64, 4096)]
    [129, 129, 17, 3]
    """
    wanted = NOISE_BINS * ENOUGH_SPECTRA / num_spectra
    return 2 * math.floor(0.5 * min(max(wanted, FEWEST_NOISE_BINS), NOISE_BINS)) + 1


def target_levels(
    receiver: FrameReceiver,
    frame: IfFrame,
    parts: IfParts,
    truth: Truth,
    *,
    motion: ComplexArray | None = None,
) -> TargetLevels:
    r"""Echo and interference over noise that the receiver's filter finds at each true target.

    With the amplitudes :math:`e_k` and :math:`i_k` of `part_amplitudes` on ramp k, of echo and
    multipath and of all other parts but noise, the expected power :math:`N_k` of the noise, and the
    receiver's taper :math:`w_k` over the ramps (`RangeDoppler`; 1 for others), the filter matched
    to the echo's own phases over the frame gives

    .. math:: \mathrm{SNR} = \frac{(\sum_k w_k |e_k|^2)^2}{\sum_k w_k^2 |e_k|^2 N_k},\qquad
              \mathrm{INR} = \frac{|\sum_k w_k e_k^* i_k|^2}{\sum_k w_k^2 |e_k|^2 N_k}.

    So all ramps and channels add up coherently, also if the receiver does not add them so. Parts
    are those after the receiver's mitigation. A target without echo has zeros. The receiver of MFSK
    has the tapered means of its two sequences in the place of ramps, since a step alone does not
    tell echoes apart.

    ``motion`` are factors of the channels of a decoded frame, ``(target, channel)``, without which
    the channels of elements that take turns would not add up for a moving target
    (`phases_in_motion`).
    """
    if isinstance(receiver, Decoding):
        return target_levels(*_decoded(receiver, frame, parts), truth)
    still = np.zeros(len(truth.name))
    cells = Detections(
        time=truth.time,
        range=truth.range,
        range_rate=truth.range_rate,
        azimuth=truth.azimuth,
        elevation=truth.elevation,
        power=still,
        snr=still,
    )
    amplitude = part_amplitudes(receiver, frame, parts.samples, cells, motion=motion)
    name = np.array(parts.names)
    is_own, is_noise = np.isin(name, ("echo", "multipath")), name == "noise"
    echo = amplitude[:, is_own].sum(axis=1)
    rest = amplitude[:, ~is_own & ~is_noise].sum(axis=1)
    noise = _noise_powers(receiver, frame, parts.noise, cells)
    along = np.ones(frame.schedule.num_ramps)
    if isinstance(receiver, RangeDoppler):
        along = receiver.ramp_taper(frame.schedule)
    elif isinstance(receiver, MfskReceiver):
        echo, rest = in_sequences(echo), in_sequences(rest)
        noise, along = noise_of_sequences(noise)[:, None], np.ones(echo.shape[1])
    energy = np.abs(echo) ** 2
    signal, added = energy @ along, np.abs(np.sum(along * echo.conj() * rest, axis=1)) ** 2
    floor = np.maximum(np.sum(along**2 * energy * noise, axis=1), 1e-300)
    return TargetLevels(snr=signal**2 / floor, inr=added / floor)


def floor_rise(receiver: FrameReceiver, frame: IfFrame, parts: IfParts) -> float:
    """Rise of the floor of the range spectra over thermal noise: power ratio, 1 for no rise.

    It is NaN if the mitigation leaves no noise, since it takes every sample out.

    The power averaged over channels has a median over range cells, up to the receiver's greatest
    range. The floor is the mean of these medians over ramps; a ghost fills few cells and hardly
    changes it. The floor of interference, leakage, distortion and noise together is divided by
    that of noise alone, both after the mitigation that was chosen for the whole frame. The receiver
    of MFSK has one spectrum of all steps, with beats of all signs.
    """
    if isinstance(receiver, Decoding):
        return floor_rise(*_decoded(receiver, frame, parts))
    disturbance = parts.total("direct", "indirect", "leakage", "distortion", "noise")
    if isinstance(receiver, MfskReceiver):
        medians = [
            np.median(receiver.steps_of(frame, samples).power)
            for samples in (disturbance, parts.noise)
        ]
        return _over(float(medians[0]), float(medians[1]))
    cleaned = mitigated(receiver.mitigation, frame)
    weight = hann_weights(cleaned.weight)
    size = spectrum_size(frame.times)
    farthest = 2.0 * np.abs(frame.schedule.slope) * receiver.greatest_range / SPEED_OF_LIGHT
    frequency = np.fft.fftfreq(size, 1.0 / frame.times.rate)
    side = np.sign(frame.schedule.slope)[:, None] * frequency
    inside = (side > 0) & (side < farthest[:, None])

    def floor(samples: ComplexArray) -> float:
        power = power_spectra(samples, weight, size).mean(axis=0)
        medians = [np.median(power[k, inside[k]]) for k in range(power.shape[0])]
        return float(np.mean(medians))

    return _over(floor(cleaned.repair(disturbance)), floor(cleaned.repair(parts.noise)))


def _over(power: float, noise: float) -> float:
    """Ratio of a power to that of noise; NaN without noise."""
    return power / noise if noise > 0.0 else math.nan


def _decoded(
    receiver: Decoding, frame: IfFrame, parts: IfParts
) -> tuple[RangeDoppler, IfFrame, IfParts]:
    """The receiver of the decoded frame, that frame, and its parts."""
    read = receiver.reading(frame)
    samples = read.decode(parts.samples)
    return read.receiver, read.frame, replace(parts, samples=samples)
