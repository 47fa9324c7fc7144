"""The map of the residual while points are subtracted."""

import numpy as np
import pytest

from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.detection.residual_map import ResidualMap, strongest_peaks
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import beat_frequency, beat_phase
from polychirp.receiver.signal_model.spectral_fit import band_of
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of
from tests.support.references.receiver import rows_by_loops

RAMPS = DiverseTriangular().schedule(num_sweeps=4, streams=Streams(3))
TIMES = sample_times(RAMPS, Converter())
GRID = Grid(range=np.arange(1.0, 4.0, 0.1), range_rate=np.linspace(-9.0, 9.0, 7), time=0.0)
BEAMS = np.eye(4, dtype=np.complex128)


def beats(distance, rate):
    return beat_frequency(
        RAMPS, TIMES, distance=np.array([distance]), range_rate=np.array([rate]), time=0.0
    )


def map_and_band():
    ends = np.concatenate([beats(d, v) for d in (1.0, 4.0) for v in (-9.0, 9.0)])
    band = band_of(TIMES.is_sample, TIMES, lowest=ends.min(axis=0), highest=ends.max(axis=0))
    return ResidualMap(band, RAMPS, TIMES, GRID, BEAMS), band


def test_the_sum_of_rows_equals_its_reference():
    map_, band = map_and_band()
    frame = frame_of(RAMPS, [HandPoint(range=2.0)])
    map_.update(band.spectra(frame.samples), np.zeros((0, RAMPS.num_ramps)))
    slow = rows_by_loops(map_.logs, map_._start, map_._fraction, map_._step, GRID.range.size)
    assert map_.statistic == pytest.approx(slow, abs=1e-4)


def test_every_cell_reads_within_a_bin_of_its_beat():
    """Half a bin of rounding, and a sixteenth of a range step, which is a bin at most."""
    map_, band = map_and_band()
    row = np.arange(GRID.range.size) + (map_._start + map_._fraction / 8.0)[..., None]
    place = row * map_._step[:, None]  # (rate, ramp, range)
    for i, rate in enumerate(GRID.range_rate):
        for j, distance in enumerate(GRID.range):
            true = beats(distance, rate)[0] * band.size / band.rate - band.first
            assert np.abs(place[i, :, j] - true).max() < 1.0 / 16.0 + 0.02


def test_the_notch_of_a_removed_point_is_filled_with_noise():
    """Noise alone, a point fitted to it and removed: the level there is as elsewhere."""
    levels = []
    where = beats(2.0, 3.0)
    phases = beat_phase(RAMPS, TIMES, motion=np.array([[2.0, 3.0, 0.0]]), time=0.0)
    for seed in range(12):
        map_, band = map_and_band()
        spectra = band.spectra(frame_of(RAMPS, [], seed=seed).samples)
        _, residual = band.fit(spectra, phases, np.ones(RAMPS.num_ramps))
        map_.update(residual, where)
        for shift in (0.0, 0.7, 1.3):
            place = np.rint(where[0] * band.size / band.rate - band.first + 2.0 * shift)
            levels.append(np.exp(map_.logs[np.arange(8), place.astype(int)]).mean())
    assert np.mean(levels) == pytest.approx(1.0, abs=0.12)  # 1100 cells, two thirds depleted


def test_peaks_come_strongest_first_and_apart():
    excess = np.zeros((20, 20), dtype=np.float32)
    excess[3, 3], excess[3, 5], excess[10, 10], excess[15, 2] = 10.0, 9.9, 9.5, 5.0
    peaks = strongest_peaks(excess, 1.0, 2, 40)
    assert peaks.tolist() == [[3, 3], [10, 10]]  # 9.9 is beside the first, 5 is below 85 %
    assert len(strongest_peaks(excess, 11.0, 2, 40)) == 0


def test_a_target_between_two_beams_is_as_strong_as_one_in_a_beam():
    """Both of power 1 over all channels; 0.9 of it is asked for, twice the power is too much."""
    map_, _ = map_and_band()
    map_.statistic[:] = -20.0
    map_.statistic[1, 2] = [0.0, -20.0, -20.0, -20.0]
    map_.statistic[4, 7, 1:3] = np.log(0.5)
    floor = np.full((GRID.range.size, 4), -10.0)
    excess, beam = map_.excess(floor, np.log(0.9))
    assert np.argwhere(excess > 0).tolist() == [[1, 2], [4, 7]]
    assert excess[4, 7] == pytest.approx(10.0 + np.log(0.5), abs=1e-5)
    assert beam[4, 7] == 1
    assert map_.peak_level() == pytest.approx(0.0, abs=1e-6)
    assert not np.any(map_.excess(floor, np.log(2.0))[0] > 0)
