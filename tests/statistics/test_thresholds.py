"""False-alarm probabilities of thresholds on noise alone: stated against measured."""

import math

import numpy as np
import pytest
from scipy.stats import poisson

from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.angle.beamform import beamform, orthogonal_sines, steering
from polychirp.receiver.chain import Receiver, _Search, search_grid
from polychirp.receiver.detection.range_rate_map import (
    floor_over_range,
    log_range_rate_map,
    log_spectra,
    spectrum_size,
)
from polychirp.receiver.detection.threshold import (
    log_mean_threshold,
    log_median_of_noise,
    mean_threshold,
)
from polychirp.receiver.signal_model.point_signal import hann_weights
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.estimation import estimate_points
from tests.support.points import HandPoint, frame_of


def test_almost_half_of_the_noise_is_above_the_papers_threshold():
    """Rayleigh: P(a > mean a) = exp(−π/4); exponential: 1/e. 2e5 cells: ±0.35 % at 3 sigma."""
    noise = np.random.default_rng(1).normal(size=(2, 200_000))
    amplitude = np.hypot(*noise)
    assert np.mean(amplitude > mean_threshold(amplitude)) == pytest.approx(
        math.exp(-math.pi / 4), abs=0.0035
    )
    power = amplitude**2
    assert np.mean(power > mean_threshold(power)) == pytest.approx(math.exp(-1), abs=0.0035)


@pytest.mark.parametrize("probability", [1e-1, 1e-3, 1e-6])
def test_one_ramp_has_the_exponential_tail(probability):
    """P(ln P > x) = exp(−eˣ), so the threshold is ln(−ln p); saddle point: 2 % of p."""
    level = log_mean_threshold(num_ramps=1, false_alarm_probability=probability)
    assert math.exp(-math.exp(level)) == pytest.approx(probability, rel=0.02 + 0.03)


@pytest.mark.parametrize("probability", [1e-1, 1e-2, 1e-3])
def test_the_mean_of_logs_exceeds_its_threshold_as_often_as_stated(probability):
    """4e5 draws of 8 ramps: binomial, 4 sigma, and 1 % for the formula."""
    draws = np.log(np.random.default_rng(2).exponential(size=(400_000, 8))).mean(axis=1)
    level = log_mean_threshold(num_ramps=8, false_alarm_probability=probability)
    sigma = math.sqrt(probability / draws.size)
    assert np.mean(draws > level) == pytest.approx(probability, abs=4 * sigma + 0.01 * probability)


@pytest.mark.slow
@pytest.mark.parametrize("probability", [1e-2, 1e-3])
def test_the_receivers_map_has_the_stated_false_alarm_rate(probability):
    """Whole chain on noise: beams, window, diverse ramps, median floor, all cells of 20 frames.

    Cells share bins, so the effective number is about a tenth: 4 sigma of that. The floor is
    taken from the same map and follows it a little, which this threshold does not know: it costs
    false alarms, never adds any. The receiver's own map follows below.
    """
    receiver = Receiver(false_alarm_probability=probability)
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    times = sample_times(ramps, Converter())
    crossings, cells = 0, 0
    for seed in range(20):
        frame = frame_of(ramps, [], seed=seed)
        beams = steering(
            frame.array,
            frequency=float(np.mean(ramps.centre_frequency)),
            sine=orthogonal_sines(4),
        )
        logs = log_spectra(
            beamform(frame.samples, beams), hann_weights(times.is_sample), spectrum_size(times)
        )
        grid = search_grid(receiver, frame, 0.0)
        statistic = log_range_rate_map(logs, ramps, times, grid)
        excess = statistic - floor_over_range(statistic, round(6.0 / grid.range_step))
        per_beam = 1.0 - (1.0 - probability) ** 0.25
        level = log_mean_threshold(num_ramps=32, false_alarm_probability=per_beam)
        crossings += np.sum(excess.max(axis=0) > level - log_median_of_noise(32))
        cells += excess[0].size
    sigma = math.sqrt(probability / (0.1 * cells))
    assert 0.75 * probability - 4 * sigma < crossings / cells < probability + 4 * sigma


