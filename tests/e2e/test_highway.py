"""The study of two radars on a highway, in a small version of it."""

import pytest

from polychirp.config.load import load_study
from polychirp.study.trial import run_trial
from tests.support.snippets import ROOT

SMALL = ("num_sweeps=48", "radars.0.array.num_channels=4", "radars.1.transmit_power=-100 dBm")
"""A quarter of the sweeps and of the channels, and no interference."""


@pytest.mark.slow
def test_both_vehicles_of_the_highway_are_found_without_interference():
    """Four draws of the noise; errors within a cell, 1 m and 8 m/s, of the nearest metal."""
    for seed in range(4):
        study = load_study(
            ROOT / "studies" / "highway" / "two-radars.toml", overrides=(*SMALL, f"seed={seed}")
        )
        victim = run_trial(study).victim("front")
        assert victim.truth.name == ("ahead", "oncoming")
        assert victim.score.is_detected.all()
        assert abs(victim.score.range_error).max() < 1.5
        assert abs(victim.score.range_rate_error).max() < 8.0
        assert set(victim.score.nature) <= {"target", "body", "clutter", "multipath"}
