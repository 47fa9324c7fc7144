"""One whole trial on the shipped quickstart, and that it can be repeated to the bit."""

import os
import subprocess
import sys
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


DIGEST = """
import hashlib, sys
from dataclasses import replace
from polychirp import load_study, run_trial
trial = run_trial(replace(load_study(sys.argv[1]), num_sweeps=4))
digest = hashlib.sha256()
for victim in trial.victims:
    for array in (victim.frame.samples, victim.detections.range, victim.detections.power):
        digest.update(array.tobytes())
print(digest.hexdigest())
"""


@pytest.mark.slow
def test_the_number_of_threads_changes_no_bit():
    """Sums that a library splits among threads round differently; none is in the chain."""
    digests = set()
    for threads in ("1", "2"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
        environment = {**os.environ, **dict.fromkeys(names, threads)}
        done = subprocess.run(
            [sys.executable, "-c", DIGEST, str(QUICKSTART)],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        digests.add(done.stdout)
    assert len(digests) == 1


def test_another_seed_changes_the_noise(study, trial):
    other = run_trial(replace(study, seed=study.seed + 1))
    assert not np.array_equal(other.victims[0].parts.noise, trial.victims[0].parts.noise)
