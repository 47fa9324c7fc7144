"""`Receiver` — from dechirped samples to detections, for ramps of any slopes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.angle.beamform import orthogonal_sines, steering
from polychirp.receiver.angle.doa import bartlett, capon, root_music
from polychirp.receiver.clustering import Body, merged
from polychirp.receiver.detection.range_rate_map import Grid
from polychirp.receiver.detection.residual_map import LiveMap, strongest_peaks
from polychirp.receiver.detection.sidelobe_rejection import resolved, unrelated
from polychirp.receiver.detection.threshold import log_threshold_above_floor
from polychirp.receiver.estimation.bearing_rate import brought_to_start
from polychirp.receiver.estimation.beat_refinement import motion_steps, range_and_rate_from_beats
from polychirp.receiver.estimation.coherence_test import (
    is_on_both_halves,
    least_coherence,
    straightened,
)
from polychirp.receiver.estimation.phase_refinement import (
    ONE_POINT,
    Readings,
    coherent_steps,
    read_points,
)
from polychirp.receiver.estimation.two_targets_per_cell import MOST_CLAIMS, Pair, Pairs
from polychirp.receiver.mitigation import AnyMitigation
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.signal_model.frame_model import Waves
from polychirp.receiver.signal_model.point_signal import beat_sensitivity
from polychirp.receiver.signal_model.spectral_fit import BINS, Band, band_of
from polychirp.spec import Spec
from polychirp.units import Between, Metres, MetresPerSecond, Ratio, from_db

BEARINGS: Final = {"root-music": root_music, "bartlett": bartlett, "capon": capon}

UNMOVED = 0.1
"""Nepers: a peak that was refused is looked at again when its height has changed by more."""

PATIENCE = 20
"""Batches of new points tried on one map without any gain before the search ends: what is left of
an extended body gives points that only replace each other."""

AFTERWARDS = 3
"""The same after a pair was found: what it hid shows at once."""

STRAIGHT = 0.2
"""m/s²: readings of a point that turns out to accelerate by that much less or more bend within
ramps, and range is wrong by some 10 µm. They are read once more where that matters."""

LOUD = math.log(1e5)
"""Nepers above the floor, from which on it does."""

MOST_CANDIDATES = 40
"""Peaks looked at together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Receiver(Spec):
    """The chain: mitigation (if any), beams, spectra, range-rate map, CFAR, cancellation, angle.

    Points are found strongest first. Each one is refined, its amplitude on every ramp and channel
    taken out of the samples, and the map drawn anew, until nothing crosses the threshold: so a
    weak target is not lost under the skirts of a strong one, and those skirts are no targets.
    What crosses it but does not move like one point over the frame (`coherence`) is no claim; what
    is one point by all its phases gets its range and rate from them (`coherent`), and what is two
    in one cell is taken for two (`pairs`).

    Parameters
    ----------
    mitigation : what is done to the samples first; None for nothing
    false_alarm_probability : per cell of the map, over all beams, on noise alone
    dynamic_range : ratio to the strongest echo, below which nothing is claimed: what is left of
        extended bodies, taken out as points, would be
    least_range, greatest_range, greatest_speed : m and m/s, limits of the map
    most_detections : stop when there are so many
    angle : how a claim's bearing is found: by root-MUSIC or by Bartlett's or Capon's beamformer
    grouping : what makes several points one body, and one claim; None for a claim per point
    """

    mitigation: AnyMitigation | None = None
    false_alarm_probability: float = 1e-6
    dynamic_range: Ratio = from_db(40.0)
    least_range: Metres = 0.5
    greatest_range: Metres = 30.0
    greatest_speed: MetresPerSecond = 32.0
    most_detections: Annotated[int, Between(greatest=100_000)] = 150
    angle: Literal["root-music", "bartlett", "capon"] = "root-music"
    grouping: Body | None = None

    def __post_init__(self) -> None:
        if not 1e-12 <= self.false_alarm_probability < 0.1:
            raise InputError("a receiver's false-alarm probability must lie between 1e-12 and 0.1")
        if not 0 < self.least_range < self.greatest_range:
            raise InputError("a receiver's least range must be positive and below its greatest")
        if not (self.greatest_speed > 0 and self.most_detections > 0):
            raise InputError(
                "a receiver's greatest speed and number of detections must be positive"
            )
        if self.angle not in BEARINGS:
            raise InputError(f"a receiver's angle '{self.angle}' is none of {', '.join(BEARINGS)}")
        if not self.dynamic_range > 1.0:
            raise InputError("a receiver's dynamic range must be above 0 dB")

    def detect(self, frame: IfFrame) -> Detections:
        """Detections of one frame, strongest first; range and azimuth at its first ramp's start."""
        search = _Search(self, frame)
        while search.next_points() or search.split():
            pass
        found = search.detections()
        return found if self.grouping is None else merged(found, self.grouping)


