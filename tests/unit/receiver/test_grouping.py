"""Detections of one body made one object."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.detection import Detections
from polychirp.receiver.grouping import Body, merged, objects


def detections(place, rate, power):
    """Points (x, y) on the road, in m."""
    position = np.array(place) @ [1.0, 1j]
    return Detections(
        time=0.0,
        range=np.abs(position),
        range_rate=np.array(rate),
        azimuth=np.angle(position),
        power=np.array(power),
        snr=10.0 * np.array(power),
    )


CAR = [(10.0, 0.0), (10.0, 1.5), (11.5, 1.6), (13.2, 1.7), (14.5, 1.7)]


def test_a_car_is_one_object_and_its_neighbour_another():
    """Two cars side by side, 3 m apart; the second's echoes are closer to each other."""
    found = detections([*CAR, (10.0, 4.5)], [-5.0] * 6, [5.0, 4.0, 3.0, 2.0, 1.0, 6.0])
    assert objects(found).tolist() == [1, 1, 1, 1, 1, 0]


def test_what_moves_otherwise_is_another_object():
    found = detections([(10.0, 0.0), (10.5, 0.0)], [-5.0, -8.0], [2.0, 1.0])
    assert objects(found).tolist() == [0, 1]


def test_no_object_is_longer_than_a_body():
    """A queue of points every metre: cut where a car ends, not one of 20 m."""
    place = [(5.0 + n, 0.0) for n in range(20)]
    found = detections(place, [0.0] * 20, np.arange(20.0, 0.0, -1.0))
    number = objects(found, Body(extent=4.5))
    for n in range(number.max() + 1):
        assert np.ptp(found.range[number == n]) <= 4.5
    assert number.max() + 1 == 4


def test_an_object_lies_between_its_members_and_has_their_power():
    found = detections([(10.0, 1.0), (10.0, -1.0), (25.0, 0.0)], [-5.0, -6.0, 1.0], [1.0, 1.0, 9.0])
    one = merged(found, objects(found))
    assert one.power == pytest.approx([9.0, 2.0])
    assert one.range == pytest.approx([25.0, 10.0])
    assert one.azimuth == pytest.approx([0.0, 0.0], abs=1e-12)
    assert one.range_rate == pytest.approx([1.0, -5.5])
    assert one.snr == pytest.approx([90.0, 10.0])


def test_nothing_has_no_objects():
    found = detections(np.zeros((0, 2)), [], [])
    assert objects(found).size == 0
    assert merged(found, objects(found)).num_detections == 0


def test_a_body_without_extent_is_refused():
    with pytest.raises(InputError, match="positive"):
        Body(gap=0.0)
