"""Attribution of detections and floor to echo, interference and noise, through linear steps."""

from dataclasses import dataclass

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import direction_of
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS, IfFrame, IfParts
from polychirp.model.target_levels import TargetLevels
from polychirp.model.truth import Truth
from polychirp.receiver.angle.beamform import beamform, orthogonal_sines, steering
from polychirp.receiver.chain import Receiver, search_grid
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.detection.range_rate_map import (
    log_range_rate_map,
    log_spectra,
    spectrum_size,
)
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.selection import FrameReceiver
from polychirp.receiver.signal_model.point_signal import (
    beat_phase,
    hann_weights,
    matched_amplitudes,
)


def detected(
    receiver: FrameReceiver, frame: IfFrame, parts: IfParts
) -> tuple[Detections, FloatArray]:
    r"""Detections of a frame, and the power of each part in each, W, ``(detection, part)``.

    The parts are in the order of `PARTS`; those that the frame lacks have 0. The coherent receiver
    fits its points to each part (`coherent.parts`). For other receivers it is the power of
    `part_amplitudes`, combined over ramps as the receiver combines them (``combined_power``). The
    part that has the detection's beats on all ramps causes it.
    """
    if isinstance(receiver, CoherentReceiver):
        found, power = receiver.detect_parts(frame, parts)
    else:
        found = receiver.detect(frame)
        amplitude = part_amplitudes(receiver, frame, parts, found)
        power = receiver.combined_power(amplitude, frame.schedule)
    out = np.zeros((found.num_detections, len(PARTS)))
    out[:, [PARTS.index(part) for part in parts.names]] = power
    return found, out


def part_amplitudes(
    receiver: FrameReceiver, frame: IfFrame, parts: IfParts, detections: Detections
) -> ComplexArray:
    """Amplitude of each of ``parts`` at each detection: V, ``(detection, part, ramp)``.

    The mitigation that was chosen for the whole frame is applied to each part. The part is then
    steered to the detection's direction and matched to a point of its range and range rate on every
    ramp. These steps are linear, so that the amplitudes of all parts add up to that of the frame.
    """
    cleaned = mitigated(receiver.mitigation, frame)
    weight = hann_weights(cleaned.weight)
    motion = np.stack(
        [detections.range, detections.range_rate, np.zeros(detections.num_detections)], axis=-1
    )
    phases = beat_phase(frame.schedule, frame.times, motion=motion, time=detections.time)
    _, sine, rise = direction_of(
        np.nan_to_num(detections.azimuth), np.nan_to_num(detections.elevation)
    ).T
    weights = _steering(frame, sine, rise)
    stacked = cleaned.repair(parts.samples).reshape(-1, *weight.shape)  # part × channel
    amplitude = matched_amplitudes(stacked, weight, phases, frame.times.rate)
    by_part = amplitude.reshape(len(motion), *parts.samples.shape[:3])
    return np.asarray(np.einsum("nc,npck->npk", weights, by_part))


def target_levels(
    receiver: FrameReceiver, frame: IfFrame, parts: IfParts, truth: Truth
) -> TargetLevels:
    r"""Echo and interference over noise that a matched filter finds at each true target.

    With the amplitudes :math:`e_k`, :math:`i_k` and :math:`n_k` of `part_amplitudes` on ramp k, of
    echo and multipath, of noise, and of all other parts, the filter matched to the echo's own
    phases over the frame gives

    .. math:: \mathrm{SNR} = \frac{\sum_k |e_k|^2}{\overline{|n_k|^2}},\qquad
              \mathrm{INR} = \frac{|\sum_k e_k^* i_k|^2}{\sum_k |e_k|^2\;\overline{|n_k|^2}}.

    So all ramps and channels add up coherently, also if the receiver does not add them so. Parts
    are those after the receiver's mitigation. A target without echo has zeros.
    """
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
    amplitude = part_amplitudes(receiver, frame, parts, cells)
    name = np.array(parts.names)
    is_own, is_noise = np.isin(name, ("echo", "multipath")), name == "noise"
    echo = amplitude[:, is_own].sum(axis=1)
    rest = amplitude[:, ~is_own & ~is_noise].sum(axis=1)
    noise = np.mean(np.abs(amplitude[:, is_noise].sum(axis=1)) ** 2, axis=1)
    energy = np.sum(np.abs(echo) ** 2, axis=1)
    added = np.abs(np.sum(echo.conj() * rest, axis=1)) ** 2
    floor = np.maximum(noise, 1e-300)
    return TargetLevels(snr=energy / floor, inr=added / np.maximum(energy * floor, 1e-300))


