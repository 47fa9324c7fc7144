"""`Receiver` — from dechirped samples to detections, for ramps of any slopes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import Spec
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.angle import root_music
from polychirp.receiver.beamform import beamform, orthogonal_sines, steering
from polychirp.receiver.coherence import coherence
from polychirp.receiver.joint import (
    Grid,
    floor_over_range,
    log_range_rate_map,
    log_spectra,
    noise_depletion,
    spectrum_size,
)
from polychirp.receiver.mitigation import AnyMitigation
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.point import (
    beat_errors,
    beat_frequency,
    beat_phase,
    beat_sensitivity,
    fit_amplitudes,
    hann_weights,
    matched_amplitudes,
)
from polychirp.receiver.refine import motion_steps, range_and_rate_from_beats
from polychirp.receiver.threshold import log_mean_threshold, log_median_of_noise
from polychirp.units import Metres, MetresPerSecond, Ratio, from_db

LEAST_COHERENCE = 0.35
"""Asked of a point's ramps (`coherence`): false pairs stay below 0.3, bodies on a street reach 0.4
to 1; what passes within a few metres at high speed may not, and is then not claimed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Receiver(Spec):
    """The chain: mitigation (if any), beams, spectra, range-rate map, CFAR, cancellation, angle.

    Points are found strongest first. Each one is refined, its amplitude on every ramp and channel
    taken out of the samples, and the map drawn anew, until nothing crosses the threshold: so a
    weak target is not lost under the skirts of a strong one, and those skirts are no targets.
    What crosses it but does not move like one point over the frame (`coherence`) is no claim.

    Parameters
    ----------
    mitigation : what is done to the samples first; None for nothing
    false_alarm_probability : per cell of the map, over all beams, on noise alone
    dynamic_range : ratio to the strongest echo, below which nothing is claimed: what is left of
        extended bodies, taken out as points, would be
    least_range, greatest_range, greatest_speed : m and m/s, limits of the map
    most_detections : stop when there are so many
    """

    mitigation: AnyMitigation | None = None
    false_alarm_probability: float = 1e-6
    dynamic_range: Ratio = from_db(40.0)
    least_range: Metres = 0.5
    greatest_range: Metres = 30.0
    greatest_speed: MetresPerSecond = 32.0
    most_detections: int = 150

    def __post_init__(self) -> None:
        if not 0 < self.false_alarm_probability < 0.1:
            raise InputError("a receiver's false-alarm probability must lie between 0 and 0.1")
        if not 0 < self.least_range < self.greatest_range:
            raise InputError("a receiver's least range must be positive and below its greatest")
        if not (self.greatest_speed > 0 and self.most_detections > 0):
            raise InputError(
                "a receiver's greatest speed and number of detections must be positive"
            )
        if not self.dynamic_range > 1.0:
            raise InputError("a receiver's dynamic range must be above 0 dB")

    def detect(self, frame: IfFrame) -> Detections:
        """Detections of one frame, strongest first; range and azimuth at its first ramp's start."""
        search = _Search(self, frame)
        while search.next_points():
            pass
        return search.detections()


