"""What the MFSK radar of `studies/mfsk.toml` finds over drawn streets, alone and beside chirps.

The guide to waveforms, docs/how-to/waveforms.md, has these numbers.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polychirp.config.load import load_study
from polychirp.rng import Streams
from polychirp.study.spec import Study
from polychirp.study.trial import run_trial

pytestmark = pytest.mark.slow

STUDY = load_study(Path(__file__).parents[2] / "studies" / "mfsk.toml")
FRAMES = 60
EXPECTED = {
    "alone: ahead": 60,
    "alone: chirping": 40,
    "steps: ahead": 60,
    "steps: chirping": 12,
    "chirps: ahead": 57,
    "chirps: stepping": 20,
}
"""Frames in which each target is found, of 60; the chirping car is in sight in 53."""

TOLERANCE = 3.0 * np.sqrt(FRAMES / 4.0)
"""Three standard deviations of a number of `FRAMES` draws, at most."""


def variant(number: int) -> Study:
    """The study with places ± 6 m, speeds ± 3 m/s and the start of the chirps drawn."""
    random = Streams(17)["mfsk variant", number]
    place, speed = random.uniform(-6.0, 6.0, 3), random.uniform(-3.0, 3.0, 3)
    vehicles = tuple(
        replace(vehicle, x=vehicle.x + float(x), speed=vehicle.speed + float(v))
        for vehicle, x, v in zip(STUDY.street.vehicles, place, speed, strict=True)
    )
    stepping, chirping = STUDY.radars
    return replace(
        STUDY,
        seed=number + 1,
        street=replace(STUDY.street, vehicles=vehicles),
        radars=(stepping, replace(chirping, start_time=float(random.uniform(0.0, 36e-6)))),
    )


def test_the_guide_has_the_shares_that_steps_and_chirps_find() -> None:
    in_sight: Counter[str] = Counter()
    found: Counter[str] = Counter()
    ghosts: Counter[str] = Counter()
    floors: list[float] = []
    for number in range(FRAMES):
        study = variant(number)
        alone = run_trial(replace(study, radars=study.radars[:1])).victims
        beside = run_trial(study).victims
        floors.append(beside[0].score.floor_rise)
        for case, victim in zip(("alone", "steps", "chirps"), (*alone, *beside), strict=True):
            score = victim.score
            ghosts[case] += len(score.ghosts)
            for n, name in enumerate(victim.truth.name):
                in_sight[f"{case}: {name}"] += bool(score.is_in_sight[n])
                found[f"{case}: {name}"] += bool(score.is_in_sight[n] and score.is_detected[n])
    floor = [round(float(level), 1) for level in 10.0 * np.log10(np.percentile(floors, [0, 100]))]
    told = f"{dict(found)} of {dict(in_sight)}, ghosts {dict(ghosts)}, floor {floor} dB"
    assert dict(found) == pytest.approx(EXPECTED, abs=TOLERANCE), told
    assert in_sight["alone: chirping"] == pytest.approx(53, abs=TOLERANCE), told
