"""Power over range from all ramps together, as a figure shows it beside the detections.

It is the maximum of a range-rate map over beams and range rates. The map adds powers of ramps, not
samples in phase: it has few range rates, and shows cross-pairing ridges, interference and noise.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import compiled
from polychirp.model.if_frame import IfFrame, IfParts, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.angle.beamform import beamform, orthogonal_sines, steering
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.settings import SearchSettings, range_axis
from polychirp.receiver.signal_model.equal_ramps import refuse_code
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import beat_frequency, hann_weights
from polychirp.receiver.signal_model.power_spectra import power_spectra, spectrum_size
from polychirp.threads import in_ranges


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


def range_response(limits: SearchSettings, frame: IfFrame, parts: IfParts) -> RangeResponse:
    """Power over range of a frame, after the mitigation and within the limits of a receiver.

    `CapabilityError` is raised if the ramps carry a code.
    """
    refuse_code(frame.schedule, "a response over range leaves out", instead="decode it first")
    cleaned = mitigated(limits.mitigation, frame)
    weight = hann_weights(cleaned.weight)
    grid = response_grid(limits, frame.schedule)
    size = spectrum_size(frame.times)
    beams = steering(
        frame.array,
        frequency=float(np.mean(frame.schedule.centre_frequency)),
        sine=orthogonal_sines(frame.array.num_channels),
    )

    def along_range(samples: ComplexArray) -> FloatArray:
        power = power_spectra(beamform(samples, beams), weight, size)
        logs = np.log(np.maximum(power, 1e-300))
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


def response_grid(limits: SearchSettings, schedule: RampSchedule) -> Grid:
    """Axes of the map, in steps of half a range cell and a third of one ramp's Doppler cell.

    The cells are those of the largest bandwidth and the longest ramp. Chosen: no peak is missed.
    """
    wavelength = SPEED_OF_LIGHT / float(np.max(schedule.centre_frequency))
    step = wavelength / (6.0 * float(np.max(schedule.duration)))
    count = int(np.ceil(limits.greatest_speed / step))
    return Grid(
        range=range_axis(limits, schedule),
        range_rate=step * np.arange(-count, count + 1, dtype=np.float64),
        time=float(schedule.start_time[0]),
    )


def log_range_rate_map(
    logs: FloatArray, schedule: RampSchedule, times: SampleTimes, grid: Grid
) -> FloatArray:
    r"""Mean over ramps of ln(power) at the beats of a point at every range and range rate.

    .. math:: S(R, v) = \frac1K \sum_k \ln \left|X_k\big(f_{b,k}(R, v)\big)\right|^2

    The point's beat follows from the slope, carrier and time of each ramp, range migration
    included, so ramps may differ. The mean of the logarithm (a geometric mean of power) is high
    only if every ramp has power at its beat; it stays low at a cross-pairing
    ridge, and for interference on single ramps. The bin nearest to the beat is read: a mean of two
    bins would change the distribution of the noise. The shape is ``(beam, range_rate, range)``.
    """
    # beats are linear in range
    first, last = (
        beat_frequency(
            schedule,
            times,
            distance=np.full(grid.range_rate.shape, distance),
            range_rate=grid.range_rate,
            time=grid.time,
        )
        * (logs.shape[-1] / times.rate)
        for distance in (grid.range[0], grid.range[-1])
    )
    step = (last - first) / (grid.range.size - 1)
    out = np.zeros((len(logs), grid.range_rate.size, grid.range.size))
    in_ranges(_read_along, grid.range_rate.size, logs, first, step, out)
    return out


@compiled
def _read_along(  # pragma: no cover
    begin: int, end: int, logs: Any, first: Any, step: Any, out: Any
) -> None:
    beams, ramps, size = logs.shape
    num_ranges = out.shape[2]
    for i in range(begin, end):
        for b in range(beams):
            for k in range(ramps):
                place = first[i, k]
                for j in range(num_ranges):
                    out[b, i, j] += logs[b, k, int(np.floor(place + 0.5)) & (size - 1)]
                    place += step[i, k]
            for j in range(num_ranges):
                out[b, i, j] /= ramps
