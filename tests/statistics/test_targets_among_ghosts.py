"""Targets beside radars of equal slopes, whose ghosts are 30 dB above them."""

from dataclasses import replace

import pytest
from scipy.stats import binom

from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.trial import run_trial
from tools.experiments.ghosts import case

pytestmark = pytest.mark.slow

FRAMES = 100
LOST = 4 / 240
"""Share of the targets that are lost, in 120 other frames."""


def test_ghosts_hide_few_targets():
    """Four radars start within 0.3 µs; ghosts are 4 to 31 m and more away, and echoes of them.

    Thirteen in a hundred were lost where the dynamic range was that of channels whose noise is
    white: these raise a ghost by 20 to 30 dB that comes from where no noise comes.
    """
    study = case("number", 4).study
    found = [
        run_trial(replace(study, seed=trial_seed(3, number)), names_radars=False).victims[0].score
        for number in range(FRAMES)
    ]
    targets = sum(score.is_detected.size for score in found)
    assert targets == 2 * FRAMES
    assert sum(score.num_missed for score in found) <= binom.ppf(0.99, targets, LOST)
