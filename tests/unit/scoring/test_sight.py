"""In sight: geometry and noise, each a condition of its own."""

from itertools import product

import numpy as np
import pytest

from polychirp.model.truth import Truth
from polychirp.scoring.sight import LEAST_SHARE, LEAST_SNR, in_sight


def one(*, share, is_visible=True):
    zero = np.zeros(1)
    return Truth(
        time=0.0,
        name=("car",),
        range=zero + 10.0,
        range_rate=zero,
        azimuth=zero,
        elevation=zero,
        point=np.zeros((1, 3)),
        is_visible=[is_visible],
        visible_share=[share],
    )


@pytest.mark.parametrize(("by_share", "by_noise"), list(product([0.99, 1.01], repeat=2)))
def test_a_body_is_in_sight_if_it_meets_both_conditions(by_share, by_noise):
    snr = np.array([LEAST_SNR * by_noise])
    expected = min(by_share, by_noise) > 1.0
    assert in_sight(one(share=LEAST_SHARE * by_share), snr).tolist() == [expected]


def test_a_hidden_body_is_not_in_sight_however_strong_its_echo():
    seen = in_sight(one(share=1.0, is_visible=False), np.array([1e12]))
    assert seen.tolist() == [False]
