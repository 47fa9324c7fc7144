"""The filter's response to a chirp, against direct integration."""

import numpy as np
import pytest

from polychirp.model.if_filter import IfFilter, gauss_panels
from polychirp.synthesis.stretch import chirp_kernels, filter_kernels
from polychirp.synthesis.stretch.chirp_response import (
    bessel_coefficients,
    far_beat,
    num_orders,
    response_table,
    step_of,
)
from polychirp.synthesis.stretch.kernel_records import Response
from polychirp.synthesis.stretch.kernel_tables import taps_of
from polychirp.units import from_db
from tests.support.kernels import callable_from_python

tabulated_gain = callable_from_python(filter_kernels.tabulated_gain)
end_series = callable_from_python(filter_kernels.end_series)
tap = callable_from_python(filter_kernels.tap)
derivative = callable_from_python(filter_kernels.derivative)
quadrature = callable_from_python(chirp_kernels.quadrature)

FILTERS = [IfFilter(), IfFilter(passband=3e6, stopband=4.5e6, attenuation=from_db(55.0))]


def integral(if_filter, beat, rate, low=-1.0, high=1.0):
    """∫h(s) exp(j2π(−f s + ½ μ s²)) ds over a part of the support, in units of its half."""
    node, weight = gauss_panels(2000)
    half = 0.5 * if_filter.support
    s = half * (0.5 * (low + high) + 0.5 * (high - low) * node)
    wave = np.exp(2j * np.pi * s * (0.5 * rate * s - beat))
    return 0.5 * half * (high - low) * np.sum(weight * if_filter.impulse_response(s) * wave)


@pytest.mark.parametrize("if_filter", FILTERS)
@pytest.mark.parametrize("rate", [0.0, 1e5, 1e11, -2e12])
def test_the_table_holds_the_integral_at_any_beat_and_nearby_rate(if_filter, rate):
    detuned = rate + 0.01 / if_filter.support**2
    highest = far_beat(if_filter, rate)
    orders = num_orders(if_filter, detuned - rate)
    table = response_table(if_filter, rate=rate, highest=highest, num_orders=orders)
    response = Response(
        rate=rate,
        spread=0.0,
        far=highest,
        step=step_of(if_filter),
        moment=table.moment,
        envelope=table.envelope,
    )
    detune = 1j * np.pi * (detuned - rate) * (0.5 * if_filter.support) ** 2
    for beat in np.linspace(-1.0, 1.0, 23) * highest:
        gain = tabulated_gain(response, beat, detune)
        assert gain == pytest.approx(integral(if_filter, beat, detuned), abs=1e-9)


@pytest.mark.parametrize("if_filter", FILTERS)
def test_the_response_to_a_steady_beat_is_the_frequency_response(if_filter):
    table = response_table(if_filter, rate=0.0, highest=if_filter.stopband, num_orders=1)
    beat = step_of(if_filter) * (np.arange(table.envelope.size) - 4)
    assert table.moment[:, 0] == pytest.approx(if_filter.response(beat), abs=2e-11)


@pytest.mark.parametrize("if_filter", FILTERS)
@pytest.mark.parametrize("rate", [0.0, 2e12])
@pytest.mark.parametrize("end", [1.0, 0.6, 0.0])
def test_a_cut_window_far_out_of_band_is_the_sum_of_its_ends(if_filter, rate, end):
    taps = taps_of(if_filter)
    upper = end * taps.half
    at_end = far_beat(if_filter, rate)
    beat = at_end + rate * upper

    def series(s):
        weight = np.empty(taps.bessel.shape[0], dtype=np.complex128)
        count = end_series(taps, beat - rate * s, rate, weight)
        value = weight[0] * tap(taps, s)
        value += sum(weight[j] * derivative(taps, s, j) for j in range(1, count))
        return value * np.exp(2j * np.pi * s * (0.5 * rate * s - beat))

    expected = integral(if_filter, beat, rate, high=end)
    assert series(upper) - series(-taps.half) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("if_filter", FILTERS)
def test_derivatives_continue_the_impulse_response(if_filter):
    """Taylor's series over a fiftieth of the filter's fastest period, from every place."""
    time = np.linspace(-0.49, 0.49, 197) * if_filter.support
    step = min(0.02 / if_filter.stopband, 0.01 * if_filter.support)
    orders = np.arange(14)
    factor = np.cumprod([1.0, *(step / orders[1:])])
    series = factor @ if_filter.derivatives(time, 13)
    tolerance = 1e-10 * float(if_filter.impulse_response(np.zeros(1))[0])
    assert series == pytest.approx(if_filter.impulse_response(time + step), abs=tolerance)


def test_bessel_coefficients_follow_from_repeated_partial_integration():
    """D_(j+1) = q D_j' with q' = μq²: B_(j+1,i) = B_(j,i) + (j+i) B_(j,i−1)."""
    found = bessel_coefficients(7)
    for j in range(6):
        for i in range(1, j + 2):
            assert found[j + 1, i] == found[j, i] + (j + i) * found[j, i - 1]


@pytest.mark.parametrize("if_filter", FILTERS)
@pytest.mark.parametrize("rate", [0.0, 2e12])
@pytest.mark.parametrize("part", [(-1.0, 1.0), (-1.0, -0.99), (0.3, 0.4)])
def test_panels_of_a_cut_window_integrate_beats_up_to_the_far_ones(if_filter, rate, part):
    taps = taps_of(if_filter)
    low, high = (end * taps.half for end in part)
    for beat in np.linspace(-1.0, 1.0, 9) * far_beat(if_filter, rate):
        found = quadrature(taps, low, high, beat, rate)
        assert found == pytest.approx(integral(if_filter, beat, rate, *part), abs=1e-11)
