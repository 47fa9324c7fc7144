"""Codes of transmitting elements: rules that hold for every code, and the weights of each."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.waveform import (
    Coding,
    DopplerDivision,
    PhaseCoded,
    Sawtooth,
    TimeDivision,
    Triangular,
    coded,
)

CODINGS = [TimeDivision(), DopplerDivision(), DopplerDivision(num_bands=6), PhaseCoded()]
SWEEPS = np.arange(24)


@pytest.fixture(params=CODINGS, ids=repr)
def coding(request):
    return request.param


def test_a_code_is_a_coding(coding):
    assert isinstance(coding, Coding)


@pytest.mark.parametrize("num_elements", [1, 2, 3, 4])
def test_elements_are_orthogonal_and_their_weights_are_zero_or_full(coding, num_elements):
    """24 sweeps are whole blocks of every code here."""
    weight = coding.weights(SWEEPS, num_elements=num_elements)
    products = weight.conj().T @ weight
    assert np.abs(products - np.diag(np.diag(products))).max() < 1e-12
    assert np.all((weight == 0) | np.isclose(np.abs(weight), 1.0, rtol=1e-15))


def test_one_element_sends_as_it_does_without_a_code(coding):
    np.testing.assert_array_equal(coding.weights(SWEEPS, num_elements=1), np.ones((24, 1)))


def test_both_ramps_of_a_triangle_have_the_same_weights(coding):
    ramps = Triangular().schedule(num_sweeps=12, streams=Streams(seed=1))
    weight = coded(ramps, coding, num_elements=3).transmit_weight
    np.testing.assert_array_equal(weight[::2], weight[1::2])


def test_one_element_at_a_time_sends_in_time_division():
    weight = TimeDivision().weights(SWEEPS, num_elements=3)
    np.testing.assert_array_equal(weight.sum(axis=1), np.ones(24))
    np.testing.assert_array_equal(np.argmax(weight, axis=1), SWEEPS % 3)


def test_signs_are_those_of_a_hadamard_matrix():
    from scipy.linalg import hadamard

    weight = PhaseCoded().weights(np.arange(8), num_elements=8)
    np.testing.assert_array_equal(weight, hadamard(8))


def test_a_phase_turns_by_an_equal_step_from_sweep_to_sweep():
    weight = DopplerDivision(num_bands=5).weights(SWEEPS, num_elements=3)
    step = np.angle(weight[1:] / weight[:-1]) / (2 * np.pi)
    np.testing.assert_allclose(step, np.tile([0.0, 0.2, 0.4], (23, 1)), atol=1e-12)


def test_fewer_bands_than_elements_are_refused():
    ramps = Sawtooth().schedule(num_sweeps=4, streams=Streams(seed=1))
    with pytest.raises(InputError, match="cannot tell 3 transmitting elements apart"):
        coded(ramps, DopplerDivision(num_bands=2), num_elements=3)
