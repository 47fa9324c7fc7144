"""Attribution of detections and floor to echo, interference and noise, through linear steps."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np
from scipy.ndimage import uniform_filter1d

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
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
from polychirp.receiver.mitigation.base import Repair, mitigated
from polychirp.receiver.own_echo import own_echoes, tells_rates_apart
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.subframes import has_subframes, subframes
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
from polychirp.receiver.stepped.steps import SEQUENCES
from polychirp.threads import one_blas_thread

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
    given: Any = receiver.detect(frame)
    if not isinstance(given, Detections):  # a receiver of another package may return anything
        raise InputError(
            f"'detect' of {type(receiver).__name__} returns {type(given).__name__}; "
            "return polychirp.Detections"
        )
    return given, _matched_powers(receiver, frame, given)


def _matched_powers(receiver: FrameReceiver, frame: IfFrame, found: Detections) -> PartPowers:
    """The function that gives the power of any parts in each detection by `part_amplitudes`."""
    scale = _scales_of_ramps(receiver, frame)

    def powers_of(samples: ComplexArray) -> FloatArray:
        amplitude = part_amplitudes(receiver, frame, samples, found) * scale
        combined = getattr(receiver, "combined_power", in_phase)
        return np.asarray(combined(amplitude, frame.schedule))

    return powers_of


def _shares_left(receiver: FrameReceiver, frame: IfFrame) -> FloatArray:
    """Share of the tapered weights of each ramp's samples that mitigation leaves, ``(ramp,)``."""
    left, whole = (
        _tapered(receiver, mitigated(method, frame).weight).sum(axis=1)
        for method in (receiver.mitigation, None)
    )
    return np.asarray(left / np.maximum(whole, 1e-300))


