"""Which detection belongs to which target."""

import numpy as np

from polychirp.model.detection import Detections
from polychirp.model.truth import Truth
from polychirp.scoring.association import Gate, associate, distances_from_bodies


def test_two_targets_within_one_gate_get_the_detections_that_are_theirs():
    """Both detections are on both targets; levels must not exchange them (400 draws)."""
    draw = np.random.default_rng(11)
    truth = Truth(
        time=0.0,
        name=("left", "right"),
        range=[25.0, 25.1],
        range_rate=[0.0, 0.6],
        azimuth=[0.0, 0.08],
        elevation=[0.0, 0.0],
        point=np.zeros((2, 3)),
        is_visible=[True, True],
    )
    for _ in range(400):
        order = draw.permutation(2)
        power = draw.uniform(0.1, 10.0, 2)
        found = Detections(
            time=0.0,
            range=truth.range[order] + draw.normal(scale=0.01, size=2),
            range_rate=truth.range_rate[order] + draw.normal(scale=0.02, size=2),
            azimuth=truth.azimuth[order] + draw.normal(scale=0.005, size=2),
            power=power,
            snr=power,
        )
        pairs = associate(found, truth, gate=Gate(), is_on_body=np.ones((2, 2), dtype=bool))
        owner = dict(zip(pairs[0], pairs[1], strict=True))
        assert [order[owner[target]] for target in (0, 1)] == [0, 1]


def test_a_line_sees_elevated_places_at_the_angle_of_a_cone():
    """A line of channels along y measures y/R, whatever the height: arcsin of cos ε sin φ."""
    draw = np.random.default_rng(12)
    place = draw.normal(size=(40, 3))
    place[:, 0] = np.abs(place[:, 0])
    unit = place / np.linalg.norm(place, axis=1)[:, None]
    one = np.ones(len(place))
    truth = Truth(
        time=0.0,
        name=tuple(str(n) for n in range(len(place))),
        range=10.0 * one,
        range_rate=0.0 * one,
        azimuth=np.arctan2(unit[:, 1], unit[:, 0]),
        elevation=np.arcsin(unit[:, 2]),
        point=np.zeros((len(place), 3)),
        is_visible=one > 0,
        place_target=np.arange(len(place)),
        place_range=10.0 * one,
        place_range_rate=0.0 * one,
        place_azimuth=np.arctan2(unit[:, 1], unit[:, 0]),
        place_elevation=np.arcsin(unit[:, 2]),
    )
    found = Detections(
        time=0.0,
        range=10.0 * one,
        range_rate=0.0 * one,
        azimuth=np.arcsin(unit[:, 1]),
        power=one,
        snr=one,
    )
    apart = distances_from_bodies(found, truth, Gate(azimuth=1e-6))
    assert np.diagonal(apart).max() < 1e-3
