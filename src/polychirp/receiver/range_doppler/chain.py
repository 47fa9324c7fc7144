"""`RangeDoppler`: the usual receiver of chirp sequences."""

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.antenna import AntennaArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.model.spectra import RangeRateMap, RangeRateSpectra
from polychirp.receiver.angle.ambiguity import beam_of
from polychirp.receiver.angle.directions import directions
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.clustering import merged
from polychirp.receiver.detection.cfar import (
    CfarWindow,
    Crossings,
    crosses_again,
    crosses_its_row,
    ordered_statistic,
)
from polychirp.receiver.detection.looks import independent_looks
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.range_doppler.combination import detect_by_subframes
from polychirp.receiver.range_doppler.fold_ambiguity import EQUAL_POWER, folds_are_told_apart
from polychirp.receiver.range_doppler.peaks import interpolated_peaks, is_local_maximum
from polychirp.receiver.range_doppler.side_lobes import GapLobes, lobes_over_range, stands_out
from polychirp.receiver.range_doppler.subframes import (
    has_subframes,
    ramps_of,
    subframes,
    unambiguous_span,
    unreadable,
)
from polychirp.receiver.range_doppler.transforms import (
    middle_frequency,
    range_profiles,
    range_rate_spectra,
    refuse,
    taper,
    unfit,
)
from polychirp.receiver.range_doppler.unfolding import EQUAL_BEAMS, unfolded
from polychirp.receiver.settings import DetectorSettings
from polychirp.receiver.signal_model.equal_ramps import (
    phases_are_coded,
    refuse_code,
    refuse_steps,
)
from polychirp.receiver.signal_model.transmit_codes import (
    CodeBlocks,
    code_blocks,
    virtual_channels,
)
from polychirp.threads import one_blas_thread

AROUND: Final = CfarWindow(guard=(3, 3), training=(8, 8), step=(2, 2), is_circular=(True, False))
"""Training cells of `RangeDoppler` around a cell; every other one, as tapers correlate neighbours.
Chosen."""

SAME_RANGE: Final = CfarWindow(
    guard=(3, 0), training=(40, 0), step=(2, 1), is_circular=(True, False)
)
"""Training cells of the same range as the cell; chosen, as many as are needed for a loss of some
tenths of a decibel."""

SPARE_CELLS: Final = 3
"""Number of cells of the map beyond the greatest range. Chosen: the main lobe of the taper is two
cells wide to either side, so that a point at the limit has its peak and a neighbour in the map."""

FEWEST_RATES: Final = 64
"""Number of range rates of a map below which ridges over them are not looked for. Chosen: a window
of the same range then has 28 training cells; with few, a target beside the cell is among them."""

FEWEST_RANGES: Final = 64
"""Number of ranges of a map below which ridges over them are not looked for. Chosen: 32 of them are
compared; with few, the points of a single body fill most of them."""

