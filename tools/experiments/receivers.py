"""Detections of the coherent receiver on drawn frames of points in white noise.

A point's coherent SNR is the sum of its power over all samples of all channels, divided by the
noise power of a sample. The ideal detector (`scoring.ideal_detector`) has the receiver's threshold.

Each trial draws its points, its noise and its schedule. A point is found if a detection, which no
other point has, is near its range and range rate at the instant to which the detections refer; all
other detections are false.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.if_frame import IfFrame, sample_times
from polychirp.model.radar import Converter
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.false_alarms import threshold_of
from polychirp.receiver.signal_model.point_signal import path_of
from polychirp.rng import Streams
from polychirp.scoring.ideal_detector import ideal_detection
from polychirp.scoring.statistics import Estimate, mean_count, proportion
from polychirp.units import from_db
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of
from tests.support.schedules import drawn_chirps

NUM_TRIALS: Final = 40
"""Number of frames for every row; chosen: a share of one half is known within ±0.15."""

NUM_NOISE_TRIALS: Final = 50
"""Number of frames of noise for every row; chosen: some ten false detections are expected if there
are 0.2 in a frame."""

NUM_LONG_TRIALS: Final = 20
"""Number of frames of ten points, of passing points and of unequal points; chosen: they take longer
than the others."""

DETECTION_SNRS: Final = (12.0, 13.0, 14.0, 15.0, 16.0, 18.0)
"""Coherent SNRs at which the detection probability is measured, dB."""

FALSE_ALARM_PROBABILITIES: Final = (1e-5, 1e-6)
"""Settings of the receiver for which false detections in noise are counted."""

PAIR_SNR: Final = from_db(20.0)
"""Coherent SNR of each of two close points, and of the weak one of two unequal points; chosen: the
ideal detector practically never misses such a point."""

WEAK_POINTS: Final = ((50.0, 60.0), (60.0, 60.0), (60.0, 70.0))
"""Power of the strong over the weak point, and the receiver's dynamic range, both in dB."""

SPAN_OF_RATES: Final = 30.0
"""Greatest magnitude of range rates drawn, m/s."""

RATE_SHARE: Final = 2.0 / 3.0
"""Error of the range rate, in cells λ/2T, up to which a detection is that of a point; chosen: below
the first side lobe at one and a half cells, 0.04 m/s for a frame of 32 ms."""

_MOST_SIGNED_SEED: Final = 2**31

_ARRAY: Final = AntennaArray()
"""Array of the frames that `frame_of` makes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of frames: how its schedule is drawn, and the receiver that reads it.

    Parameters
    ----------
    schedule : function from random streams to a schedule
    converter : of the radar
    greatest_range : m, of the receiver's map
    """

    schedule: Callable[[Streams], RampSchedule]
    converter: Converter = field(default_factory=Converter)
    greatest_range: float = 30.0

    def receiver(
        self, *, false_alarm_probability: float = 1e-6, dynamic_range: float = 60.0
    ) -> CoherentReceiver:
        """The receiver of these frames; ``dynamic_range`` is in dB."""
        return CoherentReceiver(
            greatest_range=self.greatest_range,
            false_alarm_probability=false_alarm_probability,
            dynamic_range=from_db(dynamic_range),
        )


def _triangles(streams: Streams) -> RampSchedule:
    waveform = Triangular(bandwidth=1e9, ramp_duration=1e-3)
    return waveform.schedule(num_sweeps=16, streams=streams)


def _diverse_triangles(streams: Streams) -> RampSchedule:
    return DiverseTriangular().schedule(num_sweeps=16, streams=streams)


def _chirps(streams: Streams) -> RampSchedule:
    return drawn_chirps(128, seed=int(streams["chirps"].integers(_MOST_SIGNED_SEED)))


