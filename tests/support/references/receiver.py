"""Slow and simple twins of the receiver's kernels."""

from __future__ import annotations

import math

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.detection.cfar import CfarWindow
from polychirp.receiver.estimation.azimuth_rate import sine_basis
from polychirp.receiver.estimation.cramer_rao import Bound, _bound_of
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import beat_frequency, replica


def count_below_twin(padded: FloatArray, level: FloatArray, offsets: IntArray) -> IntArray:
    """Slow reference of `count_below`: one comparison of maps for every training cell."""
    rows, columns = level.shape
    top = (padded.shape[0] - rows) // 2
    left = (padded.shape[1] - columns) // 2
    count = np.zeros((rows, columns), dtype=np.int64)
    for i, j in offsets:
        count += padded[top + i : top + i + rows, left + j : left + j + columns] < level
    return count


def log_range_rate_map_by_loops(
    logs: FloatArray, schedule: RampSchedule, times: SampleTimes, grid: Grid
) -> FloatArray:
    """Slow reference of `log_range_rate_map`: one cell after the other."""
    beams, ramps, size = logs.shape
    out = np.zeros((beams, grid.range_rate.size, grid.range.size))
    for i, rate in enumerate(grid.range_rate):
        for j, distance in enumerate(grid.range):
            beat = beat_frequency(
                schedule, times, distance=distance, range_rate=rate, time=grid.time
            )
            place = np.floor(beat * size / times.rate + 0.5).astype(np.int64) % size
            for k in range(ramps):
                out[:, i, j] += logs[:, k, place[k]] / ramps
    return out


def cramer_rao_bound_twin(
    schedule: RampSchedule,
    times: SampleTimes,
    array: AntennaArray,
    *,
    motion: FloatArray,
    azimuth: float,
    snr: float,
    time: float,
    is_acceleration_known: bool = False,
    sine_rate_deviation: float = math.inf,
) -> Bound:
    """Slow reference of `cramer_rao_bound`: finite differences of all samples of all channels."""
    frequency = float(np.mean(schedule.centre_frequency))

    elapsed = (times.time - time)[times.is_sample]

    def signal(point: FloatArray) -> FloatArray:
        own = replica(schedule, times, motion=point[:3], time=time)[times.is_sample]
        straight, turned = sine_basis(point[None, :3], elapsed)[:, 0]
        sine = np.sin(point[3]) * straight + point[4] * turned
        cycles = frequency / SPEED_OF_LIGHT * np.outer(array.position[:, 1], sine)
        both = np.exp(1j * point[5] - 2j * np.pi * cycles) * own * np.exp(point[6])
        return np.concatenate([both.real.ravel(), both.imag.ravel()])

    centre = np.array([*motion, azimuth, 0.0, 0.0, 0.0])
    slopes = []
    for i, step in enumerate((1e-6, 1e-5, 1e-3, 1e-5, 1e-4, 1e-5, 1e-5)):
        change = np.zeros(7)
        change[i] = step
        slopes.append((signal(centre + change) - signal(centre - change)) / (2.0 * step))
    jacobian = np.array(slopes)
    return _bound_of(
        2.0 * snr * jacobian @ jacobian.T, not is_acceleration_known, sine_rate_deviation
    )


def sines_of_sources_twin(
    covariances: ComplexArray, *, num_sources: int, spacing: float
) -> FloatArray:
    """Slow reference of `sines_of_sources`: one detection after the other."""
    found = []
    for matrix in np.asarray(covariances, dtype=np.complex128):
        _, vector = np.linalg.eigh(matrix)
        noise = vector[:, : matrix.shape[0] - num_sources]
        projector = noise @ noise.conj().T
        last = matrix.shape[0] - 1
        root = np.roots([np.trace(projector, offset=last - n) for n in range(2 * last + 1)])
        inner = sorted(root[np.abs(root) < 1.0], key=np.abs)[-num_sources:]
        found.append(np.sort(-np.angle(inner) / (2.0 * np.pi * spacing)))
    return np.array(found)


def training_cells(power: FloatArray, row: int, column: int, window: CfarWindow) -> FloatArray:
    """Powers ``(training cell,)`` of the training cells of one cell of the map.

    >>> training_cells(np.arange(8.0)[None], 0, 0, CfarWindow(guard=(0, 1), training=(0, 2)))
    array([2., 3.])
    """
    place = window.offsets + np.array([row, column])
    size = np.array(power.shape)
    inside = np.all(((place >= 0) & (place < size)) | np.array(window.is_circular), axis=1)
    i, j = (place[inside] % size).T
    return np.asarray(power[i, j])
