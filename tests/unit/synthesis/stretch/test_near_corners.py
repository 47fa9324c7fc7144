"""The impulse response in Legendre's polynomials, as moments of samples near corners need it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polychirp.model.if_filter import IfFilter
from polychirp.synthesis.stretch.near_corners import window_series
from polychirp.units import from_db


@settings(max_examples=25)
@given(
    passband=st.floats(0.1, 0.6),
    transition=st.floats(0.05, 1.0),
    level=st.floats(21.0, 100.0),
)
def test_legendre_s_series_over_a_window_is_the_impulse_response(passband, transition, level):
    """Band edges in units of the sample rate; the series holds at any place of any interval."""
    step = 1e-6
    if_filter = IfFilter(
        passband=passband / step,
        stopband=(passband + transition) / step,
        attenuation=from_db(level),
    )
    series = window_series(if_filter, step)
    assert series.num_steps + series.share == pytest.approx(if_filter.support / step)
    place = np.linspace(0.0, 1.0, 7)
    of_series = np.polynomial.legendre.legval(2.0 * place - 1.0, series.gain[:-1, :-1].T)
    time = 0.5 * if_filter.support - step * (np.arange(series.num_steps)[:, None] + place)
    expected = if_filter.impulse_response(time)
    assert np.abs(of_series - expected).max() < 1e-8 * np.abs(expected).max()