KINDS: Final[Mapping[str, Kind]] = {
    "16 equal triangles": Kind(schedule=_triangles),
    "16 diverse triangles": Kind(schedule=_diverse_triangles),
    "128 drawn chirps": Kind(
        schedule=_chirps,
        converter=Converter(sample_rate=20e6, start=2e-6, margin=1e-6),
        greatest_range=40.0,
    ),
}
"""Kinds of frames by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """Random numbers, noise and schedule of one trial.

    Parameters
    ----------
    kind : of the frame
    schedule : drawn for this trial
    random : generator of the trial's points
    seed : of the noise
    """

    kind: Kind
    schedule: RampSchedule
    random: np.random.Generator
    seed: int

    @classmethod
    def of(cls, name: str, case: Sequence[int], trial: int) -> Draw:
        """The draw of a trial; no two cases have the same."""
        kind = KINDS[name]
        random = np.random.default_rng([2026, *case, list(KINDS).index(name), trial])
        seeds = random.integers(_MOST_SIGNED_SEED, size=2)
        schedule = kind.schedule(Streams(int(seeds[0])))
        return cls(kind=kind, schedule=schedule, random=random, seed=int(seeds[1]))

    def frame(self, points: Sequence[HandPoint]) -> IfFrame:
        """A frame of these points in noise."""
        return frame_of(self.schedule, points, seed=self.seed, converter=self.kind.converter)

    def with_snr(self, point: HandPoint, snr: float) -> HandPoint:
        """The point with the power at the start that gives it this coherent SNR."""
        times = sample_times(self.schedule, self.kind.converter)
        elapsed = (times.time - self.schedule.start_time[0])[times.is_sample]
        distance = path_of(motion_of([point]), elapsed)[0, 0]
        energy = _ARRAY.num_channels * float(np.sum((point.range / distance) ** 4))
        return replace(point, power=snr / energy)

    @property
    def range_cell(self) -> float:
        """Resolution cell c/2B of the largest bandwidth, m."""
        return float(SPEED_OF_LIGHT / (2.0 * np.max(self.schedule.bandwidth)))

    @property
    def rate_cell(self) -> float:
        """Resolution cell λ/2T of the whole frame, m/s."""
        duration = float(self.schedule.end_time.max() - self.schedule.start_time.min())
        wavelength = SPEED_OF_LIGHT / float(np.mean(self.schedule.centre_frequency))
        return wavelength / (2.0 * duration)

    @property
    def limits(self) -> tuple[float, float]:
        """Greatest errors of range, m, and range rate, m/s, of a detection of a point."""
        return self.range_cell, RATE_SHARE * self.rate_cell


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Detection probability at one SNR; ``ideal`` is that of the ideal detector."""

    frame: str
    snr_db: float
    detection: Estimate
    ideal: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseRow:
    """False detections per frame in noise alone, expected and measured."""

    frame: str
    probability: float
    expected: float
    measured: Estimate
    num_trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PointsRow:
    """Points that the receiver finds and misses, and its false detections.

    Parameters
    ----------
    case : arrangement of the points
    found : share of the points, of the pairs, or of the weak points that are found
    missed, false : mean numbers per frame of what is not found, and of false detections
    most_false : greatest number of false detections in a frame
    """

    frame: str
    case: str
    found: Estimate
    missed: Estimate
    false: Estimate
    most_false: int
    num_trials: int


def detection_probability(
    *, num_trials: int = NUM_TRIALS, progress: Progress = no_progress
) -> tuple[Curve, ...]:
    """Detection probability of one point over its coherent SNR."""
    rows = []
    for number, name in enumerate(KINDS):
        progress("detection", number, len(KINDS))
        for step, snr_db in enumerate(DETECTION_SNRS):
            snr, found = from_db(snr_db), []
            for trial in range(num_trials):
                draw = Draw.of(name, (1, step), trial)
                point = draw.with_snr(drawn_point(draw.random), snr)
                is_found, _ = scored(draw.kind.receiver(), draw, [point])
                found.append(bool(is_found[0]))
            rows.append(
                Curve(
                    frame=name, snr_db=snr_db, detection=_share(found), ideal=ideal_probability(snr)
                )
            )
    return tuple(rows)


def ideal_probability(snr: float, *, false_alarm_probability: float = 1e-6) -> float:
    """Detection probability of the ideal detector at the receiver's threshold.

    >>> round(ideal_probability(from_db(14.0)), 2)
    0.71
    """
    channels = _ARRAY.num_channels
    threshold = threshold_of(false_alarm_probability, num_channels=channels)
    return float(ideal_detection(snr, num_channels=channels, threshold=threshold))


