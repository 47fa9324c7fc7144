"""Precision, recall and false mitigation of detectors of bursts."""

import math

import numpy as np

from polychirp.model.if_frame import IfParts
from polychirp.scoring.burst_detection import BurstCounts, burst_counts, hit_in_truth


def test_a_sample_is_hit_where_interference_exceeds_the_noise_of_the_frame():
    """Noise 1 W; interference 4 W, 0.25 W and, in the padding, 100 W."""
    samples = np.zeros((2, 1, 2, 3), dtype=complex)
    samples[0, 0, 0] = [2.0, 0.5, 10.0]
    samples[1] = [[[1.0, 1.0, 50.0], [1.0, 1.0, 1.0]]]
    parts = IfParts(samples=samples, names=("direct", "noise"))
    present = np.array([[True, True, False], [True, True, True]])
    hit = hit_in_truth(parts, present)
    assert hit.tolist() == [[True, False, False], [False, False, False]]
    assert not hit_in_truth(parts, present, level=5.0).any()


def test_the_four_cases_are_counted_without_the_padding():
    found = np.array([[True, True, False, False, True]])
    hit = np.array([[True, False, True, False, True]])
    present = np.array([[True, True, True, True, False]])
    counts = burst_counts(found, hit, present)
    assert counts == BurstCounts(both=1, missed=1, false=1, neither=1)
    assert counts + counts == BurstCounts(both=2, missed=2, false=2, neither=2)


def test_a_share_of_nothing_is_no_number():
    none = BurstCounts(both=0, missed=0, false=0, neither=10)
    assert math.isnan(none.precision)
    assert math.isnan(none.recall)
    assert none.false_mitigation == 0.0
