"""Detections against truth."""

from dataclasses import replace

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT as C
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS
from polychirp.model.paths import Bounce, PropagationPaths
from polychirp.model.target_levels import TargetLevels
from polychirp.model.truth import Truth
from polychirp.scoring.association import Gate, associate
from polychirp.scoring.compare import compare

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


def detections(*rows):
    """Rows of range, range rate, azimuth, power."""
    r, v, a, p = np.array(rows, dtype=float).reshape(-1, 4).T
    return Detections(time=0.0, range=r, range_rate=v, azimuth=a, power=p, snr=p)


def paths(*rows):
    """Own paths: rows of range, rate, mirrored."""
    n = len(rows)
    counts = [2 if mirrored else 1 for _, _, mirrored in rows]
    kinds = [
        kind
        for _, _, mirrored in rows
        for kind in ([Bounce.REFLECTION, Bounce.SCATTERING] if mirrored else [Bounce.SCATTERING])
    ]
    return PropagationPaths(
        reference_time=0.0,
        frequency=79e9,
        transmitter=np.zeros(n),
        receiver=np.zeros(n),
        delay=[2 * r / C for r, _, _ in rows],
        delay_rate=[2 * v / C for _, v, _ in rows],
        transfer=np.ones((n, 2, 2)),
        departure=np.ones((n, 3)),
        arrival=np.ones((n, 3)),
        bounce_start=np.concatenate([[0], np.cumsum(counts)]),
        bounce_actor=np.zeros(len(kinds)),
        bounce_kind=kinds,
        bounce_point=np.zeros((len(kinds), 3)),
    )


def powers_of(first):
    """One detection's powers from the first five parts; of the others there is nothing."""
    return np.array([[*first, *[0.0] * (len(PARTS) - len(first))]])


def test_the_strongest_detection_in_the_gate_is_the_targets_not_the_nearest():
    found = detections((6.5, 0.2, 0.0, 1.0), (6.7, 0.2, 0.0, 10.0))
    target, detection = associate(found, TRUTH, gate=Gate())
    assert (target.tolist(), detection.tolist()) == ([0], [1])


def test_a_detection_at_another_height_does_not_belong_to_a_target():
    """0.5 rad above it; without an elevation, it does."""
    low = detections((6.5, 0.2, 0.0, 1.0))
    for elevation, expected in ((np.nan, 1), (0.2, 1), (0.5, 0)):
        found = replace(low, elevation=np.array([elevation]))
        target, _ = associate(found, TRUTH, gate=Gate())
        assert target.size == expected


def test_one_detection_serves_one_target():
    """Two targets in each other's gate, one detection: one is missed."""
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
    target, _ = associate(detections((6.5, 0.0, 0.0, 1.0)), both, gate=Gate())
    assert target.size == 1


LEVELS = TargetLevels(snr=np.ones(len(TRUTH.name)), inr=np.ones(len(TRUTH.name)))


def test_a_hidden_target_is_neither_found_nor_missed():
    found = detections((20.0, 0.0, 0.0, 1.0))
    score = compare(
        found,
        TRUTH,
        powers=powers_of([1.0, 0, 0, 0, 1e-3]),
        own_paths=paths((20.0, 0.0, False)),
        floor_rise=1.0,
        before=LEVELS,
        after=LEVELS,
    )
    assert not score.is_detected.any()
    assert score.num_missed == 2
    assert score.nature == ("echo",)


def test_every_kind_of_detection_gets_its_name():
    """Parts: echo, multipath, direct, indirect, noise, leakage, distortion."""
    found = detections(
        (6.5, 0.2, 0.0, 9.0),  # the target
        (3.0, 0.0, 1.4, 8.0),  # a wall that was traced
        (12.0, 5.0, 0.0, 7.0),  # its mirror image
        (6.6, -9.0, 0.2, 6.0),  # straight from another radar
        (5.6, -7.0, 0.0, 5.0),  # by way of a body
        (15.0, 9.0, 0.0, 4.0),  # of own energy, but nothing is there
        (27.0, 9.0, 0.0, 3.0),  # noise
        (0.4, 0.0, 0.0, 2.0),  # straight from the own transmitter
        (21.0, 4.0, 0.0, 1.0),  # a harmonic
    )
    powers = np.full((9, len(PARTS)), 1e-3)
    powers[np.arange(9), [0, 0, 1, 2, 3, 0, 4, 5, 6]] = 1.0
    score = compare(
        found,
        TRUTH,
        powers=powers,
        own_paths=paths((6.5, 0.2, False), (3.0, 0.0, False), (12.0, 5.0, True)),
        floor_rise=1.0,
        before=LEVELS,
        after=LEVELS,
    )
    assert score.nature == (
        "target",
        "echo",
        "multipath",
        "direct",
        "indirect",
        "unexplained",
        "unexplained",
        "front-end",
        "front-end",
    )
    assert score.ghosts == (2, 3, 4, 5, 6, 7, 8)
    assert score.num_missed == 1


def test_a_ghost_on_top_of_a_target_does_not_count_as_finding_it():
    found = detections((6.5, 0.2, 0.0, 9.0))
    score = compare(
        found,
        TRUTH,
        powers=powers_of([1e-4, 0.0, 1.0, 0.0, 1e-9]),
        own_paths=paths((6.5, 0.2, False)),
        floor_rise=1.0,
        before=LEVELS,
        after=LEVELS,
    )
    assert not score.is_detected[0]
    assert score.nature == ("direct",)


def test_an_echo_under_a_neighbours_interference_is_still_an_echo():
    """20 dB is the limit: an interferer's floor may stand above a real wall."""
    found = detections((3.0, 0.0, 0.0, 9.0))
    for ratio, nature in ((10.0, "echo"), (1000.0, "direct")):
        score = compare(
            found,
            TRUTH,
            powers=powers_of([1.0, 0.0, ratio, 0.0, 1e-3]),
            own_paths=paths((3.0, 0.0, False)),
            floor_rise=1.0,
            before=LEVELS,
            after=LEVELS,
        )
        assert score.nature == (nature,)
