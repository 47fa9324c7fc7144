"""The Cramér–Rao bound of a point."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.estimation.cramer_rao import cramer_rao_bound
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.references.receiver import cramer_rao_bound_twin

RAMPS = DiverseTriangular().schedule(num_sweeps=4, streams=Streams(3))
TIMES = sample_times(RAMPS, Converter())
ARRAY = AntennaArray()
POINT = {"motion": np.array([9.0, -17.0, 2.0]), "azimuth": 0.4, "snr": 2.0, "time": 0.0}


@pytest.mark.parametrize(
    ("is_acceleration_known", "sine_rate_deviation"),
    [(True, 0.0), (False, 0.0), (True, 0.5), (False, np.inf)],
)
def test_fishers_information_is_that_of_differences_over_all_samples(
    is_acceleration_known, sine_rate_deviation
):
    """Central differences of a phase of 5e6 turns: to 1e-4."""
    options = {
        **POINT,
        "is_acceleration_known": is_acceleration_known,
        "sine_rate_deviation": sine_rate_deviation,
    }
    fast = cramer_rao_bound(RAMPS, TIMES, ARRAY, **options)
    slow = cramer_rao_bound_twin(RAMPS, TIMES, ARRAY, **options)
    for name in ("range", "range_rate", "azimuth"):
        assert getattr(fast, name) == pytest.approx(getattr(slow, name), rel=1e-4)


def test_the_azimuth_of_what_does_not_turn_has_the_bound_of_an_array():
    """var θ = 1/(2 SNR N (2π cos θ/λ)² Σ(y − ȳ)²), N samples of the frame."""
    count = int(TIMES.num_samples.sum())
    along = ARRAY.position[:, 1]
    wavelength = SPEED_OF_LIGHT / float(np.mean(RAMPS.centre_frequency))
    aperture = np.sum((along - along.mean()) ** 2)
    expected = 1.0 / np.sqrt(2 * 2.0 * count * aperture) * wavelength / (2 * np.pi * np.cos(0.4))
    steady = {**POINT, "motion": np.array([9.0, -17.0, 0.0])}
    bound = cramer_rao_bound(RAMPS, TIMES, ARRAY, **steady, sine_rate_deviation=0.0)
    assert bound.azimuth == pytest.approx(expected, rel=1e-6)


def test_the_azimuth_at_the_start_of_what_turns_has_twice_the_bound():
    """A line's end has twice the deviation of its mean; what is known of its slope lies between.

    Of standing points, on the frame's samples evenly: deviation σ of a mean, √12 σ/T of a slope,
    which knowledge d combines with: σ √(1 + 3 d²/(d² + 12 σ²/T²)).
    """
    ramps = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(
        num_sweeps=64, streams=Streams(1)
    )
    times = sample_times(ramps, Converter())
    still = {**POINT, "motion": np.array([9.0, 0.0, 0.0]), "azimuth": 0.0}
    mean = cramer_rao_bound(ramps, times, ARRAY, **still, sine_rate_deviation=0.0).azimuth
    span = float(ramps.end_time[-1] - ramps.start_time[0])
    for sine_rate_deviation in (2.0 * mean / span, 5.0 * mean / span, np.inf):
        found = cramer_rao_bound(
            ramps, times, ARRAY, **still, sine_rate_deviation=sine_rate_deviation
        ).azimuth
        known = (
            1.0
            if np.isinf(sine_rate_deviation)
            else sine_rate_deviation**2 / (sine_rate_deviation**2 + 12.0 * (mean / span) ** 2)
        )
        assert found == pytest.approx(mean * np.sqrt(1.0 + 3.0 * known), rel=0.02)


def test_range_and_rate_have_the_bound_of_a_sweep_and_of_a_frame():
    """Triangles: up- and down-ramps separate range from rate.

    The beats of K ramps of N samples give the range, var f = 6 f_s²/(SNR M (2π)² N³ K); the
    phases over the frame give the rate, as of a tone of KN samples over the frame's length.
    """
    ramps = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(
        num_sweeps=64, streams=Streams(1)
    )
    times = sample_times(ramps, Converter())
    middle = 0.5 * (times.first[0] + times.first[-1] + times.num_samples[0] / times.rate)
    still = {**POINT, "motion": np.array([9.0, 0.0, 0.0]), "snr": 1.0, "time": float(middle)}
    bound = cramer_rao_bound(ramps, times, ARRAY, is_acceleration_known=True, **still)
    count = float(times.num_samples[0])
    beat = times.rate * np.sqrt(6.0 / (4 * 128 * count**3)) / (2.0 * np.pi)
    assert bound.range == pytest.approx(
        beat * SPEED_OF_LIGHT / (2.0 * abs(ramps.slope[0])), rel=0.01
    )
    span = np.concatenate([t[s] for t, s in zip(times.time, times.is_sample, strict=True)])
    turns = 4.0 * np.pi * float(np.mean(ramps.centre_frequency)) / SPEED_OF_LIGHT
    expected = 1.0 / (turns * np.sqrt(2.0 * 4 * np.sum((span - span.mean()) ** 2)))
    assert bound.range_rate == pytest.approx(expected, rel=0.02)


def test_bounds_fall_with_the_root_of_the_power():
    one = cramer_rao_bound(RAMPS, TIMES, ARRAY, **POINT)
    four = cramer_rao_bound(RAMPS, TIMES, ARRAY, **{**POINT, "snr": 8.0})
    assert four.range == pytest.approx(0.5 * one.range)
    assert four.range_rate == pytest.approx(0.5 * one.range_rate)


@pytest.mark.parametrize("sine_rate_deviation", [0.0, 0.5, np.inf])
def test_one_channel_measures_range_and_range_rate_without_an_azimuth(sine_rate_deviation):
    """Two channels whose azimuth is known share the information equally."""
    bound = cramer_rao_bound(
        RAMPS,
        TIMES,
        AntennaArray(num_channels=1),
        **POINT,
        sine_rate_deviation=sine_rate_deviation,
    )
    still = cramer_rao_bound(
        RAMPS, TIMES, AntennaArray(num_channels=2), **POINT, sine_rate_deviation=0.0
    )
    assert bound.azimuth == np.inf
    assert bound.range == pytest.approx(np.sqrt(2.0) * still.range, rel=1e-6)
    assert bound.range_rate == pytest.approx(np.sqrt(2.0) * still.range_rate, rel=1e-6)
