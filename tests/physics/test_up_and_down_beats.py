r"""Range and rate from an up- and a down-beat: the paper's eqs 9 and 10, corrected.

The beats come from the exact phase f(t) τ(t) − b τ²/2, averaged over each whole ramp: phase at
its end minus phase at its start, over its length. Nothing of the formulas under test is used.
"""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT as C
from polychirp.receiver.alternatives.triangular_pairing import range_and_rate


def mean_beat(distance, rate, *, start, duration, frequency, slope):
    """Magnitude of the mean beat on one ramp; the target is at ``distance`` at time 0."""

    def cycles(t):
        delay = 2.0 * (distance + rate * t) / (C + rate)
        return (frequency + slope * (t - start)) * delay - 0.5 * slope * delay**2

    return abs(cycles(start + duration) - cycles(start)) / duration


@pytest.mark.parametrize("rate", [-30.0, -10.0, 0.0, 10.0])
@pytest.mark.parametrize("up_first", [True, False])
def test_a_triangle_gives_range_at_its_apex_and_rate_without_bias(rate, up_first):
    """λ belongs to the frequency at the outer ends of the triangle."""
    duration, bandwidth, low = 1.5e-3, 0.9e9, 79e9
    slope = bandwidth / duration
    first, second = (low, low + bandwidth) if up_first else (low + bandwidth, low)
    sign = 1.0 if up_first else -1.0
    beats = [
        mean_beat(10.0, rate, start=t, duration=duration, frequency=f, slope=s)
        for t, f, s in ((-duration, first, sign * slope), (0.0, second, -sign * slope))
    ]
    up, down = beats if up_first else beats[::-1]
    found = range_and_rate(up_beat=up, down_beat=down, slope=slope, turning_frequency=first)
    assert found[0] == pytest.approx(10.0, abs=2e-5)  # R refers to the apex, time 0
    assert found[1] == pytest.approx(rate, abs=2e-5)


def test_the_nominal_wavelength_biases_the_rate_by_half_the_bandwidth_over_the_carrier():
    """Eq. 10 with the mid-sweep wavelength: B/2f = 0.57 %."""
    duration, bandwidth, low = 1.5e-3, 0.9e9, 79e9
    slope = bandwidth / duration
    up = mean_beat(10.0, 10.0, start=-duration, duration=duration, frequency=low, slope=slope)
    down = mean_beat(
        10.0, 10.0, start=0.0, duration=duration, frequency=low + bandwidth, slope=-slope
    )
    _, biased = range_and_rate(
        up_beat=up, down_beat=down, slope=slope, turning_frequency=low + 0.5 * bandwidth
    )
    assert 1.0 - biased / 10.0 == pytest.approx(bandwidth / (2 * low), rel=0.01)


def test_the_papers_range_formula_is_short_by_half():
    """Eq. 9 with eq. 6's slope: cT/4B instead of cT/2B."""
    duration, bandwidth = 1.5e-3, 0.9e9
    beat = 2.0 * 10.0 * bandwidth / duration / C
    assert C * duration / (4.0 * bandwidth) * beat == pytest.approx(5.0)
    right, _ = range_and_rate(
        up_beat=beat, down_beat=beat, slope=bandwidth / duration, turning_frequency=79e9
    )
    assert right == pytest.approx(10.0)
    assert np.isfinite(right)
