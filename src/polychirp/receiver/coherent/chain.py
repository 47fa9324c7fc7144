"""`CoherentReceiver`: from dechirped samples to detections, for ramps of any slopes and times."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.clustering import merged
from polychirp.receiver.coherent.beyond import BINS_PER_BEAT, with_fast_points, with_strong_points
from polychirp.receiver.coherent.coherent_map import MapLimits, map_axes
from polychirp.receiver.coherent.directions import directions
from polychirp.receiver.coherent.false_alarms import expected_peaks, map_area, threshold_of
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.parts import PartPowers, part_powers, powers
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.search import find_points, warn_of_peaks
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.settings import SearchSettings, need_dynamic_range
from polychirp.threads import one_blas_thread
from polychirp.units import Ratio, from_db


@dataclass(frozen=True, slots=True, kw_only=True)
class CoherentReceiver(SearchSettings):
    """Receiver that adds all samples of a frame in phase, on ramps of any slopes and times.

    The steps: mitigation; weights of the ramps by their noise, and channels made white (`noise`);
    the map of all samples in phase over range and range rate, with the powers of the channels
    added; peaks above a threshold of which all ramps agree (`agreement`); for each an acceleration,
    and a fit of motion and amplitudes to the samples; subtraction; and again, until the map shows
    noise alone. At the end, a point must stand out of what bodies leave (`residue`). One whose
    channels have two plane waves becomes two detections (`directions`).

    A weak point needs no more SNR than a matched filter of the whole frame asks for. Points one
    resolution cell apart in range or range rate are separate, and 60 dB of power apart if they are
    ideal points. A body beside the radar takes 20 to 40 points, and the frame 0.5 to 2 s.

    ``false_alarm_probability`` is the mean number of detections that noise alone causes, per
    resolution cell of the frame, c/2B by λ/2T (`false_alarms`).

    Parameters
    ----------
    dynamic_range : power ratio of the strongest point to the weakest peak that is tried and the
        weakest point that is kept, as received or in channels whose noise is white
    residue_margin : power ratio by which points that do not move with a body within 10 m stand out
        of what it leaves there (`residue`) more than they do of noise. With less than 9 dB, cars
        that pass nearby cause false detections of other speeds

    Examples
    --------
    A point at 12 m that recedes at 3 m/s, as strong as the noise of a sample, on 32 ramps of slopes
    and intervals that all differ:

    >>> from polychirp.model.antenna import AntennaArray
    >>> from polychirp.model.if_frame import SampleTimes
    >>> from polychirp.model.ramp import RampSchedule
    >>> draw, k = np.random.default_rng(1), np.arange(32)
    >>> start = 100e-6 * k + draw.uniform(0, 20e-6, 32)
    >>> slope = draw.uniform(8e12, 12e12, 32)
    >>> ramps = RampSchedule(start_time=start, duration=0 * k + 70e-6,
    ...     start_frequency=0 * k + 77e9, slope=slope, start_phase=0 * k, sweep=k)
    >>> times = SampleTimes(first=start + 5e-6, num_samples=0 * k + 256, rate=4e6)
    >>> delay = 2 * (12.0 + 3.0 * times.time) / SPEED_OF_LIGHT
    >>> in_ramp = times.time - start[:, None]
    >>> samples = np.exp(2j * np.pi * (77e9 + slope[:, None] * (in_ramp - delay / 2)) * delay)
    >>> noise = draw.normal(scale=0.7, size=(2, *samples.shape))
    >>> samples = samples + noise[0] + 1j * noise[1]
    >>> frame = IfFrame(samples=samples[None], times=times, schedule=ramps,
    ...     array=AntennaArray(num_channels=1))
    >>> found = CoherentReceiver().detect(frame)
    >>> found.range.round(2), found.range_rate.round(1)
    (array([12.]), array([3.]))
    """

    dynamic_range: Ratio = from_db(60.0)
    residue_margin: Ratio = from_db(9.0)
    kind: Literal["coherent"] = "coherent"

    def __post_init__(self) -> None:
        super(CoherentReceiver, self).__post_init__()
        need_dynamic_range(self.dynamic_range)
        if not self.residue_margin >= 1.0:
            raise InputError(
                f"residue_margin is a ratio of {self.residue_margin:g}; choose 1 (0 dB) or more"
            )

    @one_blas_thread()
    def detect(self, frame: IfFrame) -> Detections:
        """Detections of one frame, strongest first; range and azimuth in the frame's middle."""
        points, seen = self._points(frame)
        found, _ = self._detections(seen, points, spacing=frame.array.spacing)
        return found if self.grouping is None else merged(found, self.grouping)

    @one_blas_thread()
    def attribute(self, frame: IfFrame) -> tuple[Detections, PartPowers]:
        """Detections as of `detect`, and the function that gives the power of parts in each.

        It takes samples before mitigation, V ``(part, channel, ramp, fast)``, and gives W,
        ``(detection, part)``; `parts.part_powers` says what the power is. Of an object it is that
        of the point nearest to its place.
        """
        points, seen = self._points(frame)
        found, number = self._detections(seen, points, spacing=frame.array.spacing)
        whole, nearest = found, number
        if self.grouping is not None:
            whole, body = merged(found, self.grouping), self.grouping
            apart = np.abs(whole.range[:, None] - found.range) / body.gap
            apart += np.abs(whole.range_rate[:, None] - found.range_rate) / body.range_rate
            nearest = number[np.argmin(apart, axis=1)] if number.size else number
        cleaned = mitigated(self.mitigation, frame)

        def powers_of(samples: ComplexArray) -> FloatArray:
            return np.asarray(part_powers(seen, points, cleaned.repair(samples))[nearest])

        return whole, powers_of

    def expected_false_detections(self, frame: IfFrame) -> float:
        """Mean number of detections that noise alone would cause in this frame."""
        seen = Observation.of(frame, mitigated(self.mitigation, frame))
        axes, channels = map_axes(seen, MapLimits.of(self)), frame.array.num_channels
        threshold = threshold_of(self.false_alarm_probability, num_channels=channels)
        area = map_area(
            seen,
            range_span=float(np.ptp(axes.range)),
            range_rate_span=float(np.ptp(axes.range_rate)),
        )
        return float(area * expected_peaks(threshold, num_channels=channels))

    def _points(self, frame: IfFrame) -> tuple[Points, Observation]:
        """The points within the receiver's limits, and the observation with its noise."""
        seen = Observation.of(frame, mitigated(self.mitigation, frame))
        samples = Residual.of(seen, Points.none(len(seen.samples)))
        power = samples.spectra.hann_power(seen, BINS_PER_BEAT)
        limits = with_strong_points(seen, power, MapLimits.of(self))
        points, residual, adapted, untried = self._found(seen, samples, limits)
        wider = with_fast_points(adapted, power, residual, limits)
        if wider != limits:
            points, _, adapted, untried = self._found(seen, samples, wider)
        if untried is not None:
            warn_of_peaks(untried)
        distance, rate = points.motion[:, 0], points.motion[:, 1]
        is_inside = (distance >= self.least_range) & (distance <= self.greatest_range)
        return points[is_inside & (np.abs(rate) <= self.greatest_speed)], adapted

    def _found(
        self, seen: Observation, samples: Residual, limits: MapLimits
    ) -> tuple[Points, Residual, Observation, int | None]:
        """The result of `find_points` within limits."""
        threshold = threshold_of(self.false_alarm_probability, num_channels=len(seen.samples))
        return find_points(
            seen,
            samples,
            map_axes(seen, limits),
            threshold=threshold,
            dynamic_range=self.dynamic_range,
            most=self.most_detections,
            residue_margin=self.residue_margin,
        )

    def _detections(
        self, seen: Observation, points: Points, *, spacing: float
    ) -> tuple[Detections, IntArray]:
        """Points as detections, two where two waves arrive, and the number of each one's point."""
        spacing = spacing * float(seen.frequency.mean()) / SPEED_OF_LIGHT
        number, azimuth, share = directions(
            points, seen.mixing, spacing=spacing, estimator=self.angle
        )
        power = powers(seen, points)[number] * share
        order = np.argsort(-power, kind="stable")
        number = number[order]
        found = Detections(
            time=seen.model.time,
            range=points.motion[number, 0],
            range_rate=points.motion[number, 1],
            azimuth=azimuth[order],
            power=power[order],
            snr=(points.power[number] * share[order]),
        )
        return found, number
