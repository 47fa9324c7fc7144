"""One whole trial on the shipped quickstart, and that it can be repeated to the bit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polychirp.config.load import load_study
from polychirp.model.if_frame import PARTS
from polychirp.study.trial import run_trial

QUICKSTART = Path(__file__).parents[2] / "studies" / "quickstart.toml"


@pytest.fixture(scope="module")
def study():
    """The quickstart with a short frame."""
    return replace(load_study(QUICKSTART), num_sweeps=4)


@pytest.fixture(scope="module")
def trial(study):
    return run_trial(study)


def test_every_visible_target_is_found_or_said_to_be_missed(trial):
    for victim in trial.victims:
        score, truth = victim.score, victim.truth
        visible = int(truth.is_visible.sum())
        assert int(score.is_detected[truth.is_visible].sum()) + score.num_missed == visible
        assert len(score.nature) == victim.detections.num_detections


def test_the_parts_are_the_samples(trial):
    for victim in trial.victims:
        total = sum(victim.parts[part] for part in PARTS)
        assert np.abs(total - victim.frame.samples).max() <= 1e-12 * np.abs(total).max()


def test_the_other_radar_is_heard(trial):
    assert np.abs(trial.victims[0].parts.interference).max() > 0.0


def test_the_same_study_gives_the_same_bytes(study, trial):
    again = run_trial(study)
    for one, two in zip(trial.victims, again.victims, strict=True):
        assert one.frame.samples.tobytes() == two.frame.samples.tobytes()
        assert one.detections.range.tobytes() == two.detections.range.tobytes()
        assert one.detections.azimuth.tobytes() == two.detections.azimuth.tobytes()
        assert one.score.nature == two.score.nature


def test_another_seed_changes_the_noise(study, trial):
    other = run_trial(replace(study, seed=study.seed + 1))
    assert not np.array_equal(other.victims[0].parts.noise, trial.victims[0].parts.noise)
