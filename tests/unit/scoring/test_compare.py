"""Detections against truth: bodies, their extents, and the cause of every detection."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS
from polychirp.model.target_levels import TargetLevels
from polychirp.model.truth import Truth
from polychirp.rng import Streams
from polychirp.scoring.association import Gate, distances_from_bodies
from polychirp.scoring.compare import compare
from polychirp.scoring.echoes import Echoes
from polychirp.waveform import DiverseTriangular

TRUTH = Truth(
    time=0.0,
    name=("near", "far", "hidden"),
    range=[6.5, 9.15, 20.0],
    range_rate=[0.2, 18.0, 0.0],
    azimuth=[0.0, -0.3, 0.0],
    elevation=[0.0, 0.1, 0.0],
    point=np.zeros((3, 3)),
    is_visible=[True, True, False],
)
BODIES = ("near", "far", "hidden", "van", "wall")


def detections(*rows):
    """Rows of range, range rate, azimuth, power."""
    r, v, a, p = np.array(rows, dtype=float).reshape(-1, 4).T
    return Detections(time=0.0, range=r, range_rate=v, azimuth=a, power=p, snr=p)


def echoes(*rows, body=BODIES):
    """Rows of body, range, range rate, azimuth, power, True for multipath; at one height."""
    columns = list(zip(*rows, strict=True)) or [()] * 6
    return Echoes(
        body=body,
        is_clutter=[name == "wall" for name in body],
        actor=[body.index(name) for name in columns[0]],
        range=columns[1],
        range_rate=columns[2],
        azimuth=columns[3],
        elevation=np.zeros(len(columns[3])),
        power=columns[4],
        is_mirrored=columns[5],
    )


def powers_of(*rows):
    """Powers of the first five parts of every detection; of the others there is nothing."""
    return np.array([[*row, *[0.0] * (len(PARTS) - len(row))] for row in rows])


ECHO = (1.0, 0.0, 0.0, 0.0, 1e-3)


def score_of(found, truth=TRUTH, *, powers=None, paths=None):
    levels = TargetLevels(snr=np.ones(len(truth.name)), inr=np.ones(len(truth.name)))
    return compare(
        found,
        truth,
        powers=powers_of(*[ECHO] * found.num_detections) if powers is None else powers,
        echoes=echoes() if paths is None else paths,
        floor_rise=1.0,
        before=levels,
        after=levels,
        echo_snr=np.ones(len(truth.name)) * 1e4,
    )


def car(*, length=4.5, along=23):
    """The rear and the right side of a car ahead and to the left: places of (x, y), m."""
    rear = np.linspace(2.0, 3.8, 10) * 1j + 10.0
    side = np.linspace(10.0, 10.0 + length, along) + 2.0j
    place = np.concatenate([rear, side])
    nearest = place[np.argmin(np.abs(place))]
    zero = np.zeros(place.size)
    return Truth(
        time=0.0,
        name=("car",),
        range=[abs(nearest)],
        range_rate=[-5.0],
        azimuth=[np.angle(nearest)],
        elevation=[0.0],
        point=np.zeros((1, 3)),
        is_visible=[True],
        place_target=zero,
        place_range=np.abs(place),
        place_range_rate=zero - 5.0,
        place_azimuth=np.angle(place),
        place_elevation=zero,
    )


def at(place, rate=-5.0, power=1.0):
    return (abs(place), rate, np.angle(place), power)


@pytest.mark.parametrize("place", [10.0 + 3.7j, 12.0 + 2.0j, 14.5 + 2.0j, 14.8 + 2.0j])
def test_a_detection_on_the_side_or_the_rear_finds_the_body(place):
    score = score_of(detections(at(place)), car())
    assert score.is_detected.tolist() == [True]
    assert (score.nature, score.body) == (("target",), ("car",))


@pytest.mark.parametrize(
    "row", [at(15.1 + 2.0j), at(9.4 + 2.0j), at(12.0 + 2.0j, rate=-3.9), at(12.0 - 1.5j)]
)
def test_a_detection_beyond_the_margins_does_not(row):
    """0.6 m behind the car and 0.6 m before it, 1.1 m/s faster, and 17° beside it."""
    score = score_of(detections(row), car())
    assert not score.is_detected.any()
    assert score.nature == ("unexplained",)


def test_the_detections_of_a_body_report_its_extent():
    """From (10, 2) m to (14.5, 2) m: 10.198 to 14.638 m in range, so that they are 4.440 m apart.

    Their middle is at (12.25, 2) m. The unit vector across is (−2, 12.25)/12.412, and the 4.5 m
    along x are 4.5 · 2/12.412 = 0.725 m in this direction.
    """
    score = score_of(detections(at(10.0 + 2.0j), at(14.5 + 2.0j, rate=-5.3)), car())
    assert score.num_points.tolist() == [2.0]
    assert score.length[0] == pytest.approx(4.440, abs=1e-3)
    assert score.width[0] == pytest.approx(0.725, abs=1e-3)
    assert score.range_rate_span[0] == pytest.approx(0.3)
    assert score.other_echoes == ()


def test_errors_are_those_of_the_strongest_detection_at_the_nearest_point():
    found = detections(
        at(10.0 + 2.0j, power=1.0), at(10.2 + 2.0j, power=3.0), at(14.0 + 2j, power=9)
    )
    score = score_of(found, car())
    assert score.target_detection == (1,)
    assert score.range_error[0] == pytest.approx(abs(10.2 + 2.0j) - abs(10.0 + 2.0j))


def test_a_body_found_at_its_far_end_only_has_that_error():
    score = score_of(detections(at(14.0 + 2.0j, power=1.0), at(12.0 + 2.0j, power=0.1)), car())
    assert score.target_detection == (1,)
    assert score.range_error[0] == pytest.approx(abs(12.0 + 2.0j) - abs(10.0 + 2.0j))


def test_an_object_counts_with_its_points_and_its_extent():
    one = detections(at(12.0 + 2.0j))
    grouped = Detections(
        time=0.0,
        range=one.range,
        range_rate=one.range_rate,
        azimuth=one.azimuth,
        power=one.power,
        snr=one.snr,
        num_points=[5],
        length=[3.0],
        width=[0.7],
        range_rate_span=[0.2],
    )
    score = score_of(grouped, car())
    assert score.num_points.tolist() == [5.0]
    assert (score.length[0], score.width[0], score.range_rate_span[0]) == (3.0, 0.7, 0.2)


@pytest.mark.parametrize("part", ["direct", "indirect"])
@pytest.mark.parametrize("ratio", [0.5, 2.0, 50.0])
def test_a_ghost_on_a_body_is_told_by_its_power(part, ratio):
    """The stronger of echo and ghost causes the detection, wherever on the body it is."""
    for place in (10.0 + 2.0j, 13.0 + 2.0j, 14.5 + 2.0j):
        powers = powers_of(ECHO)
        powers[0, PARTS.index(part)] = ratio
        score = score_of(detections(at(place)), car(), powers=powers)
        is_ghost = ratio > 1.0
        assert score.nature == ((part,) if is_ghost else ("target",))
        assert score.is_detected.tolist() == [not is_ghost]
        assert score.num_missed == int(is_ghost)
        assert score.ghosts == ((0,) if is_ghost else ())


def test_noise_on_a_body_does_not_find_it():
    score = score_of(detections(at(12.0 + 2.0j)), car(), powers=powers_of((1.0, 0, 0, 0, 1.1)))
    assert score.nature == ("unexplained",)
    assert not score.is_detected.any()


@pytest.mark.parametrize(("ratio", "nature"), [(5.0, "target"), (9.5, "multipath")])
def test_a_mirror_image_on_a_body_is_multipath_beyond_what_a_road_adds(ratio, nature):
    paths = echoes(("car", abs(12 + 2j), -5.0, 0.2, 1.0, True), body=("car",))
    powers = powers_of((1.0, ratio, 0.0, 0.0, 1e-3))
    score = score_of(detections(at(12.0 + 2.0j)), car(), powers=powers, paths=paths)
    assert score.nature == (nature,)


@pytest.mark.parametrize(("ratio", "nature"), [(5.0, "target"), (9.5, "multipath")])
def test_an_echo_that_fades_on_a_body_is_told_by_the_powers_of_its_paths(ratio, nature):
    """Two paths of equal strength cancel to a hundredth; a mirrored one is ``ratio`` times both."""
    place = (abs(12 + 2j), -5.0, 0.165)
    paths = echoes(
        ("car", *place, 1.0, False),
        ("car", *place, 1.0, False),
        ("car", *place, 2.0 * ratio, True),
        body=("car",),
    )
    powers = powers_of((0.02, 2.0 * ratio, 0.0, 0.0, 1e-3))
    score = score_of(detections(at(12.0 + 2.0j)), car(), powers=powers, paths=paths)
    assert score.nature == (nature,)


@pytest.mark.parametrize(("ratio", "body"), [(5.0, "car"), (20.0, "wall")])
def test_a_stronger_echo_of_a_wall_hides_a_body_in_the_same_cell(ratio, body):
    place = 12.0 + 2.0j
    paths = echoes(
        ("car", abs(place), -5.0, 0.17, 1.0, False),
        ("wall", abs(place), -5.0, 0.17, ratio, False),
        body=("car", "wall"),
    )
    score = score_of(detections(at(place)), car(), paths=paths)
    assert score.body == (body,)
    assert score.nature == (("target",) if body == "car" else ("clutter",))


def test_a_detection_at_another_height_does_not_belong_to_a_target():
    """0.5 rad above it; without an elevation, it does."""
    low = detections((6.5, 0.2, 0.0, 1.0))
    for elevation, expected in ((np.nan, 1), (0.2, 1), (0.5, 0)):
        score = score_of(replace(low, elevation=np.array([elevation])))
        assert score.is_detected.sum() == expected


@pytest.mark.parametrize(
    ("height", "is_found"), [(0.0, True), (1.5, True), (3.0, True), (4.2, False)]
)
def test_a_detection_anywhere_on_a_tall_body_is_the_bodys(height, is_found):
    """The rear of a lorry 5 m ahead, 3 m high; its nearest point is at the radar's height.

    The margin of 15 degrees is 1.3 m or more, but the range of 0.4 m excludes what is 4.2 m above.
    """
    up = np.linspace(0.0, 3.0, 16)
    lorry = Truth(
        time=0.0,
        name=("lorry",),
        range=[5.0],
        range_rate=[0.0],
        azimuth=[0.0],
        elevation=[0.0],
        point=np.zeros((1, 3)),
        is_visible=[True],
        place_target=0.0 * up,
        place_range=np.hypot(5.0, up),
        place_range_rate=0.0 * up,
        place_azimuth=0.0 * up,
        place_elevation=np.arctan2(up, 5.0),
    )
    found = detections((np.hypot(5.0, height), 0.0, 0.0, 1.0))
    score = score_of(replace(found, elevation=np.arctan2([height], 5.0)), lorry)
    assert score.is_detected.tolist() == [is_found]


@pytest.mark.parametrize(("elevation", "body"), [(0.05, "car"), (0.4, "sign")])
def test_the_body_of_an_echo_is_that_at_its_height(elevation, body):
    """A weak echo of a car and a strong one of a sign above it, in one cell."""
    paths = replace(
        echoes(
            ("car", 30.0, 3.0, 0.0, 1.0, False),
            ("sign", 30.0, 3.0, 0.0, 5.0, False),
            body=("car", "sign"),
        ),
        elevation=np.array([0.0, 0.45]),
    )
    found = replace(detections((30.0, 3.0, 0.0, 1.0)), elevation=np.array([elevation]))
    assert score_of(found, paths=paths).body == (body,)


def test_margins_in_elevation_are_those_of_a_beam_of_many_rows():
    """Sixteen rows λ/2 apart have a beam of λ/(16 λ/2) = 0.125 rad; two rows have the default."""
    waveform = DiverseTriangular(ramp_duration=(1e-4, 2e-4))
    schedule = waveform.schedule(num_sweeps=2, streams=Streams(1))
    half = 0.5 * SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    for rows, expected in ((16, 0.125), (2, Gate().elevation), (1, Gate().elevation)):
        places = tuple((0.0, float(row)) for row in range(rows))
        array = AntennaArray(num_channels=rows, spacing=half, channel_positions=places)
        assert Gate.of(schedule, array).elevation == pytest.approx(expected, rel=1e-4)


def test_one_detection_serves_one_target():
    """Two targets in each other's margins, one detection: one is missed."""
    both = Truth(
        time=0.0,
        name=("a", "b"),
        range=[6.5, 6.6],
        range_rate=[0, 0],
        azimuth=[0, 0],
        elevation=[0, 0],
        point=np.zeros((2, 3)),
        is_visible=[True, True],
    )
    score = score_of(detections((6.5, 0.0, 0.0, 1.0)), both)
    assert score.is_detected.sum() == 1
    two = score_of(detections((6.5, 0.0, 0.0, 1.0), (6.6, 0.0, 0.0, 2.0)), both)
    assert two.is_detected.tolist() == [True, True]
    assert two.num_points.tolist() == [1.0, 1.0]