@pytest.mark.slow
def test_the_receiver_detects_a_point_and_next_to_nothing_in_the_noise_around_it():
    """40 frames of noise at 1e-4 per cell of the map, with and without a point.

    The stated probability is one of map crossings, which the test below measures on both sides. A
    crossing must besides cohere over the frame and survive its own fit, so that false detections
    are rarer: fewer than cells × probability, at 99.9 % by Poisson's law. A receiver that detects
    nothing would pass that; the same noise must not hide a point of 18 dB per ramp.
    """
    probability = 1e-4
    receiver = Receiver(false_alarm_probability=probability)
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    false, found, frames = 0, 0, 40
    point = HandPoint(range=14.0, range_rate=-6.0, power=0.025)
    for seed in range(1000, 1000 + frames):
        frame = frame_of(ramps, [], seed=seed)
        false += receiver.detect(frame).num_detections
        detections = receiver.detect(frame_of(ramps, [point], seed=seed))
        found += bool(np.any(np.abs(detections.range - point.range) < 0.1))
    grid = search_grid(receiver, frame, 0.0)
    stated = probability * frames * grid.range.size * grid.range_rate.size
    assert false <= poisson.ppf(0.999, stated)
    assert found == frames


@pytest.mark.slow
@pytest.mark.parametrize(
    "family", [Triangular(bandwidth=1e9, ramp_duration=1e-3), DiverseTriangular()]
)
@pytest.mark.parametrize(("probability", "frames"), [(1e-2, 100), (1e-3, 300)])
def test_the_drawn_map_crosses_its_threshold_as_often_as_stated(family, probability, frames):
    """The map that the receiver looks at, its floor and threshold, per cell: within 10 %.

    Cells share bins, so that the spread is taken from frame to frame: 3 standard errors of the
    mean must fit in those 10 %.
    """
    receiver = Receiver(false_alarm_probability=probability)
    ramps = family.schedule(num_sweeps=16, streams=Streams(2))
    rate = np.zeros(frames)
    for seed in range(frames):
        search = _Search(receiver, frame_of(ramps, [], seed=seed))
        search.map.update(search.spectra, np.zeros((0, ramps.num_ramps)))
        excess, _ = search.map.excess(search.map.floor(), -np.inf)
        rate[seed] = np.mean(excess > search.threshold)
    error = 3.0 * np.std(rate) / math.sqrt(frames)
    assert error < 0.1 * probability
    assert np.mean(rate) == pytest.approx(probability, abs=0.1 * probability)


@pytest.mark.slow
@pytest.mark.parametrize(
    "family", [Triangular(bandwidth=1e9, ramp_duration=1e-3), DiverseTriangular()]
)
def test_an_isolated_point_is_measured_at_the_bound(family):
    """Range, rate and azimuth within 10 % of Cramér and Rao's, from −10 to 60 dB per sample.

    80 points at each of three levels: the rms of all 240 has a spread of 4.6 %; 3 sigma of that.
    """
    ramps = family.schedule(num_sweeps=16, streams=Streams(2))
    runs = [
        estimate_points(Receiver(), ramps, snr=snr, trials=80, seed=seed)
        for seed, snr in enumerate((0.1, 10.0, 1e6))
    ]
    assert all(len(run.ratio) == run.trials for run in runs)
    ratio = np.concatenate([run.ratio for run in runs])
    efficiency = np.sqrt(np.mean(ratio**2, axis=0))
    assert np.all(efficiency < 1.10 + 3.0 / math.sqrt(2 * len(ratio)))
    assert np.all(efficiency > 1.0 - 3.0 / math.sqrt(2 * len(ratio)))
