"""Detections of a frame of subframes: each subframe is read alone, then they are associated."""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.angle.directions import angles_of
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.range_doppler.association import (
    Associated,
    SubframeDetections,
    associated,
)
from polychirp.receiver.range_doppler.peaks import blend_over_rates
from polychirp.receiver.range_doppler.subframes import (
    frame_of,
    span_of,
    subframes,
    unambiguous_span,
)
from polychirp.receiver.range_doppler.transforms import middle_frequency
from polychirp.receiver.signal_model.transmit_codes import code_blocks, virtual_channels

CELL_VARIANCE: Final = 0.4
"""Variance of an interpolated peak, cells², times the SNR of its cell over all channels. Measured
on a point at SNRs of 18 to 40 dB: 0.26 to 0.5, along range and along range rate."""

RATE_FLOOR, RANGE_FLOOR, COSINE_FLOOR = 0.05, 0.3, 0.03
"""Standard deviations of strong echoes between subframes: of the range rate and of the range, in
cells, and of the direction cosine to the left. Chosen: interpolation is wrong by 0.01 cells, and
the strongest scatterer of a body may change."""

LEVEL_DEVIATION: Final = 0.92
"""Standard deviation of an echo's logarithmic power between subframes, chosen: 4 dB."""


BLEND_DEVIATION: Final = 0.5
"""Standard deviation of the range rate, cells, over the blend of a peak (`blend_over_rates`).
Chosen: two points of alike power 1.5 cells apart move their peak by half a cell and more from
subframe to subframe."""

TANGENTIAL_SPEED: Final = 25.0
"""Greatest speed across the line of sight, m/s, for which subframes are associated: at the range R
it causes the radial acceleration 25²/R. Chosen: a gantry 5 m above a radar of 130 km/h has it at
7 m. With half of it, 5 of 40 drawn points of 5 to 80 m/s² were lost, and none with 25 m/s. Among 15
points within 9 m, two subframes had 13 wrong speeds in 150 frames with 0 and with half of it, 20
with it, and 21 with twice."""

WIDEST_SMEAR: Final = 1.0
"""Greatest change of the range rate within a subframe, in cells, for which subframes are
associated. Chosen: range rates that fold alike to a cell count as one (`subframes.DISTINCT`), and
a change by more would make others alike. Points that change by three cells still have one peak."""


def detect_by_subframes(
    read: Callable[[IfFrame], tuple[Detections, RangeRateMap]],
    frame: IfFrame,
    *,
    tells_folds_apart: bool,
) -> Detections:
    """Detections that all subframes agree on, strongest first; they refer to the frame's middle.

    Range rates are fitted to the unfolded ones together with a radial acceleration; ranges are the
    weighted means of the values at the middle of the frame, directions those of their cosines.
    Powers and SNRs are means over the subframes.

    Parameters
    ----------
    read : receiver of a frame whose ramps are at equal intervals: its detections and their map
    tells_folds_apart : True if ``read`` resolves the range rates that a code of the transmitting
        elements leaves open; if False, directions of coded frames are NaN
    """
    frames = [frame_of(frame, ramps) for ramps in subframes(frame.schedule)]
    found, maps = zip(*(read(part) for part in frames), strict=True)
    length = 1 if tells_folds_apart else len(code_blocks(frames[0].schedule).weight)
    parts = [
        _measured(part, seen, map_, code_length=length)
        for part, seen, map_ in zip(frames, found, maps, strict=True)
    ]
    schedule = frame.schedule
    time = float(0.5 * (schedule.start_time[0] + schedule.end_time[-1]))
    span = unambiguous_span(schedule, code_length=length)
    targets = associated(parts, span=span, time=time)
    shift = middle_frequency(frames[0].schedule, frames[0].times) / float(schedule.slope[0])
    moved = [
        part.beat_range[k] - _beat_range_change(targets, late=part.time - time, shift=shift)
        for part, k in zip(parts, targets.member.T, strict=True)
    ]
    columns = targets.member.T
    distance = _weighted(moved, [p.range_variance[k] for p, k in zip(parts, columns, strict=True)])
    left = _weighted(
        [p.left[k] for p, k in zip(parts, columns, strict=True)],
        [p.left_variance[k] for p, k in zip(parts, columns, strict=True)],
    )
    # noise and apertures of the subframes differ little, so that the mean has equal weights
    up = np.mean([np.sin(s.elevation[k]) for s, k in zip(found, columns, strict=True)], axis=0)
    azimuth, elevation = angles_of(left, up if length == 1 else np.full(up.size, np.nan))
    power = np.mean([seen.power[k] for seen, k in zip(found, columns, strict=True)], axis=0)
    snr = np.mean([seen.snr[k] for seen, k in zip(found, columns, strict=True)], axis=0)
    order = np.argsort(-power, kind="stable")
    return Detections(
        time=time,
        range=distance[order],
        range_rate=targets.range_rate[order],
        azimuth=azimuth[order],
        elevation=elevation[order],
        power=power[order],
        snr=snr[order],
        num_unresolved=targets.num_unresolved,
    )