class _Search:
    """Points of one frame, found and taken out until nothing coherent is left."""

    def __init__(self, receiver: Receiver, frame: IfFrame) -> None:
        self.receiver = receiver
        heard = mitigated(receiver.mitigation, frame)
        self.frame = frame.with_samples(heard.samples)
        self.weight = hann_weights(heard.weight)
        self.residual = heard.samples * (self.weight > 0)
        self.time = float(frame.schedule.start_time[0])
        self.frequency = float(np.mean(frame.schedule.centre_frequency))
        self.size = spectrum_size(frame.times)
        self.grid = search_grid(receiver, frame, self.time)
        self.beams = steering(
            frame.array,
            frequency=self.frequency,
            sine=orthogonal_sines(frame.array.num_channels),
        )
        per_beam = 1.0 - (1.0 - receiver.false_alarm_probability) ** (1.0 / len(self.beams))
        self.threshold = log_mean_threshold(
            num_ramps=frame.schedule.num_ramps, false_alarm_probability=per_beam
        ) - log_median_of_noise(frame.schedule.num_ramps)
        self.sensitivity = beat_sensitivity(frame.schedule, frame.times, self.time)
        self.resolution = frame.times.rate / frame.times.num_samples
        self.motion = np.zeros((0, 3))
        self.amplitude = np.zeros((0, *frame.samples.shape[:2]), dtype=np.complex128)
        self.floor = np.zeros(0)
        self.is_tried = np.zeros((self.grid.range_rate.size, self.grid.range.size), dtype=bool)
        self.top = -np.inf

    def next_points(self) -> bool:
        """Find and take out the strongest points left; False when there is none."""
        logs = self._log_spectra()
        statistic = log_range_rate_map(logs, self.frame.schedule, self.frame.times, self.grid)
        floor = floor_over_range(statistic, round(6.0 / self.grid.range_step))
        self.top = max(self.top, float(statistic.max()))
        weak = statistic < self.top - np.log(self.receiver.dynamic_range)
        excess = np.where(weak, -np.inf, statistic - floor)
        excess[:, self.is_tried] = -np.inf
        found = 0
        while not found:
            peaks = strongest_peaks(excess, self.threshold, self.grid)
            for n in unrelated(self._beats_of(peaks), self.resolution):
                beam, i, j = peaks[n]
                place = (slice(max(0, i - 1), i + 2), slice(max(0, j - 1), j + 2))
                excess[:, *place] = -np.inf
                if self._add(logs[beam], float(floor[beam, 0, j]), i, j):
                    # once is enough: what the joint fit drops would come back for ever
                    self.is_tried[place] = True
                    found += 1
            if not peaks:
                return False
        self._take_out()
        return len(self.motion) < self.receiver.most_detections

    def _beats(self, distance: FloatArray, range_rate: FloatArray) -> FloatArray:
        return beat_frequency(
            self.frame.schedule,
            self.frame.times,
            distance=distance,
            range_rate=range_rate,
            time=self.time,
        )

    def _beats_of(self, peaks: list[tuple[int, int, int]]) -> FloatArray:
        cells = np.array(peaks, dtype=np.int64).reshape(-1, 3)
        return self._beats(self.grid.range[cells[:, 2]], self.grid.range_rate[cells[:, 1]])

    def _log_spectra(self) -> FloatArray:
        beats = self._beats(self.motion[:, 0], self.motion[:, 1])
        return log_spectra(
            beamform(self.residual, self.beams),
            self.weight,
            self.size,
            noise_depletion(beats, self.frame.times, self.size),
        )

    def _add(self, logs: FloatArray, floor: float, i: int, j: int) -> bool:
        """Take a peak as a point if its ramps cohere."""
        distance, rate = range_and_rate_from_beats(
            logs,
            self.frame.schedule,
            self.frame.times,
            distance=float(self.grid.range[j]),
            range_rate=float(self.grid.range_rate[i]),
            time=self.time,
        )
        motion = np.array([[distance, rate, 0.0]])
        amplitude = matched_amplitudes(
            self.residual, self.weight, self._phases(motion), self.frame.times.rate
        )
        if self._coherence(amplitude, motion)[0] < LEAST_COHERENCE:
            return False
        self.motion = np.vstack([self.motion, motion])
        self.floor = np.append(self.floor, floor)
        return True

    def _coherence(self, amplitude: ComplexArray, motion: FloatArray) -> FloatArray:
        schedule = self.frame.schedule
        middle = schedule.start_time + 0.5 * schedule.duration
        if self.frame.high_pass is not None:
            # it turns up- and down-beats against each other
            passed = self.frame.high_pass.response(self._beats(motion[:, 0], motion[:, 1]))
            amplitude = amplitude * np.exp(-1j * np.angle(passed))[:, None]
        return coherence(amplitude, schedule.centre_frequency, middle)

    def _phases(self, motion: FloatArray) -> FloatArray:
        return beat_phase(self.frame.schedule, self.frame.times, motion=motion, time=self.time)

    def _take_out(self, steps: int = 2) -> None:
        """Fit all points to the samples together, by turns amplitudes and motions."""
        for _ in range(steps):
            phases = self._fit()
            errors = beat_errors(
                self.residual, self.weight, phases, self.amplitude, self.frame.times.rate
            )
            strength = np.sum(np.abs(self.amplitude) ** 2, axis=1)
            step = motion_steps(errors, strength, self.sensitivity, self.resolution)
            limit = np.array([0.5 * self.grid.range_step, self.grid.range_rate_step, 10.0])
            self.motion = self.motion + np.clip(step, -limit, limit)
        self._fit()
        is_point = self._is_point()
        if not np.all(is_point):
            self._keep(is_point)
            self._fit()

    def _fit(self) -> FloatArray:
        phases = self._phases(self.motion)
        self.amplitude, self.residual = fit_amplitudes(
            self.frame.samples, self.weight, phases, self.frame.times.rate
        )
        return phases

    def excess(self) -> FloatArray:
        """How far the fitted points stand above the floor in the map's statistic, ``(point,)``."""
        gain = np.sum(self.weight, axis=1) ** 2 / np.maximum(np.sum(self.weight**2, axis=1), 1e-30)
        power = np.sum(np.abs(self.amplitude) ** 2, axis=1) * gain
        return np.asarray(np.mean(np.log(np.maximum(power, 1e-300)), axis=1) - self.floor)

    def _is_point(self) -> BoolArray:
        """Points that are still one when the others are fitted with them, ``(point,)``."""
        is_loud = self.excess() >= self.threshold
        return is_loud & (self._coherence(self.amplitude, self.motion) >= LEAST_COHERENCE)

    def _keep(self, which: BoolArray) -> None:
        self.motion = self.motion[which]
        self.floor = self.floor[which]
        self.amplitude = self.amplitude[which]

    def detections(self) -> Detections:
        """Points as claims, those dropped that only mend a stronger one's skirt."""
        self._keep(self._is_point())
        power = np.mean(np.abs(self.amplitude) ** 2, axis=(1, 2))
        distance, rate = self.motion[:, 0], self.motion[:, 1]
        kept = resolved(self.frame, distance=distance, range_rate=rate, power=power)
        sines = root_music(
            self.amplitude[kept],
            spacing=self.frame.array.spacing * self.frequency / SPEED_OF_LIGHT,
        )
        return Detections(
            time=self.time,
            range=distance[kept],
            range_rate=rate[kept],
            azimuth=np.arcsin(np.clip(sines, -1.0, 1.0)),
            power=power[kept],
            snr=np.exp(self.excess()[kept]),
        )


