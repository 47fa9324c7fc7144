"""What a receiver's output is made of: the same linear steps, applied to each kept-apart part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS, IfFrame, IfParts
from polychirp.receiver.beamform import beamform, orthogonal_sines, steering
from polychirp.receiver.chain import Receiver, present_samples, search_grid
from polychirp.receiver.joint import log_range_rate_map, log_spectra, spectrum_size
from polychirp.receiver.point import beat_phase, fit_amplitudes, hann_weights


def part_powers(
    receiver: Receiver, frame: IfFrame, parts: IfParts, detections: Detections
) -> FloatArray:
    r"""Power that each part puts into each detection, W, ``(detection, part)`` as in `PARTS`.

    The part is blanked where the whole was, steered to the detection's azimuth and matched to a
    point of its range and rate on every ramp; the geometric mean over ramps is taken, as the
    detector does. A part that beats like the detection on all ramps *is* the detection. One that
    the frame does not have puts in nothing.
    """
    present = present_samples(receiver, frame)
    weight = hann_weights(present)
    motion = np.stack(
        [detections.range, detections.range_rate, np.zeros(detections.num_detections)], axis=-1
    )
    phases = beat_phase(frame.schedule, frame.times, motion=motion, time=detections.time)
    weights = _steering(frame, np.sin(detections.azimuth))
    out = np.zeros((detections.num_detections, len(PARTS)))
    column = [PARTS.index(part) for part in parts.names]
    stacked = (parts.samples * present).reshape(-1, *present.shape)  # parts and channels
    for n in range(detections.num_detections):
        amplitude, _ = fit_amplitudes(stacked, weight, phases[n : n + 1], frame.times.rate)
        by_part = amplitude[0].reshape(len(column), -1, frame.schedule.num_ramps)
        power = np.abs(np.einsum("c,pck->pk", weights[n], by_part)) ** 2
        out[n, column] = np.exp(np.mean(np.log(np.maximum(power, 1e-300)), axis=1))
    return out


def floor_rise(receiver: Receiver, frame: IfFrame, parts: IfParts) -> float:
    """How far disturbance lifts the floor of the range spectra: power ratio, 1 for not at all.

    Floor: median over the range cells up to the receiver's greatest range of the spectrum's mean
    power over beams and ramps; a ghost fills few cells and does not count. Compared are
    interference, leakage, distortion and noise together with noise alone, all blanked where the
    whole was.
    """
    present = present_samples(receiver, frame)
    weight = hann_weights(present)
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
    return floor(disturbance) / floor(parts.noise)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangeResponse:
    """The range-rate map seen along range.

    Parameters
    ----------
    range : m, ``(range,)``
    power : W of one channel, ``(range,)``: geometric mean over ramps, strongest beam and range
        rate, the array's gain taken out
    noise : W, the same for thermal noise alone, mean over range
    """

    range: FloatArray
    power: FloatArray
    noise: float


def range_response(receiver: Receiver, frame: IfFrame, parts: IfParts) -> RangeResponse:
    """Power over range after all ramps are brought together, as the detector sees it."""
    present = present_samples(receiver, frame)
    weight = hann_weights(present)
    grid = search_grid(receiver, frame, float(frame.schedule.start_time[0]))
    size = spectrum_size(frame.times)
    beams = _steering(frame, orthogonal_sines(frame.array.num_channels))

    def along_range(samples: ComplexArray) -> FloatArray:
        logs = log_spectra(beamform(samples * present, beams), weight, size)
        statistic = log_range_rate_map(logs, frame.schedule, frame.times, grid)
        return np.asarray(np.exp(statistic.max(axis=(0, 1))))

    # a tone of power P per channel gives a cell of P M (Σw)²/Σw²: shown is P
    gain = frame.array.num_channels * float(
        np.mean(np.sum(weight, axis=1) ** 2 / np.sum(weight**2, axis=1))
    )
    return RangeResponse(
        range=grid.range,
        power=along_range(frame.samples) / gain,
        noise=float(np.mean(along_range(parts.noise))) / gain,
    )


def _steering(frame: IfFrame, sine: FloatArray) -> ComplexArray:
    frequency = float(np.mean(frame.schedule.centre_frequency))
    return steering(frame.array, frequency=frequency, sine=sine)