def _scales_of_ramps(receiver: FrameReceiver, frame: IfFrame) -> FloatArray:
    """Factors ``(ramp,)`` of `part_amplitudes` with which the receiver adds them up.

    The range-Doppler receiver and that of MFSK add up samples, of which mitigation leaves few on
    some ramps, and divide once, by all that are left in a subframe or a sequence. Others count
    ramps alike.
    """
    if isinstance(receiver, RangeDoppler):
        along = receiver.ramp_taper(frame.schedule)
        whole = (np.arange(along.size),)
        sets = subframes(frame.schedule) if has_subframes(frame.schedule) else whole
    elif isinstance(receiver, MfskReceiver):
        along = np.repeat(taper(frame.schedule.num_ramps // SEQUENCES), SEQUENCES)
        sets = tuple(np.arange(first, along.size, SEQUENCES) for first in range(SEQUENCES))
    else:
        return np.ones(frame.schedule.num_ramps)
    share = _shares_left(receiver, frame)
    for some in sets:
        mean = np.sum(along[some] * share[some]) / max(float(np.sum(along[some])), 1e-300)
        share[some] /= max(float(mean), 1e-300)
    return share


def in_phase(amplitude: ComplexArray, schedule: RampSchedule) -> FloatArray:
    """Power, W, of amplitudes ``(…, ramp)`` that add up in phase over all ramps."""
    del schedule
    return np.asarray(np.abs(np.mean(amplitude, axis=-1)) ** 2)


@one_blas_thread()
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
    weights = _beams(frame, detections, motion)
    stacked = cleaned.repair(parts).reshape(-1, *weight.shape)  # part × channel
    amplitude = matched_amplitudes(stacked, weight, phases, frame.times.rate)
    by_part = amplitude.reshape(len(place), *parts.shape[:3])
    return np.asarray(np.einsum("nc,npck->npk", weights, by_part))


def _beams(frame: IfFrame, cells: Detections, motion: ComplexArray | None) -> ComplexArray:
    """Weights ``(cell, channel)`` that steer the channels to the direction of each cell."""
    _, sine, rise = direction_of(np.nan_to_num(cells.azimuth), np.nan_to_num(cells.elevation)).T
    frequency = float(np.mean(frame.schedule.centre_frequency))
    weights = steering(frame.array, frequency=frequency, sine=sine, rise=rise)
    return weights if motion is None else np.asarray(weights * motion.conj())


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
    weight, size = _tapered(receiver, cleaned.weight), spectrum_size(frame.times)
    repaired = cleaned.repair(noise)
    is_filled = not np.array_equal(repaired, noise * (cleaned.weight > 0.0))
    copies = _num_copies(len(noise) * len(weight)) if is_filled else 1
    power = power_spectra(repaired, weight, size).mean(axis=0) / copies
    for copy in _shifted_copies(noise, copies - 1, size):
        power += power_spectra(cleaned.repair(copy), weight, size).mean(axis=0) / copies
    number = _bins_of_beats(frame, cells, size)
    if is_filled:
        return np.asarray(power[np.arange(len(power)), number] * _white_noise(weight))
    share = _shares_about_beats(power, number, num_spectra=len(noise) * len(weight))
    wide = _about_beats(power, number, bins=NOISE_BINS)
    return np.asarray(share[:, None] * wide * _white_noise(weight))


def _mixes_channels(repair: Repair, noise: ComplexArray) -> bool:
    """True if noise of one channel is in others after a repair, as where directions are removed."""
    if len(noise) == 1:
        return False
    alone = noise.copy()
    alone[1:] = 0.0
    return bool(np.any(repair(alone)[1:]))


def _steered_noise_powers(
    receiver: FrameReceiver,
    frame: IfFrame,
    noise: ComplexArray,
    cells: Detections,
    *,
    motion: ComplexArray | None,
) -> FloatArray:
    """`_noise_powers` where channels have noise in common: that in the direction of each cell.

    Gaps are not taken for filled.
    """
    cleaned = mitigated(receiver.mitigation, frame)
    weight, repaired = _tapered(receiver, cleaned.weight), cleaned.repair(noise)
    size = spectrum_size(frame.times)
    number = _bins_of_beats(frame, cells, size)
    of_channels = power_spectra(repaired, weight, size).mean(axis=0)
    share = _shares_about_beats(of_channels, number, num_spectra=len(noise) * len(weight))
    out = np.empty(number.shape)
    for n, beam in enumerate(_beams(frame, cells, motion)):
        power = power_spectra(np.tensordot(beam, repaired, axes=1)[None], weight, size)[0]
        out[n] = _about_beats(power, number[[n]], bins=NOISE_BINS)[0]
    return share[:, None] * out * _white_noise(weight)


def _about_beats(power: FloatArray, number: IntArray, *, bins: int) -> FloatArray:
    """Mean ``(cell, ramp)`` of spectra ``(ramp, bin)`` over ``bins`` about those of ``number``."""
    mean = uniform_filter1d(power, min(bins, power.shape[1]), axis=1, mode="wrap")
    return np.asarray(mean[np.arange(len(power)), number])


def _shares_about_beats(power: FloatArray, number: IntArray, *, num_spectra: int) -> FloatArray:
    """Power in the few bins about a cell over that in `NOISE_BINS`, of all ramps, ``(cell,)``."""
    near, wide = (
        _about_beats(power, number, bins=bins).sum(axis=1)
        for bins in (_num_noise_bins(num_spectra), NOISE_BINS)
    )
    return np.asarray(near / np.maximum(wide, 1e-300))


def _white_noise(weight: FloatArray) -> FloatArray:
    """Power of white noise of 1 W per sample in `part_amplitudes` of weights, ``(ramp,)``.

    A ramp that mitigation has taken out has neither noise nor echo.
    """
    total = np.maximum(np.sum(weight, axis=1), 1e-100)
    return np.asarray(np.sum(weight**2, axis=1) / total**2)


def _bins_of_beats(frame: IfFrame, cells: Detections, size: int) -> IntArray:
    """Bins of spectra of a ``size`` that are nearest to the beats of cells, ``(cell, ramp)``."""
    beat = beat_frequency(
        frame.schedule,
        frame.times,
        distance=cells.range,
        range_rate=cells.range_rate,
        time=cells.time,
    )
    return np.asarray(np.rint(beat / frame.times.rate * size).astype(np.int64) % size)


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
    multipath, as far as they move as the target does (`own_echo`; all of them for the receiver of
    MFSK), and of all other parts but noise, the expected power :math:`N_k` of the noise, and the
    weight :math:`w_k` of the ramp, which is the receiver's taper over the ramps (`RangeDoppler`; 1
    for others) times the share of the ramp's samples that mitigation leaves, the filter matched to
    the echo's own phases over the frame gives

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
    cells = _cells(truth)
    whole = _echoes_before_mitigation(receiver, frame, parts, cells, motion)
    if isinstance(receiver, Decoding):
        read = receiver.reading(frame)
        decoded = replace(parts, samples=read.decode(parts.samples))
        is_mixed = receiver.mitigation is not None and _mixes_channels(read.decode, parts.noise)
        return _levels(
            read.receiver, read.frame, decoded, cells, whole, is_mixed=is_mixed, left=read.left
        )
    repair = mitigated(receiver.mitigation, frame).repair
    is_mixed = _mixes_channels(repair, parts.noise)
    return _levels(receiver, frame, parts, cells, whole, motion=motion, is_mixed=is_mixed)


def _cells(truth: Truth) -> Detections:
    """The cells of true targets, as if each were detected."""
    still = np.zeros(len(truth.name))
    return Detections(
        time=truth.time,
        range=truth.range,
        range_rate=truth.range_rate,
        azimuth=truth.azimuth,
        elevation=truth.elevation,
        power=still,
        snr=still,
    )


def _echoes_before_mitigation(
    receiver: FrameReceiver,
    frame: IfFrame,
    parts: IfParts,
    cells: Detections,
    motion: ComplexArray | None,
) -> ComplexArray | None:
    """Amplitudes of the echoes in cells, V ``(cell, ramp)``; None where nobody needs them."""
    if receiver.mitigation is None or not tells_rates_apart(frame.schedule):
        return None
    bare, echo = replace(receiver, mitigation=None), parts.echo[None]
    if isinstance(bare, Decoding):
        read = bare.reading(frame)
        bare, frame, echo = read.receiver, read.frame, read.decode(echo)
    return part_amplitudes(bare, frame, echo, cells, motion=motion)[:, 0]


def _levels(
    receiver: FrameReceiver,
    frame: IfFrame,
    parts: IfParts,
    cells: Detections,
    whole: ComplexArray | None,
    *,
    is_mixed: bool,
    motion: ComplexArray | None = None,
    left: FloatArray | None = None,
) -> TargetLevels:
    """`target_levels` of a frame without a code.

    ``whole`` are the echoes before mitigation; None for those after it. ``is_mixed`` is true if
    channels have noise in common; ``left`` is `Reading.left`.
    """
    amplitude = part_amplitudes(receiver, frame, parts.samples, cells, motion=motion)
    name = np.array(parts.names)
    is_own, is_noise = np.isin(name, ("echo", "multipath")), name == "noise"
    echo = amplitude[:, is_own].sum(axis=1)
    rest = amplitude[:, ~is_own & ~is_noise].sum(axis=1)
    if is_mixed:
        noise = _steered_noise_powers(receiver, frame, parts.noise, cells, motion=motion)
    else:
        noise = _noise_powers(receiver, frame, parts.noise, cells)
    along = _shares_left(receiver, frame)
    if left is not None:  # amplitudes as if nothing were missing, as of `part_amplitudes`
        share, along = np.maximum(left, 1e-6), along * left
        echo, rest, noise = echo / share, rest / share, noise / share**2
    if isinstance(receiver, RangeDoppler):
        along = along * receiver.ramp_taper(frame.schedule)
    elif isinstance(receiver, MfskReceiver):
        scale = _scales_of_ramps(receiver, frame)
        echo, rest = in_sequences(scale * echo), in_sequences(scale * rest)
        noise, along = noise_of_sequences(scale**2 * noise)[:, None], np.ones(echo.shape[1])
    if not isinstance(receiver, MfskReceiver):
        echo = own_echoes(echo, echo if whole is None else whole, frame, cells)
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
