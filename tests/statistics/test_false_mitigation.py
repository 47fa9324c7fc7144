"""Share of noise alone that the default detector of bursts takes for interference."""

import numpy as np
import pytest

from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.receiver.mitigation import Blanking
from polychirp.receiver.mitigation.burst_detectors import MedianThreshold
from polychirp.receiver.mitigation.burst_detectors.median_threshold import median_factor
from polychirp.rng import Streams
from polychirp.waveform import Sawtooth

RATE = 10e6


def noise(*, channels, is_real, ramps=500, fast=512, seed=0):
    """A frame of white noise alone; real samples are stored without imaginary parts."""
    draw = np.random.default_rng(seed)
    shape = (channels, ramps, fast)
    samples = draw.normal(size=shape) + (0j if is_real else 1j * draw.normal(size=shape))
    schedule = Sawtooth(start_frequency=77e9, bandwidth=1e8, ramp_duration=fast / RATE).schedule(
        num_sweeps=ramps, streams=Streams(1)
    )
    return IfFrame(
        samples=samples,
        schedule=schedule,
        times=SampleTimes(first=schedule.start_time, num_samples=np.full(ramps, fast), rate=RATE),
        array=AntennaArray(num_channels=channels),
    )


@pytest.mark.parametrize("is_real", [False, True], ids=["complex", "real"])
@pytest.mark.parametrize("channels", [1, 2, 4, 12])
def test_the_default_detector_keeps_the_stated_false_mitigation(channels, is_real):
    """Both tests have the same share, and the amplitude's is smaller with several channels.

    So one half to all of the stated share is hit: 256 000 samples with guards of 17 hit together
    have some 60 hits of 4 per thousand, a deviation of 15 % with the doubt in the ramps' medians.
    """
    stated = 4e-3
    frame = noise(channels=channels, is_real=is_real, ramps=500 if channels < 12 else 200)
    found = np.mean(MedianThreshold(false_mitigation=stated).hit(frame))
    assert 0.3 * stated < found < 1.3 * stated


@pytest.mark.parametrize("is_real", [False, True], ids=["complex", "real"])
@pytest.mark.parametrize("whitening", [0, 8])
@pytest.mark.parametrize("fast", [32, 64])
def test_short_ramps_keep_the_stated_false_mitigation(fast, whitening, is_real):
    """The median of 32 samples is uncertain; a multiple of the known median is exceeded too often.

    Of 400 000 samples, runs of 17 to 34 hit samples are some 60; 3 standard deviations are 40 %.
    """
    stated = 4e-3
    frame = noise(channels=1, is_real=is_real, ramps=400_000 // fast, fast=fast)
    found = np.mean(MedianThreshold(false_mitigation=stated, whitening=whitening).hit(frame))
    assert 0.1 * stated < found < 1.4 * stated


@pytest.mark.parametrize("is_real", [False, True], ids=["complex", "real"])
def test_amplitudes_alone_keep_all_of_the_stated_share_on_one_channel(is_real):
    stated = 4e-3
    frame = noise(channels=1, is_real=is_real)
    found = np.mean(MedianThreshold(false_mitigation=stated, whitening=0).hit(frame))
    assert found == pytest.approx(stated, rel=0.3)


@pytest.mark.parametrize("channels", [1, 2, 4, 12])
def test_the_factor_is_that_of_drawn_powers(channels):
    """One in a thousand of a million means over channels lies above it, to 10 %."""
    draw = np.random.default_rng(channels)
    power = draw.chisquare(2 * channels, 1_000_000)
    factor = median_factor(float(channels), 1e-3, num_samples=10**6)
    assert np.mean(np.sqrt(power / np.median(power)) > factor) == pytest.approx(1e-3, rel=0.1)


def test_three_times_the_median_is_too_low_for_one_channel():
    """One in 2⁹ complex samples exceeds it by either test, and 17 samples are hit around each."""
    frame = noise(channels=1, is_real=False, ramps=100)
    assert 17 / 512 < np.mean(Blanking(factor=3.0).hit(frame)) < 34 / 512
    assert np.mean(Blanking().hit(frame)) < 2e-3
