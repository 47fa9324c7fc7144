"""Weights of the transmitting elements of a schedule."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule


def two_ramps(**fields):
    return RampSchedule(
        start_time=[0.0, 1e-3],
        duration=[1e-3, 1e-3],
        start_frequency=[79e9, 79e9],
        slope=[1e12, 1e12],
        start_phase=[0.0, 0.0],
        sweep=[0, 1],
        **fields,
    )


def test_without_weights_the_first_element_sends_alone():
    np.testing.assert_array_equal(two_ramps().transmit_weight, [[1.0], [1.0]])
    assert two_ramps().num_elements == 1


def test_a_clock_leaves_the_weights_as_they_are():
    weight = [[1.0, 0.0], [0.0, 1.0j]]
    clocked = two_ramps(transmit_weight=weight).as_clocked(start_time=1.0, clock_offset=1e-5)
    np.testing.assert_array_equal(clocked.transmit_weight, weight)


@pytest.mark.parametrize(
    ("weight", "message"),
    [
        ([[1.0], [1.1]], "1 is full power"),
        ([[1.0], [np.nan]], "1 is full power"),
        ([[1.0]], "has 1 along 'ramp'"),
        ([1.0, 1.0], r"it needs \(ramp, element\)"),
    ],
)
def test_impossible_weights_are_refused(weight, message):
    with pytest.raises(InputError, match=message):
        two_ramps(transmit_weight=weight)