def search_grid(receiver: Receiver, frame: IfFrame, time: float) -> Grid:
    """Map axes fine enough not to miss a peak: half a range cell, a third of a Doppler cell."""
    cell = SPEED_OF_LIGHT / (2.0 * float(np.max(frame.schedule.bandwidth)))
    wavelength = SPEED_OF_LIGHT / float(np.max(frame.schedule.centre_frequency))
    step = wavelength / (6.0 * float(np.max(frame.schedule.duration)))
    count = int(np.ceil(receiver.greatest_speed / step))
    return Grid(
        range=np.arange(receiver.least_range, receiver.greatest_range, 0.5 * cell),
        range_rate=step * np.arange(-count, count + 1, dtype=np.float64),
        time=time,
    )


def strongest_peaks(
    excess: FloatArray, threshold: float, grid: Grid, most: int = 40
) -> list[tuple[int, int, int]]:
    """Peaks of the map within 15 % of the strongest, ``(beam, range_rate, range)``, in order."""
    left = excess.max(axis=0)
    beam = excess.argmax(axis=0)
    apart = max(1, round(0.5 / grid.range_step))
    peaks: list[tuple[int, int, int]] = []
    enough = max(threshold, 0.85 * float(left.max()))
    while len(peaks) < most:
        i, j = np.unravel_index(int(np.argmax(left)), left.shape)
        if left[i, j] < enough:
            break
        peaks.append((int(beam[i, j]), int(i), int(j)))
        left[max(0, i - apart) : i + apart + 1, max(0, j - apart) : j + apart + 1] = -np.inf
    return peaks


def unrelated(beats: FloatArray, resolution: FloatArray) -> list[int]:
    """Numbers of the candidates, strongest first, that share beats with none taken before.

    Strong points cross the map as arms, and where the up-arm of one meets the down-arm of another
    stands a false peak, stronger than weak true ones. It beats like the first on all up-ramps:
    such a candidate waits until those before it are taken out, and is gone then.

    ``beats`` is Hz, ``(candidate, ramp)``, ``resolution`` Hz, ``(ramp,)``.
    """
    taken: list[int] = []
    for n, beat in enumerate(beats):
        shared = [np.mean(np.abs(beat - beats[m]) < 3.0 * resolution) for m in taken]
        if max(shared, default=0.0) < 0.2:
            taken.append(n)
    return taken


def resolved(
    frame: IfFrame, *, distance: FloatArray, range_rate: FloatArray, power: FloatArray
) -> IntArray:
    """Numbers of the points, strongest first, that a stronger one's skirt does not explain.

    Taking out a body's echo as points leaves a few per cent of it in the cells around; what is
    found there more than 20 dB below, within one range cell and two Doppler cells, is not a
    target of its own.
    """
    cell = SPEED_OF_LIGHT / (2.0 * float(np.max(frame.schedule.bandwidth)))
    wavelength = SPEED_OF_LIGHT / float(np.mean(frame.schedule.centre_frequency))
    doppler = wavelength / (2.0 * float(np.min(frame.schedule.duration)))
    kept: list[int] = []
    for n in np.argsort(power)[::-1]:
        near = [
            power[m]
            for m in kept
            if abs(distance[m] - distance[n]) < cell
            and abs(range_rate[m] - range_rate[n]) < 2.0 * doppler
        ]
        if not near or power[n] > 0.01 * max(near):
            kept.append(int(n))
    return np.array(kept, dtype=np.int64)
