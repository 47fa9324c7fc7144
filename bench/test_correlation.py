"""Correlation of long signals: by transforms beside the definition, and of recordings on disk."""

import numpy as np
import pytest

from polychirp.correlation.base import correlate
from polychirp.correlation.search import search
from polychirp.model.baseband import Baseband
from tests.support.references.correlation import plain_correlate

RATE = 130e6


def noise(count):
    draw = np.random.default_rng(1).standard_normal((count, 2)).view(complex)[:, 0]
    return Baseband(samples=draw, sample_rate=RATE)


def test_two_million_samples(benchmark):
    """Both signals of a million and more: well under a second."""
    a, b = noise(2_000_000), noise(2_000_000)
    benchmark.pedantic(correlate, args=(a, b), rounds=3)


@pytest.mark.parametrize("route", [correlate, plain_correlate])
def test_two_thousand_samples(benchmark, route):
    """The fast correlation beside its slow twin."""
    a, b = noise(2_000), noise(2_000)
    benchmark(route, a, b)


def test_searching_ten_million_samples(benchmark):
    """The paper's ramp, 13 000 samples, at every position in 77 ms."""
    recording, reference = noise(10_000_000), noise(13_000)
    benchmark.pedantic(search, args=(recording, reference), rounds=1)