def test_a_hidden_target_is_neither_found_nor_missed():
    found = detections((20.0, 0.0, 0.0, 1.0))
    score = score_of(found, paths=echoes(("hidden", 20.0, 0.0, 0.0, 1.0, False)))
    assert not score.is_detected.any()
    assert score.num_missed == 2
    assert (score.nature, score.body) == (("body",), ("hidden",))


def test_every_kind_of_detection_gets_its_name():
    """Parts: echo, multipath, direct, indirect, noise, leakage, distortion."""
    found = detections(
        (6.5, 0.2, 0.0, 9.0),  # the target
        (3.0, 0.0, 1.4, 8.0),  # a wall, measured 12 degrees beside its path
        (4.0, 1.0, 0.1, 7.5),  # a van
        (12.0, 5.0, 0.0, 7.0),  # the mirror image of the wall
        (6.6, -9.0, 0.2, 6.0),  # straight from another radar
        (5.6, -7.0, 0.0, 5.0),  # by way of a body
        (15.0, 9.0, 0.0, 4.0),  # of own energy, but nothing is there
        (27.0, 9.0, 0.0, 3.0),  # noise
        (0.4, 0.0, 0.0, 2.0),  # straight from the own transmitter
        (21.0, 4.0, 0.0, 1.0),  # a harmonic
    )
    powers = np.full((10, len(PARTS)), 1e-3)
    powers[np.arange(10), [0, 0, 0, 1, 2, 3, 0, 4, 5, 6]] = 1.0
    score = score_of(
        found,
        powers=powers,
        paths=echoes(
            ("near", 6.5, 0.2, 0.0, 1.0, False),
            ("wall", 3.0, 0.0, -1.5, 1.0, False),
            ("van", 4.0, 1.0, 0.1, 1.0, False),
            ("wall", 4.1, 1.0, 0.1, 0.1, False),
            ("wall", 12.0, 5.0, 0.3, 1.0, True),
        ),
    )
    ghosts = ("multipath", "direct", "indirect", *["unexplained"] * 2, *["front-end"] * 2)
    assert score.nature == ("target", "clutter", "body", *ghosts)
    assert score.body == ("near", "wall", "van", *[None] * 7)
    assert score.ghosts == (3, 4, 5, 6, 7, 8, 9)
    assert score.other_echoes == (1, 2)
    assert score.num_missed == 1


