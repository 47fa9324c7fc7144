"""Detections of one body as one object."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.config.load import build
from polychirp.errors import InputError
from polychirp.model.detection import Detections
from polychirp.receiver.clustering import Body, merged, objects
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of


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


def test_a_bridge_above_a_car_is_another_object():
    """Both 10 m away in the same azimuth, 5 m apart in height; on the road's plane they are one."""
    above = np.arcsin(0.5)
    plane = detections([(10.0, 0.0), (10.0, 0.0)], [-5.0, -5.0], [2.0, 1.0])
    assert objects(plane).tolist() == [0, 0]
    space = replace(plane, elevation=np.array([0.0, above]))
    assert objects(space).tolist() == [0, 1]
    assert merged(space).elevation == pytest.approx([0.0, above])


def test_the_mean_of_a_body_has_a_mean_height():
    """Of two points 3 m above and 1 m below the radar, 12 m ahead, it is 1 m above, 12 m ahead."""
    height = np.array([3.0, -1.0])
    found = Detections(
        time=0.0,
        range=np.hypot(12.0, height),
        range_rate=[-5.0, -5.0],
        azimuth=[0.0, 0.0],
        elevation=np.arctan2(height, 12.0),
        power=[1.0, 1.0],
        snr=[9.0, 9.0],
    )
    one = merged(found, Body(gap=5.0, place="mean"))
    assert one.range == pytest.approx([np.hypot(12.0, 1.0)])
    assert one.elevation == pytest.approx([np.arctan2(1.0, 12.0)])


def test_no_object_is_longer_than_a_body():
    """A queue of points every metre: cut where a car ends, not one of 20 m."""
    place = [(5.0 + n, 0.0) for n in range(20)]
    found = detections(place, [0.0] * 20, np.arange(20.0, 0.0, -1.0))
    number = objects(found, Body(extent=4.5))
    for n in range(number.max() + 1):
        assert np.ptp(found.range[number == n]) <= 4.5
    assert number.max() + 1 == 4


PAIR = ([(10.0, 1.0), (9.0, -1.0), (25.0, 0.0)], [-5.0, -5.5, 1.0], [3.0, 1.0, 9.0])


@pytest.mark.parametrize(
    ("place", "position", "rate"),
    [
        ("strongest", 10.0 + 1.0j, -5.0),
        ("nearest", 9.0 - 1.0j, -5.5),
        ("mean", 9.75 + 0.5j, -5.125),
    ],
)
def test_an_object_has_the_power_of_its_members_and_the_place_that_is_asked_for(
    place, position, rate
):
    one = merged(detections(*PAIR), Body(gap=2.5, place=place))
    assert one.power == pytest.approx([9.0, 4.0])
    assert one.range == pytest.approx([25.0, abs(position)])
    assert one.azimuth == pytest.approx([0.0, np.angle(position)], abs=1e-12)
    assert one.range_rate == pytest.approx([1.0, rate])
    assert one.snr == pytest.approx([90.0, 30.0])


def test_an_object_keeps_the_extent_of_its_points():
    """The points (10, 1) and (9, −1) m are at 10.050 and 9.055 m; across they are 2 m apart."""
    one = merged(detections(*PAIR), Body(gap=2.5))
    assert one.num_points.tolist() == [1, 2]
    assert one.length == pytest.approx([0.0, 10.0499 - 9.0554], abs=1e-4)
    assert one.width == pytest.approx([0.0, 2.0], abs=1e-9)
    assert one.range_rate_span == pytest.approx([0.0, 0.5])


RAMPS = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(3))


def echoes(places, rate):
    """Points of one body, whose parts are equally strong, that comes nearer at ``rate``."""
    return [
        HandPoint(
            range=float(np.hypot(x, y)),
            range_rate=rate * x / float(np.hypot(x, y)),
            azimuth=float(np.arctan2(y, x)),
            power=1e-2,
        )
        for x, y in places
    ]


SIDE = [(12.0, -1.0), (12.4, -1.8), (13.6, -1.9), (14.9, -1.9)]


def test_a_line_of_points_of_one_body_is_one_detection():
    frame = frame_of(RAMPS, echoes(SIDE, -6.0))
    apart = CoherentReceiver().detect(frame)
    assert apart.num_detections == len(SIDE)
    one = CoherentReceiver(grouping=Body()).detect(frame)
    assert one.num_detections == 1
    assert one.power[0] == pytest.approx(apart.power.sum())


def test_cars_side_by_side_of_different_speeds_are_two_detections():
    other = [(x, y + 2.5) for x, y in SIDE]
    frame = frame_of(RAMPS, [*echoes(SIDE, -6.0), *echoes(other, -9.0)])
    two = CoherentReceiver(grouping=Body()).detect(frame)
    assert sorted(two.range_rate) == pytest.approx([-9.0, -6.0], abs=0.3)


def test_nothing_has_no_objects():
    found = detections(np.zeros((0, 2)), [], [])
    assert objects(found).size == 0
    assert merged(found).num_detections == 0


def test_a_body_without_extent_is_refused():
    with pytest.raises(InputError, match="positive"):
        Body(gap=0.0)
    with pytest.raises(InputError, match="nearest"):
        Body(place="middle")


def test_a_study_file_asks_for_grouping():
    assert build(CoherentReceiver, {"grouping": {}}).grouping == Body()
    assert build(CoherentReceiver, {"grouping": {"gap": "150 cm"}}).grouping == Body(gap=1.5)
    assert build(CoherentReceiver, {}).grouping is None


def test_a_gap_above_the_extent_groups_as_one_of_the_extent():
    """Two points of one body are within its extent, and so within any greater gap."""
    differs = []
    for draw in range(20):
        random = np.random.default_rng(draw)
        found = detections(
            random.uniform(0.0, 12.0, (25, 2)), random.uniform(0.0, 2.0, 25), random.random(25)
        )
        groups = [objects(found, Body(gap=gap, extent=3.0)) for gap in (2.0, 3.0, 3.5, 100.0)]
        assert all(np.array_equal(one, groups[1]) for one in groups[2:])
        differs.append(not np.array_equal(groups[0], groups[1]))
    assert np.mean(differs) > 0.5