def false_detections(
    *, num_trials: int = NUM_NOISE_TRIALS, progress: Progress = no_progress
) -> tuple[NoiseRow, ...]:
    """Detections in noise alone."""
    rows = []
    for number, name in enumerate(KINDS):
        progress("false detections", number, len(KINDS))
        for step, probability in enumerate(FALSE_ALARM_PROBABILITIES):
            receiver = KINDS[name].receiver(false_alarm_probability=probability)
            expected, counts = [], []
            for trial in range(num_trials):
                frame = Draw.of(name, (2, step), trial).frame([])
                expected.append(receiver.expected_false_detections(frame))
                counts.append(receiver.detect(frame).num_detections)
            rows.append(
                NoiseRow(
                    frame=name,
                    probability=probability,
                    expected=float(np.mean(expected)),
                    measured=mean_count(np.array(counts, dtype=np.float64)),
                    num_trials=num_trials,
                )
            )
    return tuple(rows)


def ten_points(
    *, num_trials: int = NUM_LONG_TRIALS, progress: Progress = no_progress
) -> tuple[PointsRow, ...]:
    """Ten points at random, with powers of 10 dB to either side of a law 1/R⁴."""

    def points(draw: Draw) -> list[HandPoint]:
        return [_one_of_ten(draw.random) for _ in range(10)]

    return _counted("ten points", 3, points, num_trials, progress)


def passing_points(
    *, num_trials: int = NUM_LONG_TRIALS, progress: Progress = no_progress
) -> tuple[PointsRow, ...]:
    """A point that passes 2 to 4 m beside the radar on a straight line."""
    return _counted(
        "passing point", 4, lambda draw: [_passing_point(draw.random)], num_trials, progress
    )


def close_points(
    *,
    num_trials: int = NUM_TRIALS,
    num_unequal_trials: int = NUM_LONG_TRIALS,
    progress: Progress = no_progress,
) -> tuple[PointsRow, ...]:
    """Two points in neighbouring cells, and a weak one beside a strong one."""
    rows = []
    for number, name in enumerate(KINDS):
        progress("close points", number, len(KINDS))
        rows += [_two_equal(name, axis, num_trials) for axis in ("range", "range rate")]
        rows += [
            _weak_beside_strong(name, step, above, dynamic_range, num_unequal_trials)
            for step, (above, dynamic_range) in enumerate(WEAK_POINTS)
        ]
    return tuple(rows)


def drawn_point(random: np.random.Generator, *, greatest_acceleration: float = 1.0) -> HandPoint:
    """A point of unit power, uniformly drawn from the ranges and range rates of the map."""
    return HandPoint(
        range=random.uniform(3.0, 29.0),
        range_rate=random.uniform(-SPAN_OF_RATES, SPAN_OF_RATES),
        acceleration=random.uniform(0.0, greatest_acceleration),
        azimuth=random.uniform(-1.0, 1.0),
    )


def motion_of(points: Iterable[HandPoint]) -> FloatArray:
    """Motions at the start of the frame, ``(point, 3)``."""
    rows = [(point.range, point.range_rate, point.acceleration) for point in points]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def scored(
    receiver: CoherentReceiver, draw: Draw, points: Sequence[HandPoint], share: float = 1.0
) -> tuple[BoolArray, int]:
    """Mask of the points that are found in their frame, and the number of false detections.

    ``share`` multiplies the limits of the errors.
    """
    found = receiver.detect(draw.frame(points))
    range_limit, rate_limit = draw.limits
    elapsed = found.time - float(draw.schedule.start_time[0])
    distance, rate, _ = path_of(motion_of(points), np.array(elapsed))
    error = np.maximum(
        np.abs(found.range - distance[:, None]) / (share * range_limit),
        np.abs(found.range_rate - rate[:, None]) / (share * rate_limit),
    )
    is_found = _assigned(error)
    return is_found, found.num_detections - int(is_found.sum())


def _assigned(error: FloatArray) -> BoolArray:
    """Mask of the points that have a detection of their own with an error of at most 1.

    As many points as possible have one; ``error`` is ``(point, detection)``.
    """
    from scipy.optimize import linear_sum_assignment

    is_found = np.zeros(len(error), dtype=bool)
    point, detection = linear_sum_assignment(np.where(error <= 1.0, error, 1e3))
    is_found[point] = error[point, detection] <= 1.0
    return is_found