def floor_rise(receiver: FrameReceiver, frame: IfFrame, parts: IfParts) -> float:
    """Rise of the floor of the range spectra over thermal noise: power ratio, 1 for no rise.

    The power averaged over channels has a median over range cells, up to the receiver's greatest
    range. The floor is the mean of these medians over ramps; a ghost fills few cells and hardly
    changes it. The floor of interference, leakage, distortion and noise together is divided by
    that of noise alone, both after the mitigation that was chosen for the whole frame.
    """
    cleaned = mitigated(receiver.mitigation, frame)
    weight = hann_weights(cleaned.weight)
    size = spectrum_size(frame.times)
    farthest = 2.0 * np.abs(frame.schedule.slope) * receiver.greatest_range / SPEED_OF_LIGHT
    frequency = np.fft.fftfreq(size, 1.0 / frame.times.rate)
    side = np.sign(frame.schedule.slope)[:, None] * frequency
    inside = (side > 0) & (side < farthest[:, None])

    def floor(samples: ComplexArray) -> float:
        power = np.exp(log_spectra(samples, weight, size)).mean(axis=0)
        medians = [np.median(power[k, inside[k]]) for k in range(power.shape[0])]
        return float(np.mean(medians))

    disturbance = parts.total("direct", "indirect", "leakage", "distortion", "noise")
    return floor(cleaned.repair(disturbance)) / floor(cleaned.repair(parts.noise))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangeResponse:
    """Maximum of the range-rate map over beams and range rates, as a function of range.

    Parameters
    ----------
    range : m, ``(range,)``
    power : W, ``(range,)``, geometric mean over ramps; a tone has the power that it has in one
        channel, without the array's gain
    noise : W, mean over range of the same quantity for thermal noise alone
    """

    range: FloatArray
    power: FloatArray
    noise: float


def range_response(receiver: Receiver, frame: IfFrame, parts: IfParts) -> RangeResponse:
    """Power over range from all ramps together, from the map in which the receiver detects."""
    cleaned = mitigated(receiver.mitigation, frame)
    weight = hann_weights(cleaned.weight)
    grid = search_grid(receiver, frame, float(frame.schedule.start_time[0]))
    size = spectrum_size(frame.times)
    beams = _steering(frame, orthogonal_sines(frame.array.num_channels))

    def along_range(samples: ComplexArray) -> FloatArray:
        logs = log_spectra(beamform(samples, beams), weight, size)
        statistic = log_range_rate_map(logs, frame.schedule, frame.times, grid)
        return np.asarray(np.exp(statistic.max(axis=(0, 1))))

    # a tone of power P per channel gives P M (Σw)²/Σw² in a cell of the beam of M channels
    gain = frame.array.num_channels * float(
        np.mean(np.sum(weight, axis=1) ** 2 / np.sum(weight**2, axis=1))
    )
    return RangeResponse(
        range=grid.range,
        power=along_range(cleaned.samples) / gain,
        noise=float(np.mean(along_range(cleaned.repair(parts.noise)))) / gain,
    )


def _steering(frame: IfFrame, sine: FloatArray, rise: FloatArray | None = None) -> ComplexArray:
    frequency = float(np.mean(frame.schedule.centre_frequency))
    return steering(frame.array, frequency=frequency, sine=sine, rise=rise)
