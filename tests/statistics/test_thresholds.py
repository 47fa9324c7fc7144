"""Stated false-alarm probabilities, and errors at the bound, against what many draws give."""

import math

import numpy as np
import pytest
from scipy.stats import poisson

from polychirp.receiver.alternatives.paper_receiver import mean_threshold
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.estimation import estimate_points
from tests.support.points import HandPoint, frame_of, true_motions


def test_almost_half_of_the_noise_is_above_the_papers_threshold():
    """Rayleigh: P(a > mean a) = exp(−π/4); exponential: 1/e. 2e5 cells: ±0.35 % at 3 sigma."""
    noise = np.random.default_rng(1).normal(size=(2, 200_000))
    amplitude = np.hypot(*noise)
    assert np.mean(amplitude > mean_threshold(amplitude)) == pytest.approx(
        math.exp(-math.pi / 4), abs=0.0035
    )
    power = amplitude**2
    assert np.mean(power > mean_threshold(power)) == pytest.approx(math.exp(-1), abs=0.0035)


@pytest.mark.slow
def test_the_receiver_detects_a_point_and_no_more_of_the_noise_than_stated():
    """40 frames of noise at 1e-5 per resolution cell, with and without a point.

    The stated probability is one of peaks of the map. All ramps must besides agree on a peak, and
    it must survive its own fit, so that false detections are rarer: fewer than stated, at 99.9 % by
    Poisson's law. A receiver that detects nothing would pass that; the same noise must not hide a
    point of 20 dB.
    """
    receiver = CoherentReceiver(false_alarm_probability=1e-5)
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    false, found, stated, frames = 0, 0, 0.0, 40
    samples = 4 * np.count_nonzero(frame_of(ramps, []).times.is_sample)
    point = HandPoint(range=14.0, range_rate=-6.0, power=100.0 / samples)
    true = true_motions(ramps, [point])[0, 0]
    for seed in range(1000, 1000 + frames):
        frame = frame_of(ramps, [], seed=seed)
        false += receiver.detect(frame).num_detections
        stated += receiver.expected_false_detections(frame)
        detections = receiver.detect(frame_of(ramps, [point], seed=seed))
        found += bool(np.any(np.abs(detections.range - true) < 0.1))
    assert false <= poisson.ppf(0.999, stated)
    assert found == frames


@pytest.mark.slow
@pytest.mark.parametrize(
    "family", [Triangular(bandwidth=1e9, ramp_duration=1e-3), DiverseTriangular()]
)
def test_an_isolated_point_is_measured_at_the_bound(family):
    """Range, rate and azimuth within 10 % of Cramér and Rao's, from −28 to 30 dB per sample.

    60 points at each of four levels: the rms of all 240 has a spread of 4.6 %; 3 sigma of that. At
    40 dB and more, the bound of the range is below 2 µm, the error of the signal's model.
    """
    ramps = family.schedule(num_sweeps=16, streams=Streams(2))
    runs = [
        estimate_points(CoherentReceiver(), ramps, snr=snr, trials=60, seed=seed)
        for seed, snr in enumerate((10.0**-2.8, 0.1, 10.0, 1e3))
    ]
    assert all(len(run.ratio) == run.trials for run in runs)
    ratio = np.concatenate([run.ratio for run in runs])
    efficiency = np.sqrt(np.mean(ratio**2, axis=0))
    assert np.all(efficiency < 1.10 + 3.0 / math.sqrt(2 * len(ratio)))
    assert np.all(efficiency > 1.0 - 3.0 / math.sqrt(2 * len(ratio)))
