"""`Receiver`: from dechirped samples to detections, for ramps of any slopes."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.angle.beamform import orthogonal_sines, steering
from polychirp.receiver.angle.doa import azimuths
from polychirp.receiver.clustering import merged
from polychirp.receiver.detection.residual_map import ResidualMap, strongest_peaks
from polychirp.receiver.detection.sidelobe_rejection import reject_sidelobes, without_cross_pairs
from polychirp.receiver.detection.threshold import log_threshold_above_floor
from polychirp.receiver.estimation.azimuth_rate import snapshots_at_start
from polychirp.receiver.estimation.beat_refinement import motion_steps, range_and_rate_from_beats
from polychirp.receiver.estimation.coherence_test import (
    Alignment,
    aligned,
    is_on_both_slopes,
    least_coherence,
)
from polychirp.receiver.estimation.phase_refinement import (
    ONE_POINT_SHARE,
    Readings,
    coherent_steps,
    read_points,
)
from polychirp.receiver.estimation.two_targets_per_cell import MOST_GROUPS, Pair, Pairs
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.settings import SearchSettings, need_dynamic_range, range_axis
from polychirp.receiver.signal_model.frame_model import FrameModel
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import beat_sensitivity
from polychirp.receiver.signal_model.spectral_fit import BINS_PER_CELL, Band, band_of
from polychirp.units import Ratio, from_db

LEAST_CHANGE_FOR_RETRY = 0.1
"""Change of a refused peak's height above the floor, nepers of power, after which it is tried
again. Chosen: with a smaller limit, more time goes to peaks that are refused once more."""

MOST_FRUITLESS_BATCHES = 20
"""Number of batches of new points without a rise of the number of points, after which a search
ends: residues of extended bodies give points that only replace each other. Chosen: a greater number
finds more weak points, but costs time."""

MOST_FRUITLESS_BATCHES_WITH_PAIRS = 3
"""The same number after a pair was found. Chosen: the first batches contain the points
that the pair masked."""

REREAD_ACCELERATION = 0.2
"""Correction of the acceleration, m/s², above which a strong point's phases are read again. Chosen:
above it, the first readings' phases curve within the ramps, and range is wrong by some 10 µm."""

REREAD_LOG_SNR = math.log(1e5)
"""Height above the floor, nepers of power (50 dB), above which a point's phases are read again.
Chosen: below it, the range error by noise exceeds 10 µm."""

MOST_PEAKS_AT_ONCE = 40
"""Greatest number of peaks that are refined in one batch. Chosen: it limits the size of a batch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Receiver(SearchSettings):
    """The steps: mitigation, spectra, beams, range-rate map, CFAR, subtraction of points, azimuth.

    Points are found strongest first. Each point is refined and subtracted from every ramp
    and channel, and the map is computed again, until no accepted peak crosses the threshold. So the
    side lobes of a strong target neither mask a weak target nor are detected themselves. A peak
    that does not move like one point over the frame (`estimation.coherence_test`) is refused. If a
    point's phases fit one motion over the whole frame, its range and range rate are computed from
    them (`phase_refinement`). Two points in one cell are separated (`two_targets_per_cell`).

    The false-alarm probability is that of a cell over all beams. The coherence test follows, so
    that false alarms by noise are rarer.

    Parameters
    ----------
    dynamic_range : power ratio of the strongest echo to the weakest peak that is tried; chosen so
        that the residues left when extended bodies are subtracted as points are weaker
    """

    dynamic_range: Ratio = from_db(40.0)
    kind: Literal["joint"] = "joint"

    def __post_init__(self) -> None:
        super(Receiver, self).__post_init__()
        need_dynamic_range(self.dynamic_range)

    def detect(self, frame: IfFrame) -> Detections:
        """Detections of one frame, strongest first; range and azimuth at its first ramp's start."""
        search = _Search(self, frame)
        while search.next_points() or search.split():
            pass
        found = search.detections()
        return found if self.grouping is None else merged(found, self.grouping)

    def combined_power(self, amplitude: ComplexArray, _schedule: RampSchedule) -> FloatArray:
        """Power, W, of amplitudes ``(…, ramp)``: the geometric mean over ramps, as in the map."""
        power = np.maximum(np.abs(amplitude) ** 2, 1e-300)
        return np.asarray(np.exp(np.mean(np.log(power), axis=-1)))


