"""A chirp is what equations (5) and (6) say, and fills its band."""

import numpy as np
import pytest

from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.waveform import Triangular


def baseband(ramps: RampSchedule, time: np.ndarray, centre: float) -> np.ndarray:
    """Complex envelope about ``centre``, Hz, at ``time``, s."""
    ramp = np.searchsorted(ramps.start_time, time, side="right") - 1
    within = time - ramps.start_time[ramp]
    cycles = (
        ramps.start_phase[ramp]
        + ramps.start_frequency[ramp] * within
        + 0.5 * ramps.slope[ramp] * within**2
        - centre * time
    )
    return np.exp(2j * np.pi * cycles)


@pytest.fixture
def triangle() -> RampSchedule:
    """One triangle of 10 MHz in 2 · 0.1 ms at a low carrier, so that phases are exact."""
    plan = Triangular(start_frequency=100e6, bandwidth=10e6, ramp_duration=1e-4)
    return plan.schedule(num_sweeps=1, streams=Streams(1))


def test_the_instantaneous_frequency_is_the_derivative_of_equation_5(triangle):
    """d/dt [f0 t + β t²/2] = f0 + βt with β = B/T of equation (6), then back down."""
    rate = 400e6
    time = (np.arange(int(2e-4 * rate)) + 0.25) / rate
    phase = np.unwrap(np.angle(baseband(triangle, time, 105e6)))
    frequency = 105e6 + np.diff(phase) * rate / (2 * np.pi)
    middle = 0.5 * (time[1:] + time[:-1])
    expected = 110e6 - 1e11 * np.abs(middle - 1e-4)
    # the step across the apex is averaged over one sample: 1e11 Hz/s · 2.5 ns
    np.testing.assert_allclose(frequency, expected, atol=300)


def test_the_phase_is_continuous_at_the_apex(triangle):
    before, after = baseband(triangle, np.array([1e-4 - 1e-13, 1e-4 + 1e-13]), 0.0)
    assert abs(after - before) < 2 * np.pi * 110e6 * 2e-13 * 1.01


def test_the_spectrum_fills_the_band_and_little_else(triangle):
    """A chirp with BT = 1000 keeps all but about 1/√(BT) of its energy within its band."""
    rate = 40e6
    time = np.arange(int(2e-4 * rate)) / rate
    density = np.abs(np.fft.fft(baseband(triangle, time, 105e6))) ** 2
    frequency = np.fft.fftfreq(time.size, 1 / rate)
    inside = np.abs(frequency) <= 5e6
    assert density[inside].sum() / density.sum() > 1 - 1 / np.sqrt(1000)
    quarters = [
        density[(frequency >= a) & (frequency < a + 2.5e6)].sum()
        for a in np.arange(-5e6, 5e6, 2.5e6)
    ]
    np.testing.assert_allclose(quarters, np.mean(quarters), rtol=0.1)


def test_dechirped_with_itself_a_delayed_chirp_beats_at_slope_times_delay(triangle):
    """φ(t) − φ(t−τ) rises at βτ on the way up and falls at βτ on the way down."""
    delay, rate = 1e-6, 40e6
    for first, sign in ((1e-5, 1), (1.1e-4, -1)):
        time = first + np.arange(2000) / rate
        mixed = baseband(triangle, time, 0.0) * np.conj(baseband(triangle, time - delay, 0.0))
        beat = np.angle(np.mean(mixed[1:] * np.conj(mixed[:-1]))) * rate / (2 * np.pi)
        assert beat == pytest.approx(sign * 1e11 * delay, rel=1e-9)