def _counted(
    case: str,
    part: int,
    points_of: Callable[[Draw], list[HandPoint]],
    num_trials: int,
    progress: Progress,
) -> tuple[PointsRow, ...]:
    """The points of every trial, as the receiver finds them."""
    rows = []
    for number, name in enumerate(KINDS):
        progress(case, number, len(KINDS))
        read = []
        for trial in range(num_trials):
            draw = Draw.of(name, (part,), trial)
            read.append(scored(draw.kind.receiver(), draw, points_of(draw)))
        rows.append(_row(name, case, read))
    return tuple(rows)


def _two_equal(name: str, axis: str, num_trials: int) -> PointsRow:
    """Two points of one azimuth and power, one cell apart in range or range rate."""
    read = []
    for trial in range(num_trials):
        draw = Draw.of(name, (5, int(axis == "range")), trial)
        first = draw.with_snr(drawn_point(draw.random), PAIR_SNR)
        if axis == "range":
            second = replace(first, range=first.range + draw.range_cell)
        else:
            second = replace(first, range_rate=first.range_rate + draw.rate_cell)
        points = [first, draw.with_snr(second, PAIR_SNR)]
        # half of the limits: a detection in the middle is of neither point
        is_found, num_false = scored(draw.kind.receiver(), draw, points, share=0.5)
        read.append((np.array([is_found.all()]), num_false))
    return _row(name, f"two points, one cell apart in {axis}", read)


def _weak_beside_strong(
    name: str, step: int, above: float, dynamic_range: float, num_trials: int
) -> PointsRow:
    """A weak point four range cells behind one that is ``above`` dB stronger."""
    receiver, read = KINDS[name].receiver(dynamic_range=dynamic_range), []
    for trial in range(num_trials):
        draw = Draw.of(name, (6, step), trial)
        weak = draw.with_snr(drawn_point(draw.random), PAIR_SNR)
        strong = replace(weak, range=weak.range - 4.0 * draw.range_cell)
        points = [draw.with_snr(strong, PAIR_SNR * from_db(above)), weak]
        is_found, num_false = scored(receiver, draw, points)
        read.append((is_found[1:], num_false))
    case = f"{above:g} dB below a point, dynamic range {dynamic_range:g} dB"
    return _row(name, case, read)


def _one_of_ten(random: np.random.Generator) -> HandPoint:
    point = drawn_point(random, greatest_acceleration=3.0)
    power = 3e3 * 10.0 ** random.uniform(-1.0, 1.0) * (3.0 / point.range) ** 4
    return replace(point, power=power)


def _passing_point(random: np.random.Generator) -> HandPoint:
    """A point at 5 to 25 m/s on a line parallel to the radar's axis, 1.5 to 20 m ahead."""
    ahead, speed = random.uniform(1.5, 20.0), random.uniform(5.0, 25.0)
    beside = random.uniform(2.0, 4.0) * random.choice((-1.0, 1.0))
    distance = float(np.hypot(ahead, beside))
    return HandPoint(
        range=distance,
        range_rate=-speed * ahead / distance,
        acceleration=speed**2 * beside**2 / distance**3,
        azimuth=float(np.arctan2(beside, ahead)),
        sine_rate=speed * ahead * beside / distance**3,
        power=100.0 * (5.0 / distance) ** 4,
    )


def _row(frame: str, case: str, read: Sequence[tuple[BoolArray, int]]) -> PointsRow:
    """Row of frames with these masks of found points and numbers of false detections."""
    masks, false = zip(*read, strict=True)
    hits = np.array([mask.sum() for mask in masks], dtype=np.float64)
    counts = np.array([mask.size for mask in masks], dtype=np.float64)
    return PointsRow(
        frame=frame,
        case=case,
        found=proportion(hits, counts),
        missed=mean_count(counts - hits),
        false=mean_count(np.array(false, dtype=np.float64)),
        most_false=max(false),
        num_trials=len(false),
    )


def _share(hits: Sequence[bool]) -> Estimate:
    return proportion(np.array(hits, dtype=np.float64), np.ones(len(hits)))
