"""Positions of elements, and arrays that are refused."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.antenna import AntennaArray, ArrayErrors


def test_one_transmitting_element_stands_at_the_origin():
    np.testing.assert_array_equal(AntennaArray().transmit_position, np.zeros((1, 3)))


@pytest.mark.parametrize(("num_transmitters", "num_channels"), [(2, 4), (3, 4), (4, 1)])
def test_sums_of_places_are_a_line_without_a_gap(num_transmitters, num_channels):
    array = AntennaArray(num_channels=num_channels, num_transmitters=num_transmitters, spacing=2e-3)
    sums = np.sort((array.transmit_position[:, None] + array.position)[..., 1].ravel())
    size = num_transmitters * num_channels
    line = AntennaArray(num_channels=size, spacing=2e-3).position[:, 1]
    np.testing.assert_allclose(sums, line, atol=1e-15)


def test_transmitting_elements_stand_as_far_apart_as_is_asked_for():
    array = AntennaArray(num_transmitters=3, transmit_spacing=5e-3)
    np.testing.assert_allclose(array.transmit_position[:, 1], [-5e-3, 0.0, 5e-3], atol=1e-18)


def test_a_gain_is_of_power_and_a_phase_turns_the_wave():
    array = AntennaArray(num_channels=2, channel_gains=(4.0, 1.0), channel_phases=(0.0, np.pi / 2))
    np.testing.assert_allclose(array.channel_response, [2.0, 1.0j], atol=1e-15)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"num_transmitters": 0}, "at least one transmitting element"),
        ({"transmit_spacing": 0.0}, "transmitting elements must be positive"),
        ({"channel_gains": (1.0, 1.0)}, "needs 4 values or none, not 2"),
        ({"transmitter_phases": (0.1, 0.2)}, "needs 1 values or none, not 2"),
        ({"channel_gains": (1.0, 1.0, 0.0, 1.0)}, "channel_gains: every gain must be positive"),
    ],
)
def test_an_impossible_array_is_refused(fields, message):
    with pytest.raises(InputError, match=message):
        AntennaArray(**fields)


@pytest.mark.parametrize("spread", [{"gain": 0.9}, {"phase": -0.1}])
def test_a_negative_spread_of_errors_is_refused(spread):
    with pytest.raises(InputError, match="at least 0 dB"):
        ArrayErrors(**spread)


def test_positions_are_to_the_left_and_up_in_multiples_of_the_spacing():
    """Differences count; their middle is the origin of the radar's frame."""
    array = AntennaArray(
        num_channels=3, spacing=2e-3, channel_positions=((5, 7), (6, 7), (5.5, 8.5))
    )
    differences = np.diff(array.position, axis=0)
    np.testing.assert_allclose(differences, [[0.0, 2e-3, 0.0], [0.0, -1e-3, 3e-3]], atol=1e-15)
    np.testing.assert_allclose(array.position.mean(axis=0), 0.0, atol=1e-15)


def test_positions_of_the_line_are_the_line():
    line = AntennaArray(num_transmitters=2)
    same = AntennaArray(
        num_transmitters=2,
        channel_positions=((0, 0), (1, 0), (2, 0), (3, 0)),
        transmitter_positions=((0, 0), (4, 0)),
    )
    np.testing.assert_allclose(same.position, line.position, atol=1e-15)
    np.testing.assert_allclose(same.transmit_position, line.transmit_position, atol=1e-15)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"channel_positions": ((0, 0), (1, 0))}, "an array of 4 channels needs 4 positions"),
        ({"channel_positions": ((0, 0), (1, 0), (2, 0), (1, 0))}, "two elements are at"),
        ({"transmitter_positions": ((0, 0, 1),)}, "every position is a pair"),
        ({"transmitter_positions": ((0, 0),), "transmit_spacing": 1e-2}, "has no effect beside"),
    ],
)
def test_positions_that_do_not_fit_are_refused(fields, message):
    with pytest.raises(InputError, match=message):
        AntennaArray(**fields)
