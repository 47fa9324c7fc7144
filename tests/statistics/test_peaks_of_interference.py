"""Detections that peaks of interference cause in traced frames, over drawn slopes and clocks."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.stats import binom, poisson

from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.study.paper.scenarios import TARGETS_OF_RADAR, paper_study
from polychirp.study.reception import Reception
from polychirp.study.spec import Study, scene_of, schedules_of, tracer_of
from polychirp.study.trial import VictimResult, receive_and_score, trace_frame
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.units import to_db

pytestmark = pytest.mark.slow

FRAMES = 24
MEAN = 0.023
"""Mean number of false detections in a frame of the paper's figure 11b, over 88 draws."""


def results_of_radar_2(studies: Sequence[Study]) -> list[VictimResult]:
    """Radars 2 and 4 of each study at 13.2 m, not mitigated, all on the paths of one street."""
    ramps = [schedules_of(study) for study in studies]
    scene = scene_of(studies[0])
    snapshots = trace_frame(
        tracer_of(studies[0], ramps[0]),
        scene,
        [schedule for some in ramps for schedule in some],
        refresh_interval=1e-3,
    )
    victim, other = scene.radar_index("vehicle-2"), scene.radar_index("vehicle-4")
    results = []
    for study, schedules in zip(studies, ramps, strict=True):
        frame, parts = synthesize(
            Stretch(),
            scene,
            schedules,
            snapshots,
            victim=victim,
            interferers=[other],
            streams=Streams(study.seed),
        )
        results.append(
            receive_and_score(
                CoherentReceiver(),
                scene,
                snapshots,
                victim=victim,
                frame=frame,
                parts=parts,
                targets=TARGETS_OF_RADAR["vehicle-2"],
                reception=Reception(
                    engine=Stretch(),
                    scene=scene,
                    schedules=schedules,
                    snapshots=snapshots,
                    victim=victim,
                    interferers=[other],
                ),
            )
        )
    assert all(result.score.num_missed == 0 for result in results)
    return results


def levels_of_interference(result: VictimResult) -> list[float]:
    """Powers of detections that interference causes, dB over the strongest of the frame."""
    level = to_db(result.detections.power / np.max(result.detections.power))
    of_interference = ("direct", "indirect", "unexplained")
    return [
        float(one)
        for one, nature in zip(level, result.score.nature, strict=True)
        if nature in of_interference
    ]


def test_an_oncoming_radar_of_other_slopes_causes_few_detections():
    """On one street; slopes and noise are drawn.

    With one covariance of the channels for all ranges there were 1.1 in a frame. Then there were
    0.7, of which 0.3 were points that nearly cancel each other, of one peak of interference, and
    most others lines of the walls that paths left which fade from trace to trace.
    """
    studies = [paper_study("diverse", seed=seed) for seed in range(301, 301 + FRAMES)]
    false = sum(len(levels_of_interference(result)) for result in results_of_radar_2(studies))
    assert false <= poisson.ppf(0.99, MEAN * FRAMES)


def test_an_oncoming_radar_of_equal_slopes_that_starts_at_random_makes_only_weak_detections():
    """Its bursts lie at one place of all ramps: they make ridges at some range rates of the map.

    Points were held to these ridges only when they were found, and not when they were fitted: 49
    of 100 frames had such detections, up to 33 dB below the strongest target. Now 17 have, most
    at the ranges of weak echoes of the street.
    """
    studies = [
        paper_study("conventional", synchronous=False, seed=seed)
        for seed in range(301, 301 + FRAMES)
    ]
    levels = [levels_of_interference(result) for result in results_of_radar_2(studies)]
    assert sum(bool(frame) for frame in levels) <= binom.ppf(0.99, FRAMES, 0.17)
    assert max(max(frame, default=-np.inf) for frame in levels) < -30.0