def _measured(
    frame: IfFrame, seen: Detections, map_: RangeRateMap, *, code_length: int
) -> SubframeDetections:
    """A subframe's detections with their variances."""
    schedule, times = frame.schedule, frame.times
    middle = middle_frequency(schedule, times)
    slope = float(schedule.slope[0])
    # the map's range rates have the wavelength in the middle of the samples
    span = span_of(schedule) * float(schedule.centre_frequency[0]) / middle
    blocks = code_blocks(schedule)
    place, _ = virtual_channels(frame.array, schedule.num_elements)
    across = Elements.of(place, frequency=middle).place[:, 0]
    snr = frame.array.num_channels * len(blocks.weight) * np.maximum(seen.snr - 1.0, 0.1)
    rate_cell = span / schedule.num_ramps
    duration = float(schedule.end_time[-1] - schedule.start_time[0])
    range_cell = SPEED_OF_LIGHT * times.rate / (2.0 * abs(slope) * times.most_samples)
    # 1/(aperture × SNR) is the Cramér–Rao bound of the direction cosine of one wave
    aperture = 2.0 * max(float(np.var(2.0 * np.pi * across)), 1e-12)
    left = np.sin(seen.azimuth) * np.cos(np.nan_to_num(seen.elevation))
    beat_range = seen.range + seen.range_rate * middle / slope
    blend = blend_over_rates(map_, range_rate=seen.range_rate, range_=beat_range)
    return SubframeDetections(
        time=seen.time,
        span=span / code_length,
        beat_range=beat_range,
        range_rate=seen.range_rate,
        left=left if code_length == 1 else np.full(seen.num_detections, np.nan),
        level=np.log(np.maximum(seen.power, 1e-300)),
        acceleration=np.minimum(
            TANGENTIAL_SPEED**2 / np.maximum(seen.range, range_cell),
            WIDEST_SMEAR * rate_cell / duration,
        ),
        range_variance=range_cell**2 * (CELL_VARIANCE / snr + RANGE_FLOOR**2),
        rate_variance=rate_cell**2
        * (CELL_VARIANCE / snr + RATE_FLOOR**2 + (BLEND_DEVIATION * blend) ** 2),
        left_variance=1.0 / (aperture * snr) + COSINE_FLOOR**2,
        level_variance=LEVEL_DEVIATION**2,
    )


def _beat_range_change(targets: Associated, *, late: float, shift: float) -> FloatArray:
    """Difference of a later beat, as a range, from the range at the time of the range rates, m.

    Parameters
    ----------
    late : s after that time
    shift : s, range by which a beat is shifted over the range rate that shifts it
    """
    rate = targets.range_rate + targets.acceleration * late
    return (targets.range_rate + 0.5 * targets.acceleration * late) * late + rate * shift


def _weighted(values: Sequence[FloatArray], variances: Sequence[FloatArray]) -> FloatArray:
    """Mean over subframes, weighted with the inverse of the variances, ``(target,)``."""
    weight = 1.0 / np.stack(variances)
    return np.asarray(np.sum(weight * np.stack(values), axis=0) / np.sum(weight, axis=0))