class _Search:
    """Points of one frame, found and taken out until nothing coherent is left."""

    def __init__(self, receiver: Receiver, frame: IfFrame) -> None:
        self.receiver = receiver
        heard = mitigated(receiver.mitigation, frame)
        self.frame = frame.with_samples(heard.samples)
        self.presence = heard.weight
        self.present = heard.weight.sum(axis=1) / frame.times.is_sample.sum(axis=1)
        self.waves = Waves.of(frame)
        self.frequency = float(np.mean(frame.schedule.centre_frequency))
        self.grid = search_grid(receiver, frame, self.waves.time)
        self.band = self._band()
        self.spectra = self.band.spectra(self.frame.samples)
        self.residual = self.spectra
        beams = steering(
            frame.array,
            frequency=self.frequency,
            sine=orthogonal_sines(frame.array.num_channels),
        )
        self.map = LiveMap(self.band, frame.schedule, frame.times, self.grid, beams)
        per_beam = 1.0 - (1.0 - receiver.false_alarm_probability) ** (1.0 / len(beams))
        covariance, variance = self.map.following()
        self.threshold = log_threshold_above_floor(
            num_ramps=frame.schedule.num_ramps,
            false_alarm_probability=per_beam,
            covariance=covariance,
            variance=variance,
        )
        middle = frame.schedule.start_time + 0.5 * frame.schedule.duration
        self.least = least_coherence(frame.schedule.centre_frequency, middle)
        self.sensitivity = beat_sensitivity(frame.schedule, frame.times, self.waves.time)
        self.resolution = frame.times.rate / frame.times.num_samples
        self.motion = np.zeros((0, 3))
        self.amplitude = np.zeros((0, *frame.samples.shape[:2]), dtype=np.complex128)
        self.floor = np.zeros(0)
        self.pairs = Pairs(waves=self.waves, band=self.band)
        shape = (self.grid.range_rate.size, self.grid.range.size)
        self.is_tried = np.zeros(shape, dtype=bool)
        self.refused = np.full(shape, np.inf, dtype=np.float32)
        self.top = -np.inf

    def _band(self) -> Band:
        """All bins in which a point of the map can beat."""
        frame, grid = self.frame, self.grid
        far, fast = np.meshgrid(grid.range[[0, -1]], grid.range_rate[[0, -1]])
        beats = self.waves.beats(far.ravel(), fast.ravel())
        return band_of(
            self.presence,
            frame.times,
            lowest=beats.min(axis=0),
            highest=beats.max(axis=0),
        )

    def next_points(self) -> bool:
        """Find and take out the strongest points left; False when there is none."""
        self.map.draw(self.residual, self.waves.beats(self.motion[:, 0], self.motion[:, 1]))
        floor = self.map.floor()
        self.top = max(self.top, self.map.loudest())
        least = self.top - np.log(self.receiver.dynamic_range)
        excess, beam = self.map.excess(floor, least)
        is_old = (excess > self.refused - UNMOVED) & (excess < self.refused + UNMOVED)
        excess[self.is_tried | is_old] = -np.inf
        for _ in range(AFTERWARDS if self.pairs.found else PATIENCE):
            before = self.motion, self.amplitude, self.floor, self.residual
            if not self._look(excess, beam, floor):
                return False
            self._take_out()
            if len(self.motion) > len(before[0]):
                return len(self.motion) < self.receiver.most_detections
            self.motion, self.amplitude, self.floor, self.residual = before
        return False

    def _look(self, excess: NDArray[np.float32], beam: NDArray[np.int8], floor: FloatArray) -> bool:
        """Add the strongest peaks that cohere; False when there is none. ``excess`` is used up."""
        apart = max(1, round(0.5 / self.grid.range_step))
        while True:
            peaks = strongest_peaks(excess, self.threshold, apart, MOST_CANDIDATES)
            if len(peaks) == 0:
                return False
            chosen = peaks[unrelated(self._beats_of(peaks), self.resolution)]
            is_point = self._add(chosen, beam[tuple(chosen.T)].astype(np.int64), floor)
            for is_found, (i, j) in zip(is_point, chosen, strict=True):
                place = (slice(max(0, i - 1), i + 2), slice(max(0, j - 1), j + 2))
                if is_found:
                    # once is enough: what the joint fit drops would come back for ever
                    self.is_tried[place] = True
                else:
                    self.refused[place] = excess[place]
                excess[place] = -np.inf
            if np.any(is_point):
                return True

    def _beats_of(self, cells: IntArray) -> FloatArray:
        return self.waves.beats(self.grid.range[cells[:, 1]], self.grid.range_rate[cells[:, 0]])

    def _add(self, cells: IntArray, beam: IntArray, floor: FloatArray) -> BoolArray:
        """Take those peaks as points whose ramps cohere: which they are, ``(cell,)``."""
        guess = np.stack([self.grid.range[cells[:, 1]], self.grid.range_rate[cells[:, 0]]], axis=-1)
        bins = self.band.size / self.band.rate
        found = range_and_rate_from_beats(
            self.map.logs,
            guess,
            beam,
            self.waves.beats(guess[:, 0], guess[:, 1]) * bins - self.band.first,
            np.ascontiguousarray(self.sensitivity[:, :2] * bins[:, None]),
            reach=BINS,
            resolution=float(BINS),
        )
        motion = np.column_stack([found, np.zeros(len(found))])
        amplitude = self.band.match(self.residual, self.waves.phases(motion))
        coherent = self._coherence(amplitude, motion)
        unsure = np.flatnonzero((coherent < ONE_POINT) & (coherent >= 0.5 * self.least))
        bent = self._bent(motion[unsure], amplitude[unsure])
        matched = self.band.match(self.residual, self.waves.phases(bent))
        again = self._coherence(matched, bent)
        is_better = again > coherent[unsure]
        better = unsure[is_better]
        motion[better], amplitude[better] = bent[is_better], matched[is_better]
        coherent[better] = again[is_better]
        is_point = coherent >= self.least
        under = floor[cells[:, 1], beam]
        self.motion = np.vstack([self.motion, motion[is_point]])
        self.floor = np.append(self.floor, under[is_point])
        above = self._above(amplitude, under)
        for n in np.flatnonzero(~is_point):
            self.pairs.refused.append((float(above[n]), motion[n], float(under[n])))
        return is_point

    def _straightened(
        self, amplitude: ComplexArray, motion: FloatArray
    ) -> tuple[FloatArray, ComplexArray]:
        """Coherence of points, and their amplitudes as nearly in phase as they get."""
        schedule = self.frame.schedule
        middle = schedule.start_time + 0.5 * schedule.duration
        turned = amplitude * self.waves.turned_back(motion)
        return straightened(turned, schedule.centre_frequency, middle)

    def _coherence(self, amplitude: ComplexArray, motion: FloatArray) -> FloatArray:
        return self._straightened(amplitude, motion)[0]

    def _bent(self, motion: FloatArray, amplitude: ComplexArray) -> FloatArray:
        """Motions with the accelerations that their own beats ask for, as of what passes near."""
        for _ in range(2):
            phases = self.waves.phases(motion)
            errors = self.band.beat_errors(self.residual, phases, amplitude)
            strength = np.sum(np.abs(amplitude) ** 2, axis=1)
            motion = motion + motion_steps(errors, strength, self.sensitivity, self.resolution)
            amplitude = self.band.match(self.residual, self.waves.phases(motion))
        return motion

    def _take_out(self, steps: int = 2) -> None:
        """Fit all points to the spectra together, by turns amplitudes and motions."""
        for _ in range(steps):
            phases = self._fit()
            errors = self.band.beat_errors(self.residual, phases, self.amplitude)
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
        phases = self.waves.phases(self.motion)
        self.amplitude, self.residual = self.band.fit(self.spectra, phases, np.sqrt(self.map.noise))
        return phases

    def split(self) -> bool:
        """Take two points for one claim, or for a peak that was refused; False when there are none.

        After that all is looked for anew: what they disturbed, and what the fit dropped for it.
        """
        before = len(self.pairs.found)
        while len(self.motion) + 2 * len(self.pairs.found) < self.receiver.most_detections:
            if not (
                any(map(self._is_split, self._doubtful()))
                or self._is_taken(self.pairs.of_refused(self.residual, self.map.noise))
            ):
                break
            self._take_out()
        if len(self.pairs.found) == before:
            return False
        self.is_tried[:] = False
        return True

    def _doubtful(self) -> list[BoolArray]:
        """Claims that may be one pair, ``(point,)`` each: what is not one point, and what overlaps.

        Two points leave residues beside what was taken for one, which become claims as well.
        """
        coherent = self._coherence(self.amplitude, self.motion)
        if np.all(coherent >= ONE_POINT):
            return []
        beats = self.waves.beats(self.motion[:, 0], self.motion[:, 1])
        apart = np.median(np.abs(beats[:, None] - beats) / self.resolution, axis=-1)
        is_none = coherent < ONE_POINT
        near = (apart < 2.0) | (is_none & (apart < 4.0))
        every = [near[n] for n in np.argsort(coherent) if is_none[n]]
        groups = {own.tobytes(): own for own in every}
        groups |= {(own & is_none).tobytes(): own & is_none for own in every}
        return list(groups.values())[:MOST_CLAIMS]

    def _is_split(self, own: BoolArray) -> bool:
        """Put a pair in the place of claims, ``(point,)``, if they are one."""
        strongest = int(np.argmax(own * np.sum(np.abs(self.amplitude) ** 2, axis=(1, 2))))
        pair = self.pairs.of_claim(
            self.pairs.alone(self.residual, self.motion[own], self.amplitude[own]),
            motion=self.motion[strongest],
            noise=self.map.noise,
            floor=float(self.floor[strongest]),
        )
        if self._is_taken(pair):
            self._keep(~own)
        return pair is not None

    def _is_taken(self, pair: Pair | None) -> bool:
        """Take a pair, if there is one, out of the spectra for good."""
        if pair is not None:
            phases = self.waves.phases(pair.motion)
            self.spectra = self.band.without(self.spectra, phases, pair.amplitude)
        return pair is not None

    def _with_pairs(self) -> None:
        """Measure all pairs once more, without what was found since, and count them as points."""
        for pair in self.pairs.found:
            again = self.pairs.fit(
                self.pairs.alone(self.residual, pair.motion, pair.amplitude), pair, self.map.noise
            )
            self.motion = np.vstack([self.motion, again.motion])
            self.amplitude = np.concatenate([self.amplitude, again.amplitude])
            self.floor = np.append(self.floor, [pair.floor, pair.floor])

    def excess(self) -> FloatArray:
        """How far the fitted points stand above the floor in the map's statistic, ``(point,)``."""
        return self._above(self.amplitude, self.floor)

    def _above(self, amplitude: ComplexArray, floor: FloatArray) -> FloatArray:
        power = np.sum(np.abs(amplitude) ** 2, axis=1) * self.band.noise_gain
        return np.asarray(np.mean(np.log(np.maximum(power, 1e-300)), axis=1) - floor)

    def _is_point(self) -> BoolArray:
        """Points that are still one when the others are fitted with them, ``(point,)``."""
        is_loud = self.excess() >= self.threshold
        return is_loud & (self._coherence(self.amplitude, self.motion) >= self.least)

    def _is_claimed(self) -> BoolArray:
        """Points within the receiver's limits, and on up- and down-ramps, ``(point,)``.

        What is just beyond the limits is found at the edge or by its arms, which are on half of the
        ramps. It is taken out, or its skirts would be claimed, and is no claim itself.
        """
        limits, (distance, rate, _) = self.receiver, self.motion.T
        is_near = (distance >= limits.least_range) & (distance <= limits.greatest_range)
        is_whole = is_on_both_halves(
            self._straightened(self.amplitude, self.motion)[1],
            slope=self.frame.schedule.slope,
            present=self.present,
        )
        return np.asarray(is_near & (np.abs(rate) <= limits.greatest_speed) & is_whole)

    def _keep(self, which: BoolArray) -> None:
        self.motion = self.motion[which]
        self.floor = self.floor[which]
        self.amplitude = self.amplitude[which]

    def _cohere(self) -> ComplexArray:
        """Refine by their phases those that are one point for the whole frame.

        Gives the snapshots for bearings, ``(point, channel, ramp)``, of equal noise and as at the
        frame's start: of such points from all samples alike, of others as fitted under the window.
        """
        if len(self.motion) == 0:
            return self.amplitude
        readings, steps, is_one = self._coherent_steps()
        self.motion[is_one] += steps[is_one]
        has_bent = is_one & (np.abs(steps[:, 2]) > STRAIGHT) & (self.excess() > LOUD)
        if np.any(has_bent) and not self.pairs.found:
            self._fit()  # what is taken out of each other must fit the new motions
            readings, steps, is_one = self._coherent_steps()
            self.motion[is_one] += steps[is_one]
        schedule, middle = self.frame.schedule, readings.middle
        return brought_to_start(
            np.where(is_one[:, None, None], readings.value, self.amplitude)
            * np.sqrt(readings.count),
            motion=self.motion,
            along=self.frame.array.position[:, 1],
            frequency=schedule.start_frequency + schedule.slope * (middle - schedule.start_time),
            elapsed=middle - self.waves.time,
        )

    def _coherent_steps(self) -> tuple[Readings, FloatArray, BoolArray]:
        """Readings of all points, and the steps that their phases ask for: `coherent_steps`."""
        readings = read_points(
            self.frame.samples,
            self.presence > 0,
            self.frame.times,
            phases=self.waves.phases(self.motion),
            amplitude=self.amplitude,
        )
        steps, is_one = coherent_steps(
            readings.turned(self.waves.turned_back(self.motion)),
            self.frame.schedule,
            self.frame.times,
            motion=self.motion,
            time=self.waves.time,
            noise=float(np.median(self.map.noise)),
        )
        return readings, steps, is_one

    def detections(self) -> Detections:
        """Points of the map as claims, but for those that only mend a stronger one's skirt."""
        self._keep(self._is_point())
        self._with_pairs()
        is_claimed = self._is_claimed()
        snapshots = self._cohere()
        power = np.mean(np.abs(self.amplitude) ** 2, axis=(1, 2))
        distance, rate = self.motion[:, 0], self.motion[:, 1]
        kept = resolved(self.frame, distance=distance, range_rate=rate, power=power)
        kept = kept[is_claimed[kept]]
        sines = np.full(len(kept), np.nan)  # of a single channel
        if self.frame.array.num_channels > 1:
            sines = BEARINGS[self.receiver.angle](
                snapshots[kept],
                spacing=self.frame.array.spacing * self.frequency / SPEED_OF_LIGHT,
            )
        return Detections(
            time=self.waves.time,
            range=distance[kept],
            range_rate=rate[kept],
            azimuth=np.arcsin(np.clip(sines, -1.0, 1.0)),
            power=power[kept],
            snr=np.exp(self.excess()[kept]),
        )


def search_grid(receiver: Receiver, frame: IfFrame, time: float) -> Grid:
    """Map axes fine enough not to miss a peak: half a range cell, a third of a Doppler cell."""
    wavelength = SPEED_OF_LIGHT / float(np.max(frame.schedule.centre_frequency))
    step = wavelength / (6.0 * float(np.max(frame.schedule.duration)))
    count = int(np.ceil(receiver.greatest_speed / step))
    return Grid(
        range=range_axis(receiver, frame.schedule),
        range_rate=step * np.arange(-count, count + 1, dtype=np.float64),
        time=time,
    )


def range_axis(receiver: Receiver, schedule: RampSchedule) -> FloatArray:
    """Range axis of the map, m.

    Raises
    ------
    InputError
        The receiver's limits leave no range cell between them.
    """
    cell = SPEED_OF_LIGHT / (2.0 * float(np.max(schedule.bandwidth)))
    distance = np.arange(receiver.least_range, receiver.greatest_range, 0.5 * cell)
    if distance.size < 2:
        raise InputError(
            f"the receiver's map reaches from {receiver.least_range:g} m to "
            f"{receiver.greatest_range:g} m, less than half a range cell of {cell:.3g} m; lower "
            "its least range or raise its greatest range"
        )
    return distance