def test_distances_from_bodies_are_those_of_a_loop():
    """Two drawn bodies of 40 places each, 50 detections; the third body is hidden.

    The last ten detections have no elevation, and see a place's azimuth as arcsin(cos ε sin φ).
    """
    draw, gate = np.random.default_rng(4), Gate()
    place = draw.uniform([5, -3, -0.5, -0.5], [15, 3, 0.5, 0.5], size=(80, 4))
    truth = Truth(
        time=0.0,
        name=("a", "b", "hidden"),
        range=[5.0, 5.0, 9.0],
        range_rate=[0.0, 0.0, 0.0],
        azimuth=[0.0, 0.0, 0.0],
        elevation=[0.0, 0.0, 0.0],
        point=np.zeros((3, 3)),
        is_visible=[True, True, False],
        place_target=np.repeat([0, 1], 40),
        place_range=place[:, 0],
        place_range_rate=place[:, 1],
        place_azimuth=place[:, 2],
        place_elevation=place[:, 3],
    )
    rows = draw.uniform([5, -3, -0.5, 1], [15, 3, 0.5, 1], size=(50, 4))
    elevation = np.where(np.arange(50) < 40, draw.uniform(-0.5, 0.5, 50), np.nan)
    found = replace(detections(*rows), elevation=elevation)
    apart = distances_from_bodies(found, truth, gate)
    margins = np.array([gate.range, gate.range_rate, gate.azimuth, gate.elevation])
    flat = place.copy()
    flat[:, 2] = np.arcsin(np.cos(place[:, 3]) * np.sin(place[:, 2]))
    for n, row in enumerate(rows):
        seen = np.append(row[:3], elevation[n])
        for body in (0, 1):
            mine = (place if n < 40 else flat)[40 * body : 40 * body + 40]
            expected = min(np.nanmax(abs(seen - one) / margins) for one in mine)
            assert apart[body, n] == pytest.approx(expected)
    assert np.all(np.isinf(apart[2]))


@pytest.mark.parametrize("num_detections", [0, 2])
def test_without_targets_no_detection_is_on_one(num_detections):
    nothing = Truth(
        time=0.0,
        name=(),
        range=[],
        range_rate=[],
        azimuth=[],
        elevation=[],
        point=np.zeros((0, 3)),
        is_visible=[],
    )
    found = detections(*[(6.5, 0.2, 0.0, 1.0)] * num_detections)
    score = score_of(
        found, nothing, powers=powers_of(*[ECHO] * num_detections).reshape(-1, len(PARTS))
    )
    assert len(score.is_detected) == 0
    assert score.nature == ("unexplained",) * num_detections