RIDGE_QUANTILE: Final = 0.3
"""Rank of the range, as a share of their number, that gives the level of a range rate. Chosen:
targets at one range rate make no ridge while they fill less than 70 % of the ranges. At 0.6, they
do where they fill 40 %, as thirty posts of a guard rail; at 0.15, exponential powers of a ridge
have half the level, and a ridge counts as one only where it is twice as strong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RangeDoppler(DetectorSettings):
    """Receiver of equal chirps: two Fourier transforms, ordered-statistic CFAR, MIMO decoding.

    The steps: mitigation, tapered transforms over each chirp and over the chirps, power summed over
    channels, CFAR with as many looks as channels are independent (`independent_looks`), local
    maxima interpolated between cells, the choice among the range rates that a code of the
    transmitting elements leaves open (`unfolding`), azimuths and elevations from the virtual
    array's amplitudes in the cell, which are one snapshot (`angle.directions`).

    Range rates beyond half the span λ/2T of chirps T apart appear inside it: `polychirp check`
    names targets for which this happens. Subframes of different T are read one by one, and their
    folded range rates tell the true one (`association`); a detection that not all of them have, or
    whose range rate remains unresolved, is dropped. Points closer than a cell or two are one
    detection.

    Parameters
    ----------
    window : training cells of the CFAR, over (range rate, range), smaller on a small map; None:
        those of `training`
    quantile : rank of the training cell that gives the floor, as a share of their number
    unfolds : True if the range rates that a code leaves open are told apart by the virtual array's
        beams, for which the phases of its channels must be right to a fraction of a radian; else
        by the bands of the code that no element uses, or, if all are used, the lowest is taken

    Examples
    --------
    A point at 12 m that recedes at 3 m/s, as strong as the noise of a sample:

    >>> from polychirp.constants import SPEED_OF_LIGHT
    >>> from polychirp.model.antenna import AntennaArray
    >>> from polychirp.model.if_frame import SampleTimes
    >>> k = np.arange(64)
    >>> ramps = RampSchedule(start_time=k * 60e-6, duration=0 * k + 50e-6,
    ...     start_frequency=0 * k + 77e9, slope=0 * k + 10e12, start_phase=0 * k, sweep=k)
    >>> times = SampleTimes(first=ramps.start_time + 5e-6, num_samples=0 * k + 128, rate=4e6)
    >>> delay = 2 * (12.0 + 3.0 * times.time) / SPEED_OF_LIGHT
    >>> in_ramp = times.time - ramps.start_time[:, None]
    >>> samples = np.exp(2j * np.pi * (77e9 + 10e12 * (in_ramp - delay / 2)) * delay)
    >>> noise = np.random.default_rng(1).normal(scale=0.7, size=(2, *samples.shape))
    >>> samples = samples + noise[0] + 1j * noise[1]
    >>> frame = IfFrame(samples=samples[None], times=times, schedule=ramps,
    ...     array=AntennaArray(num_channels=1))
    >>> found = RangeDoppler().detect(frame)
    >>> found.range.round(1), found.range_rate.round(2)  # 12 m, and 1.9 ms at 3 m/s
    (array([12.]), array([3.]))
    """

    window: CfarWindow | None = None
    quantile: float = 0.6
    unfolds: bool = True
    kind: Literal["range-doppler"] = "range-doppler"

    def __post_init__(self) -> None:
        super(RangeDoppler, self).__post_init__()
        if not 0.0 < self.quantile <= 1.0:
            raise InputError(f"a receiver's quantile of {self.quantile:g} is not in (0, 1]")

    def tells_folds_apart(self, schedule: RampSchedule, array: AntennaArray) -> bool:
        """True if range rates beyond the span of a schedule's code are told apart.

        This holds if it does for nearly all directions (`fold_ambiguity`). One receiving channel
        has a beam for every range rate, so that only empty bands tell them.
        """
        return folds_are_told_apart(schedule, array, by_beams=self.unfolds)

    def unambiguous_span(self, schedule: RampSchedule, array: AntennaArray) -> float:
        """Span of the range rates that the receiver tells apart, m/s.

        It is that of a code of several sweeps where the code and the array leave its folds open.
        """
        is_told = self.tells_folds_apart(schedule, array)
        length = 1 if is_told else len(code_blocks(schedule).weight)
        return unambiguous_span(schedule, code_length=length)

    @one_blas_thread()
    def detect(self, frame: IfFrame, *, weight: FloatArray | None = None) -> Detections:
        """Detections of one frame, strongest first; range and azimuth in the middle of the frame.

        ``weight`` has the weights that the samples of every echo have already, ``(ramp, fast)``,
        such as those of a code's spectrum. Side lobes by them are no detections.

        Raises
        ------
        CapabilityError
            The ramps differ, are neither at equal intervals nor in subframes, carry a code within
            them, or have codes that do not separate the transmitting elements.
        """
        refuse_steps(frame.schedule, self.kind)
        refuse(unreadable(frame.schedule))
        if not has_subframes(frame.schedule):
            return self.detect_in(self.spectra(frame), frame, weight=weight)
        each = replace(self, grouping=None)

        def read(part: IfFrame) -> tuple[Detections, RangeRateMap]:
            spectra = each.spectra(part)
            return each.detect_in(spectra, part), spectra.mean_power

        seen = detect_by_subframes(
            read,
            frame,
            tells_folds_apart=self.tells_folds_apart(frame.schedule, frame.array),
        )
        return seen if self.grouping is None else merged(seen, self.grouping)

    def training(self, schedule: RampSchedule) -> CfarWindow:
        """Training cells of the CFAR for a schedule.

        If a code changes the phases from ramp to ramp, signals without this code are spread over
        all range rates of their range, and a floor belongs to a range: training cells are those of
        the same range. Otherwise they are around the cell, and a cell on a ridge over all range
        rates, such as the signal of a radar with a code, must stand out of the ridge as well.
        """
        if self.window is not None:
            return self.window
        return SAME_RANGE if phases_are_coded(schedule) else AROUND

    def spectra(self, frame: IfFrame) -> RangeRateSpectra:
        """Spectra of the frame after mitigation, one for each channel and sweep of the code.

        They reach `SPARE_CELLS` beyond the greatest range, so that points near it have their peaks
        in the map, and half a cell more for each sweep of the code: by that the Doppler shift of
        the fastest point that the code tells moves its beat.
        Amplitudes are divided by the mean weight that mitigation leaves to the samples, with the
        tapers of both transforms, so that an echo keeps its power.
        """
        refuse_code(frame.schedule, f"the receiver '{self.kind}' does not remove")
        refuse(unfit(frame.schedule))
        blocks = code_blocks(frame.schedule)
        if self.mitigation is not None:
            cleaned = mitigated(self.mitigation, frame)
            share = max(tapered_mean(cleaned.weight, blocks), 1e-300)
            frame = frame.with_samples(cleaned.samples * cleaned.weight / share)
        spare = SPARE_CELLS + (blocks.ramps.shape[1] + 1) // 2
        profiles = range_profiles(frame, greatest_range=self.greatest_range, spare=spare)
        return range_rate_spectra(profiles, frame, blocks)

    def num_cells(self, map_: RangeRateMap) -> int:
        """Number of cells of a map within the receiver's limits of range."""
        is_near = (map_.range >= self.least_range) & (map_.range <= self.greatest_range)
        return map_.range_rate.size * int(np.count_nonzero(is_near))

    def detect_in(
        self, spectra: RangeRateSpectra, frame: IfFrame, *, weight: FloatArray | None = None
    ) -> Detections:
        """Detections, as of `detect`, from the `spectra` of the frame."""
        map_ = spectra.mean_power
        blocks = code_blocks(frame.schedule)
        gaps = self._gap_lobes(frame, blocks, weight)
        lobes = lobes_over_range(map_.range.size, num_samples=frame.times.most_samples, gaps=gaps)
        found = self._crossings(map_.power, spectra, frame.schedule, side_lobe=lobes)
        is_peak = is_local_maximum(map_.power, row=found.row, column=found.column)
        # the last cell has no neighbour that tells whether the peak is in it
        found = found.chosen(is_peak & (found.column < map_.range.size - 1))
        places = interpolated_peaks(map_, row=found.row, column=found.column)
        is_point = stands_out(
            found,
            map_,
            places,
            num_samples=frame.times.most_samples,
            gaps=gaps,
        )
        found = found.chosen(is_point)
        rate, beat_range, power = (place[is_point] for place in places)
        cells = spectra.amplitude[:, found.row, found.column].T.astype(np.complex128)
        cells = cells.reshape(found.row.size, frame.array.num_channels, len(blocks.weight))
        is_told = self.tells_folds_apart(frame.schedule, frame.array)
        decoded = unfolded(
            frame,
            blocks,
            cells,
            rate,
            floor=found.floor,
            by_beams=self.unfolds,
            equal_beams=EQUAL_BEAMS if is_told else 1.0 - EQUAL_POWER,
        )
        of = decoded.detection
        power = power[of] * decoded.share
        schedule = frame.schedule
        middle = middle_frequency(schedule, frame.times)
        distance = beat_range[of] - decoded.range_rate * middle / schedule.slope[0]
        place, _ = virtual_channels(frame.array, schedule.num_elements)
        azimuth, elevation = directions(
            decoded.amplitude[:, :, None],
            Elements.of(place, frequency=middle),
            estimator=self.angle,
            beam=beam_of(frame.array.pattern),
        )
        is_near = (distance >= self.least_range) & (distance <= self.greatest_range)
        order = np.argsort(-power, kind="stable")
        order = order[is_near[order]]
        seen = Detections(
            time=float(0.5 * (schedule.start_time[0] + schedule.end_time[-1])),
            range=distance[order],
            range_rate=decoded.range_rate[order],
            azimuth=azimuth[order],
            elevation=elevation[order],
            power=power[order],
            snr=(decoded.share * (found.power / found.floor)[of])[order],
        )
        return seen if self.grouping is None else merged(seen, self.grouping)

    def _gap_lobes(
        self, frame: IfFrame, blocks: CodeBlocks, weight: FloatArray | None
    ) -> GapLobes | None:
        """Side lobes by weights of the samples and those of mitigation; None if all are equal."""
        if self.mitigation is not None:
            cleaned = mitigated(self.mitigation, frame).weight
            weight = cleaned if weight is None else weight * cleaned
        if weight is None or np.ptp(weight) == 0.0:
            return None
        is_falling = bool(frame.schedule.slope[0] < 0.0)
        return GapLobes.of(weight, blocks.ramps[:, :, 0], is_falling=is_falling)

    def _crossings(
        self,
        power: FloatArray,
        spectra: RangeRateSpectra,
        schedule: RampSchedule,
        *,
        side_lobe: FloatArray,
    ) -> Crossings:
        """Cells above the threshold, and on a ridge over either axis above that of the ridge."""
        window = self.training(schedule)
        looks = independent_looks(spectra.amplitude)
        found = ordered_statistic(
            power,
            window=window.fitted(power.shape),
            false_alarm_probability=self.false_alarm_probability,
            quantile=self.quantile,
            num_looks=looks,
        )
        if self.window is not None or window is not AROUND or len(power) < FEWEST_RATES:
            return found
        is_kept = crosses_again(
            power,
            found,
            window=SAME_RANGE.fitted(power.shape),
            false_alarm_probability=self.false_alarm_probability,
            quantile=self.quantile,
            num_looks=1.0,  # a ridge is one signal, of one direction
        )
        found = found.chosen(is_kept)
        if power.shape[1] < FEWEST_RANGES or found.row.size == 0:
            return found
        is_kept = crosses_its_row(
            power,
            found,
            false_alarm_probability=self.false_alarm_probability,
            quantile=RIDGE_QUANTILE,
            num_looks=looks,
            side_lobe=side_lobe,
        )
        return found.chosen(is_kept)

    def combined_power(self, amplitude: ComplexArray, schedule: RampSchedule) -> FloatArray:
        """Power, W, of amplitudes ``(…, ramp)``, tapered and added in phase over a code's blocks.

        This is what the map has in the cell of these amplitudes. In subframes, the power is the
        mean over the subframes.
        """
        if has_subframes(schedule):
            parts = subframes(schedule)
            each = [self.combined_power(amplitude[..., k], ramps_of(schedule, k)) for k in parts]
            return np.asarray(np.mean(each, axis=0))
        ramps = code_blocks(schedule).ramps[:, :, 0]
        along = taper(len(ramps))[:, None]
        return np.asarray(
            np.mean(np.abs(np.sum(along * amplitude[..., ramps], axis=-2)) ** 2, axis=-1)
        )

    def ramp_taper(self, schedule: RampSchedule) -> FloatArray:
        """Weight of every ramp in a cell of the map, with a mean of 1, ``(ramp,)``."""
        weight = np.zeros(schedule.num_ramps)
        if has_subframes(schedule):
            for some in subframes(schedule):
                weight[some] = self.ramp_taper(ramps_of(schedule, some))
            return weight
        ramps = code_blocks(schedule).ramps[:, :, 0]
        weight[ramps] = len(ramps) * taper(len(ramps))[:, None]
        return weight


def tapered_mean(weight: FloatArray, blocks: CodeBlocks) -> float:
    """Mean of samples' weights ``(ramp, fast)``, with the tapers of both transforms."""
    of_ramp = weight @ taper(weight.shape[1])
    return float(np.mean(taper(len(blocks.ramps)) @ of_ramp[blocks.ramps[:, :, 0]]))