class _Search:
    """Points of one frame: they are found and subtracted until no coherent peak is left."""

    def __init__(self, receiver: Receiver, frame: IfFrame) -> None:
        self.receiver = receiver
        cleaned = mitigated(receiver.mitigation, frame)
        self.frame = frame.with_samples(cleaned.samples)
        self.presence = cleaned.weight
        self.present = cleaned.weight.sum(axis=1) / frame.times.is_sample.sum(axis=1)
        self.model = FrameModel.of(frame)
        self.frequency = float(np.mean(frame.schedule.centre_frequency))
        self.grid = search_grid(receiver, frame, self.model.time)
        self.band = self._band()
        self.spectra = self.band.spectra(self.frame.samples)
        self.residual = self.spectra
        beams = steering(
            frame.array,
            frequency=self.frequency,
            sine=orthogonal_sines(frame.array.num_channels),
        )
        self.map = ResidualMap(self.band, frame.schedule, frame.times, self.grid, beams)
        per_beam = 1.0 - (1.0 - receiver.false_alarm_probability) ** (1.0 / len(beams))
        covariance, variance = self.map.floor_correlation()
        self.threshold = log_threshold_above_floor(
            num_ramps=frame.schedule.num_ramps,
            false_alarm_probability=per_beam,
            covariance=covariance,
            variance=variance,
        )
        middle = frame.schedule.start_time + 0.5 * frame.schedule.duration
        self.least = least_coherence(frame.schedule.centre_frequency, middle)
        self.sensitivity = beat_sensitivity(frame.schedule, frame.times, self.model.time)
        self.resolution = frame.times.rate / frame.times.num_samples
        self.motion = np.zeros((0, 3))
        self.amplitude = np.zeros((0, *frame.samples.shape[:2]), dtype=np.complex128)
        self.floor = np.zeros(0)
        self.pairs = Pairs(model=self.model, band=self.band)
        shape = (self.grid.range_rate.size, self.grid.range.size)
        self.is_tried = np.zeros(shape, dtype=bool)
        self.refused = np.full(shape, np.inf, dtype=np.float32)
        self.top = -np.inf

    def _band(self) -> Band:
        """Bins of the spectra that contain the beats of all points of the map."""
        frame, grid = self.frame, self.grid
        far, fast = np.meshgrid(grid.range[[0, -1]], grid.range_rate[[0, -1]])
        beats = self.model.beats(far.ravel(), fast.ravel())
        return band_of(
            self.presence,
            frame.times,
            lowest=beats.min(axis=0),
            highest=beats.max(axis=0),
        )

    def next_points(self) -> bool:
        """Find and subtract the strongest points that are left; False if the search must end."""
        self.map.update(self.residual, self.model.beats(self.motion[:, 0], self.motion[:, 1]))
        floor = self.map.floor()
        self.top = max(self.top, self.map.peak_level())
        least = self.top - np.log(self.receiver.dynamic_range)
        excess, beam = self.map.excess(floor, least)
        is_old = (excess > self.refused - LEAST_CHANGE_FOR_RETRY) & (
            excess < self.refused + LEAST_CHANGE_FOR_RETRY
        )
        excess[self.is_tried | is_old] = -np.inf
        for _ in range(
            MOST_FRUITLESS_BATCHES_WITH_PAIRS if self.pairs.found else MOST_FRUITLESS_BATCHES
        ):
            before = self.motion, self.amplitude, self.floor, self.residual
            if not self._add_strongest(excess, beam, floor):
                return False
            self._fit_jointly()
            if len(self.motion) > len(before[0]):
                return len(self.motion) < self.receiver.most_detections
            self.motion, self.amplitude, self.floor, self.residual = before
        return False

    def _add_strongest(
        self, excess: NDArray[np.float32], beam: NDArray[np.int8], floor: FloatArray
    ) -> bool:
        """Add the strongest coherent peaks; False if there is none. ``excess`` is overwritten."""
        apart = max(1, round(0.5 / self.grid.range_step))
        while True:
            peaks = strongest_peaks(excess, self.threshold, apart, MOST_PEAKS_AT_ONCE)
            if len(peaks) == 0:
                return False
            chosen = peaks[without_cross_pairs(self._beats_of(peaks), self.resolution)]
            is_point = self._add(chosen, beam[tuple(chosen.T)].astype(np.int64), floor)
            for is_found, (i, j) in zip(is_point, chosen, strict=True):
                place = (slice(max(0, i - 1), i + 2), slice(max(0, j - 1), j + 2))
                if is_found:
                    # otherwise a point that the joint fit drops would be found again without end
                    self.is_tried[place] = True
                else:
                    self.refused[place] = excess[place]
                excess[place] = -np.inf
            if np.any(is_point):
                return True

    def _beats_of(self, cells: IntArray) -> FloatArray:
        return self.model.beats(self.grid.range[cells[:, 1]], self.grid.range_rate[cells[:, 0]])

    def _add(self, cells: IntArray, beam: IntArray, floor: FloatArray) -> BoolArray:
        """Add the peaks that are coherent over the ramps as points; mask of them, ``(cell,)``."""
        guess = np.stack([self.grid.range[cells[:, 1]], self.grid.range_rate[cells[:, 0]]], axis=-1)
        bins = self.band.size / self.band.rate
        found = range_and_rate_from_beats(
            self.map.logs,
            guess,
            beam=beam,
            place=self.model.beats(guess[:, 0], guess[:, 1]) * bins - self.band.first,
            slope=np.ascontiguousarray(self.sensitivity[:, :2] * bins[:, None]),
            reach=BINS_PER_CELL,
            resolution=float(BINS_PER_CELL),
        )
        motion = np.column_stack([found, np.zeros(len(found))])
        amplitude = self.band.match(self.residual, self.model.phases(motion))
        coherent = self._coherence(amplitude, motion)
        unsure = np.flatnonzero((coherent < ONE_POINT_SHARE) & (coherent >= 0.5 * self.least))
        accelerated = self._with_acceleration(motion[unsure], amplitude[unsure])
        matched = self.band.match(self.residual, self.model.phases(accelerated))
        again = self._coherence(matched, accelerated)
        is_better = again > coherent[unsure]
        better = unsure[is_better]
        motion[better], amplitude[better] = accelerated[is_better], matched[is_better]
        coherent[better] = again[is_better]
        is_point = coherent >= self.least
        own_floor = floor[cells[:, 1], beam]
        self.motion = np.vstack([self.motion, motion[is_point]])
        self.floor = np.append(self.floor, own_floor[is_point])
        above = self._above(amplitude, own_floor)
        for n in np.flatnonzero(~is_point):
            self.pairs.refuse(float(above[n]), motion[n], float(own_floor[n]))
        return is_point

    def _aligned(self, amplitude: ComplexArray, motion: FloatArray) -> Alignment:
        """Coherence of points, and their amplitudes after the best phase correction (`aligned`)."""
        schedule = self.frame.schedule
        middle = schedule.start_time + 0.5 * schedule.duration
        turned = amplitude * self.model.high_pass_correction(motion)
        return aligned(turned, schedule.centre_frequency, middle)

    def _coherence(self, amplitude: ComplexArray, motion: FloatArray) -> FloatArray:
        return self._aligned(amplitude, motion).coherence

    def _with_acceleration(self, motion: FloatArray, amplitude: ComplexArray) -> FloatArray:
        """Motions refitted with acceleration to the beats: points that pass close by need one."""
        for _ in range(2):
            phases = self.model.phases(motion)
            errors = self.band.beat_errors(self.residual, phases, amplitude)
            strength = np.sum(np.abs(amplitude) ** 2, axis=1)
            motion = motion + motion_steps(errors, strength, self.sensitivity, self.resolution)
            amplitude = self.band.match(self.residual, self.model.phases(motion))
        return motion

    def _fit_jointly(self) -> None:
        """Fit all points to the spectra together, amplitudes and motions alternately, twice."""
        for _ in range(2):
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
        phases = self.model.phases(self.motion)
        self.amplitude, self.residual = self.band.fit(self.spectra, phases, np.sqrt(self.map.noise))
        return phases

    def split(self) -> bool:
        """Replace a point, or a refused peak, by two points; False if there is no such pair.

        After True a new search follows, for points that the pair masked or that the fit dropped.
        """
        before = len(self.pairs.found)
        while len(self.motion) + 2 * len(self.pairs.found) < self.receiver.most_detections:
            if not (
                any(map(self._is_replaced_by_pair, self._pair_candidates()))
                or self._is_subtracted(self.pairs.of_refused(self.residual, self.map.noise))
            ):
                break
            self._fit_jointly()
        if len(self.pairs.found) == before:
            return False
        self.is_tried[:] = False
        return True

    def _pair_candidates(self) -> list[BoolArray]:
        """Groups of points that may be one pair, a mask ``(point,)`` each.

        A group is an incoherent point with the points that overlap it: a pair that was fitted as
        one point leaves residues, which are fitted as points as well.
        """
        coherent = self._coherence(self.amplitude, self.motion)
        if np.all(coherent >= ONE_POINT_SHARE):
            return []
        beats = self.model.beats(self.motion[:, 0], self.motion[:, 1])
        apart = np.median(np.abs(beats[:, None] - beats) / self.resolution, axis=-1)
        is_none = coherent < ONE_POINT_SHARE
        near = (apart < 2.0) | (is_none & (apart < 4.0))
        every = [near[n] for n in np.argsort(coherent) if is_none[n]]
        groups = {own.tobytes(): own for own in every}
        groups |= {(own & is_none).tobytes(): own & is_none for own in every}
        return list(groups.values())[:MOST_GROUPS]

    def _is_replaced_by_pair(self, own: BoolArray) -> bool:
        """True if the points ``own`` ``(point,)`` are a pair, which then replaces them."""
        strongest = int(np.argmax(own * np.sum(np.abs(self.amplitude) ** 2, axis=(1, 2))))
        pair = self.pairs.of_point(
            self.pairs.isolated(self.residual, self.motion[own], self.amplitude[own]),
            motion=self.motion[strongest],
            noise=self.map.noise,
            floor=float(self.floor[strongest]),
        )
        if self._is_subtracted(pair):
            self._keep(~own)
        return pair is not None

    def _is_subtracted(self, pair: Pair | None) -> bool:
        """True if ``pair`` is not None; the pair is then subtracted from `spectra` permanently."""
        if pair is not None:
            phases = self.model.phases(pair.motion)
            self.spectra = self.band.subtract(self.spectra, phases, pair.amplitude)
        return pair is not None

    def _append_pairs(self) -> None:
        """Fit all pairs again with later points subtracted, and append them to the points."""
        for pair in self.pairs.found:
            again = self.pairs.fit(
                self.pairs.isolated(self.residual, pair.motion, pair.amplitude),
                pair,
                self.map.noise,
            )
            self.motion = np.vstack([self.motion, again.motion])
            self.amplitude = np.concatenate([self.amplitude, again.amplitude])
            self.floor = np.append(self.floor, [pair.floor, pair.floor])

    def excess(self) -> FloatArray:
        """Height of the fitted points above the floor, nepers (mean of log power): ``(point,)``."""
        return self._above(self.amplitude, self.floor)

    def _above(self, amplitude: ComplexArray, floor: FloatArray) -> FloatArray:
        power = np.sum(np.abs(amplitude) ** 2, axis=1) * self.band.noise_gain
        return np.asarray(np.mean(np.log(np.maximum(power, 1e-300)), axis=1) - floor)

    def _is_point(self) -> BoolArray:
        """Mask of the points that pass threshold and coherence in the joint fit, ``(point,)``."""
        is_strong = self.excess() >= self.threshold
        return is_strong & (self._coherence(self.amplitude, self.motion) >= self.least)

    def _is_detection(self) -> BoolArray:
        """Mask of the points within the receiver's limits with power on both up- and down-ramps.

        A target just outside the limits is found at the map's edge or on one of its cross-pairing
        ridges, whose cells match its beats on half of the ramps only. Such a point is subtracted,
        so that its side lobes are not detected, but it is not reported.
        """
        limits, (distance, rate, _) = self.receiver, self.motion.T
        is_near = (distance >= limits.least_range) & (distance <= limits.greatest_range)
        is_whole = is_on_both_slopes(
            self._aligned(self.amplitude, self.motion).amplitude,
            slope=self.frame.schedule.slope,
            present=self.present,
        )
        return np.asarray(is_near & (np.abs(rate) <= limits.greatest_speed) & is_whole)

    def _keep(self, which: BoolArray) -> None:
        self.motion = self.motion[which]
        self.floor = self.floor[which]
        self.amplitude = self.amplitude[which]

    def _refine_by_phases(self) -> ComplexArray:
        """Refine points whose phases fit one motion over the frame; snapshots for all azimuths.

        The snapshots, ``(point, channel, ramp)``, are the points' amplitudes, scaled to equal noise
        and referred to the frame's start. Those of refined points weight all samples alike; those
        of other points are fitted to the windowed spectra.
        """
        if len(self.motion) == 0:
            return self.amplitude
        readings, steps, is_one = self._coherent_steps()
        self.motion[is_one] += steps[is_one]
        is_reread = (
            is_one & (np.abs(steps[:, 2]) > REREAD_ACCELERATION) & (self.excess() > REREAD_LOG_SNR)
        )
        if np.any(is_reread) and not self.pairs.found:
            self._fit()  # the readings subtract the other points, at their new motions
            readings, steps, is_one = self._coherent_steps()
            self.motion[is_one] += steps[is_one]
        schedule, middle = self.frame.schedule, readings.middle
        return snapshots_at_start(
            np.where(is_one[:, None, None], readings.value, self.amplitude)
            * np.sqrt(readings.count),
            motion=self.motion,
            channel_y=self.frame.array.position[:, 1],
            frequency=schedule.start_frequency + schedule.slope * (middle - schedule.start_time),
            elapsed=middle - self.model.time,
        )

    def _coherent_steps(self) -> tuple[Readings, FloatArray, BoolArray]:
        """Readings of all points, their corrections and the mask, both by `coherent_steps`."""
        readings = read_points(
            self.frame.samples,
            self.presence > 0,
            self.frame.times,
            phases=self.model.phases(self.motion),
            amplitude=self.amplitude,
        )
        noise = float(np.median(self.map.noise))
        return readings, *coherent_steps(readings, self.model, motion=self.motion, noise=noise)

    def detections(self) -> Detections:
        """All points except those outside the limits and those on side lobes of stronger points."""
        self._keep(self._is_point())
        self._append_pairs()
        is_detection = self._is_detection()
        snapshots = self._refine_by_phases()
        power = np.mean(np.abs(self.amplitude) ** 2, axis=(1, 2))
        distance, rate = self.motion[:, 0], self.motion[:, 1]
        kept = reject_sidelobes(self.frame, distance=distance, range_rate=rate, power=power)
        kept = kept[is_detection[kept]]
        spacing = self.frame.array.spacing * self.frequency / SPEED_OF_LIGHT
        return Detections(
            time=self.model.time,
            range=distance[kept],
            range_rate=rate[kept],
            azimuth=azimuths(snapshots[kept], spacing=spacing, estimator=self.receiver.angle),
            power=power[kept],
            snr=np.exp(self.excess()[kept]),
        )


def search_grid(receiver: Receiver, frame: IfFrame, time: float) -> Grid:
    """Axes of the map, in steps of half a range cell and a third of one ramp's Doppler cell.

    The cells are those of the largest bandwidth and the longest ramp. Chosen: no peak is missed.
    """
    wavelength = SPEED_OF_LIGHT / float(np.max(frame.schedule.centre_frequency))
    step = wavelength / (6.0 * float(np.max(frame.schedule.duration)))
    count = int(np.ceil(receiver.greatest_speed / step))
    return Grid(
        range=range_axis(receiver, frame.schedule),
        range_rate=step * np.arange(-count, count + 1, dtype=np.float64),
        time=time,
    )
