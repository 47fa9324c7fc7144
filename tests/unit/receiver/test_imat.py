"""Gaps filled from a sparse spectrum."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.mitigation import Imat
from polychirp.receiver.mitigation.sparse_filling import filled, samples_at, sparse_lines

SIZE = 1000
N = np.arange(SIZE)


def tones(*bins_and_amplitudes):
    """Two channels of tones, the second turned."""
    line = sum(a * np.exp(2j * np.pi * b * N / SIZE) for b, a in bins_and_amplitudes)
    return np.stack([line, np.exp(1j) * line])[:, None]


def repaired(samples, hit, **thresholds):
    """Samples ``(channel, ramp, fast)`` with those that are hit filled."""
    gap = samples_at(hit[None])
    return filled(samples, gap, sparse_lines(samples, gap, **thresholds))


@pytest.mark.parametrize("length", [10, 40, 100])
def test_a_sparse_spectrum_comes_back(compare, length):
    """Three lines, 40 dB between them: each iteration takes on what stands out of the rest."""
    samples = tones((40, 100.0), (91, 10.0), (-7, 1.0))
    hit = np.isin(N, np.arange(450, 450 + length))
    struck = samples + 1e4 * hit
    found = repaired(struck, hit, iterations=30, depth=1e6)
    assert np.array_equal(found[..., ~hit], samples[..., ~hit])
    compare(
        page="mitigation",
        case=f"IMAT, three lines, gap of {length} of {SIZE} samples",
        quantity="greatest error in the gap over the weakest line",
        expected=0.0,
        measured=float(np.abs(found - samples).max()),
        tolerance=1e-3,
        source="few lines and many samples have one solution",
    )


def test_the_error_shrinks_by_the_share_that_is_missing():
    """Of one line, a share q of the samples is missing: each iteration leaves q of the error."""
    samples = tones((40, 1.0))
    hit = N < 200
    chosen = np.zeros((6, 1, SIZE), dtype=bool)
    chosen[..., 40] = True
    for iterations in range(1, 7):
        found = filled(samples, samples_at(hit[None]), chosen[:iterations])
        error = np.abs(found - samples)[..., hit]
        assert error == pytest.approx(0.2**iterations, rel=1e-9)


def test_noise_alone_is_filled_with_a_tenth_of_it():
    """Lines above three times the median: 2⁻⁹ of all for one channel, fewer for two."""
    draw = np.random.default_rng(2)
    noise = draw.normal(size=(2, 1, SIZE)) + 1j * draw.normal(size=(2, 1, SIZE))
    hit = N < 50
    found = repaired(noise, hit, iterations=10, depth=1e6)
    assert np.mean(np.abs(found[..., hit]) ** 2) < 0.1 * np.mean(np.abs(noise) ** 2)


def test_the_threshold_falls_to_its_depth_and_no_further():
    samples = tones((40, 100.0), (91, 1.0))  # 40 dB
    gap = samples_at((N < 50)[None])
    deep, shallow = (
        sparse_lines(samples, gap, iterations=20, depth=depth)[:, 0] for depth in (1e5, 1e3)
    )
    assert deep[-1, 91]
    assert not shallow[:, 91].any()
    assert deep[:, 40].all() or deep[1:, 40].all()


@pytest.mark.parametrize(
    ("wrong", "word"), [({"iterations": 1}, "iterations"), ({"depth": 1.0}, "depth")]
)
def test_what_cannot_be_is_refused(wrong, word):
    with pytest.raises(InputError, match=word):
        Imat(**wrong)
