"""Power over range from all ramps together, and the map that it is made of."""

import numpy as np
import pytest

from polychirp.model.if_frame import IfParts, sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.overview.range_response import log_range_rate_map, range_response
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import hann_weights
from polychirp.receiver.signal_model.power_spectra import power_spectra, spectrum_size
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of
from tests.support.references.receiver import log_range_rate_map_by_loops

RAMPS = DiverseTriangular().schedule(num_sweeps=4, streams=Streams(3))
TIMES = sample_times(RAMPS, Converter())
GRID = Grid(range=np.arange(1.0, 4.0, 0.1), range_rate=np.linspace(-9.0, 9.0, 7), time=0.0)


def spectra_of(frame):
    weight = hann_weights(frame.times.is_sample)
    return np.log(power_spectra(frame.samples, weight, spectrum_size(frame.times)))


def test_the_fast_map_equals_its_reference():
    logs = spectra_of(frame_of(RAMPS, [HandPoint(range=2.0)]))
    fast = log_range_rate_map(logs, RAMPS, TIMES, GRID)
    slow = log_range_rate_map_by_loops(logs, RAMPS, TIMES, GRID)
    # a beat on the edge between two bins may round either way
    assert np.mean(np.abs(fast - slow) > 1e-9) < 1e-3


def test_the_map_peaks_where_the_point_is():
    """With ramps of different slopes and a range that migrates by half a metre in the frame."""
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(3))
    frame = frame_of(ramps, [HandPoint(range=2.5, range_rate=-9.0, power=10.0)])
    values = log_range_rate_map(spectra_of(frame), ramps, frame.times, GRID).sum(axis=0)
    i, j = np.unravel_index(np.argmax(values), values.shape)
    assert GRID.range_rate[i] == pytest.approx(-9.0)
    assert GRID.range[j] == pytest.approx(2.5, abs=0.11)


def test_white_noise_has_the_same_level_in_every_spectrum():
    """E ln|X|² of unit noise is −γ, whatever window and length."""
    logs = spectra_of(frame_of(RAMPS, [], noise=1.0))
    cells = TIMES.num_samples.sum() * 4 / 2.0  # Hann: about half of the bins independent
    assert logs.mean() == pytest.approx(-np.euler_gamma, abs=4 * 1.28 / np.sqrt(cells))


def test_the_response_shows_the_power_of_a_point():
    """Between two beams, and up to a quarter of a cell from the nearest bins: within 1 dB."""
    samples = frame_of(RAMPS, [HandPoint(range=9.0, azimuth=0.3, power=1e4)], noise=0.0).samples
    noise = frame_of(RAMPS, [], seed=2)
    parts = IfParts(samples=np.stack([samples, noise.samples]), names=("echo", "noise"))
    response = range_response(CoherentReceiver(), noise.with_samples(parts.total()), parts)
    at_point = np.argmin(np.abs(response.range - 9.0))
    peak = response.power[at_point - 2 : at_point + 3].max()
    assert 10 * np.log10(peak / 1e4) == pytest.approx(0.0, abs=1.0)
    assert response.noise < 1.0
