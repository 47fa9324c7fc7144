"""Rules that every detector of bursts obeys."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.mitigation import Blanking
from polychirp.receiver.mitigation.burst_detectors import AmplitudeSteps, MedianThreshold, StftCfar
from polychirp.rng import Streams
from polychirp.scoring.burst_detection import burst_counts
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=3, streams=Streams(2))
POINTS = [HandPoint(range=9.0, range_rate=-5.0, power=1e4), HandPoint(range=17.0, power=1e3)]
DETECTORS = {
    "median threshold": MedianThreshold(),
    "amplitude steps": AmplitudeSteps(),
    "STFT CFAR": StftCfar(),
}


@pytest.fixture(params=DETECTORS.values(), ids=DETECTORS)
def detector(request):
    return request.param


def chirped(frame, *, level=300.0, length=24):
    """The frame with a chirp of ``length`` samples in every ramp, and the mask of these samples."""
    samples, hit = frame.samples.copy(), np.zeros(frame.times.is_sample.shape, dtype=bool)
    draw, n = np.random.default_rng(1), np.arange(length) - 0.5 * length
    for k, size in enumerate(frame.times.num_samples):
        start = draw.integers(100, size - 100)
        samples[:, k, start : start + length] += level * np.exp(1j * np.pi * n**2 / length)
        hit[k, start : start + length] = True
    return frame.with_samples(samples), hit


def test_all_of_a_strong_burst_is_found_and_little_else(detector):
    """Recall 1; of what is found beside the burst, all lies within the guard and half a window."""
    frame, hit = chirped(frame_of(RAMPS, POINTS))
    counts = burst_counts(detector.hit(frame), hit, frame.times.is_sample)
    assert counts.recall == 1.0
    assert counts.precision > 24 / (24 + 2 * 8 + 36)


def test_a_clean_frame_has_no_bursts(detector):
    frame = frame_of(RAMPS, POINTS)
    assert np.mean(detector.hit(frame)[frame.times.is_sample]) < 1e-3


def test_nothing_is_found_in_the_padding(detector):
    frame, _ = chirped(frame_of(RAMPS, POINTS), level=1e5)
    assert not detector.hit(frame)[~frame.times.is_sample].any()


def test_a_weaker_receiver_finds_the_same(detector):
    """Thresholds come from the ramp: a gain of the front end changes nothing."""
    frame, _ = chirped(frame_of(RAMPS, POINTS))
    weaker = frame.with_samples(1e-6 * frame.samples)
    assert np.array_equal(detector.hit(frame), detector.hit(weaker))


def test_a_repair_uses_the_detector_that_it_is_given(detector):
    frame, _ = chirped(frame_of(RAMPS, POINTS))
    blanked = Blanking(detector=detector).mitigate(frame)
    assert np.array_equal(blanked.weight == 0.0, detector.hit(frame) | ~frame.times.is_sample)


def test_the_default_detector_is_the_median_threshold():
    frame, _ = chirped(frame_of(RAMPS, POINTS))
    own = Blanking(factor=4.0, guard=3e-6, whitening=4)
    same = MedianThreshold(factor=4.0, guard=3e-6, whitening=4)
    assert np.array_equal(own.hit(frame), same.hit(frame))


def test_hysteresis_follows_a_burst_to_its_weak_end():
    """A burst fades from 15 to 4 times the noise: it begins above 8 and ends with its last sample.

    Without hysteresis it ends where it falls below 8, in the middle.
    """
    frame = frame_of(RAMPS, [])
    samples = frame.samples.copy()
    samples[:, 0, 200:230] += np.linspace(15.0, 4.0, 30) * np.exp(0.3j * np.arange(30))
    frame = frame.with_samples(samples)
    assert AmplitudeSteps(factor=8.0, guard=0.0).hit(frame)[0, 200:230].all()
    assert not AmplitudeSteps(factor=8.0, release=8.0, guard=0.0).hit(frame)[0, 220:].any()


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: AmplitudeSteps(factor=1.0), "factor"),
        (lambda: AmplitudeSteps(release=9.0), "release"),
        (lambda: AmplitudeSteps(guard=-1.0), "guard"),
        (lambda: StftCfar(least_rows=0), "rows"),
        (lambda: StftCfar(window=30), "window"),
        (lambda: MedianThreshold(factor=0.5), "factor"),
        (lambda: Blanking(factor=4.0, detector=AmplitudeSteps()), "table 'detector'"),
    ],
)
def test_settings_that_cannot_be_are_refused(make, word):
    with pytest.raises(InputError, match=word):
        make()
