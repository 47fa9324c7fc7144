"""Measures of mitigation."""

import numpy as np
import pytest

from polychirp.scoring.mitigation import (
    error_vector_magnitude,
    share_touched,
    signal_to_disturbance,
)


def test_sinr_counts_the_power_of_all_ramps():
    """One ramp in ten hit with 100 times the power of the noise: 10.9 times the noise of all."""
    own = np.full((1, 10), 10.0 + 0.0j)
    rest = np.full((1, 10), 1.0j)
    rest[0, 3] = 10.0
    assert signal_to_disturbance(own, rest) == pytest.approx(100.0 / 10.9)


def test_a_phase_error_is_an_error_vector_though_the_power_is_right():
    clean = np.ones((2, 4), dtype=complex)
    found = clean * np.exp(1j * np.array([[0.0], [0.1]]))
    assert error_vector_magnitude(found, clean) == pytest.approx([0.0, 2 * np.sin(0.05)])


def test_a_sample_is_touched_if_it_changed_or_counts_less_and_padding_is_none():
    before = np.ones((2, 1, 5), dtype=complex)
    after = before.copy()
    after[1, 0, 0] += 1e-3  # in one channel
    after[0, 0, 1] += 1e-12  # rounding
    after[0, 0, 4] += 1.0  # in the padding
    weight = np.array([[1.0, 1.0, 0.3, 1.0, 0.0]])
    is_sample = np.array([[True, True, True, True, False]])
    assert share_touched(before, after, weight, is_sample) == pytest.approx(2 / 4)
