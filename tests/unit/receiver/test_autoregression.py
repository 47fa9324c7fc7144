"""Gaps filled by an autoregressive model from both sides."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.mitigation import Autoregression
from polychirp.receiver.mitigation.autoregression import interpolator
from polychirp.receiver.mitigation.prediction import covariance_model
from polychirp.rng import Streams
from polychirp.waveform import Triangular
from tests.support.points import HandPoint, frame_of

RAMPS = Triangular().schedule(num_sweeps=1, streams=Streams(1))
TONES = [
    HandPoint(range=5.0, power=1e4),
    HandPoint(range=9.0, power=1e2),
    HandPoint(range=17.0, power=1.0),
]


def filled(frame, start, stop, **settings):
    """The frame after a burst in its second ramp and the filling of it."""
    samples = frame.samples.copy()
    samples[:, 1, start:stop] += 1e4
    return Autoregression(guard=0.0, **settings).mitigate(frame.with_samples(samples))


@pytest.mark.parametrize("length", [4, 16, 48])
def test_tones_without_noise_go_on_through_the_gap(compare, length):
    """Three tones of steady frequency need three coefficients; 40 dB apart, the weakest too."""
    frame = frame_of(RAMPS, TONES, noise=0.0)
    cleaned = filled(frame, 400, 400 + length)
    assert cleaned.weight[1, 400 : 400 + length] == pytest.approx(1.0)
    error = np.abs(cleaned.samples - frame.samples)[:, 1].max()
    compare(
        page="mitigation",
        case=f"autoregression, three tones, gap of {length} samples",
        quantity="greatest error in the gap over the weakest tone",
        expected=0.0,
        measured=float(error),
        tolerance=1e-3,
        source="P tones obey a recurrence of order P",
    )


def test_noise_alone_is_filled_with_less_than_noise():
    """The conditional mean of what cannot be predicted is zero; 1e2 lag estimates stray by 10 %."""
    frame = frame_of(RAMPS, [], seed=4)
    cleaned = filled(frame, 400, 430)
    assert np.mean(np.abs(cleaned.samples[:, 1, 400:430]) ** 2) < 0.5


def test_a_gap_that_is_too_long_stays_blank():
    frame = frame_of(RAMPS, TONES)
    for length, is_filled in ((32, True), (33, False)):
        cleaned = filled(frame, 400, 400 + length, order=16, longest_gap=2.0)
        assert np.all(cleaned.weight[1, 400 : 400 + length] == is_filled)
        assert np.any(cleaned.samples[:, 1, 400 : 400 + length] != 0.0) == is_filled


def test_a_gap_at_a_ramps_end_stays_blank():
    frame = frame_of(RAMPS, TONES)
    last = int(frame.times.num_samples[1])
    assert not filled(frame, 10, 20, order=16).weight[1, 10:20].any()
    assert not filled(frame, last - 20, last - 10, order=16).weight[1, last - 20 : last - 10].any()
    assert filled(frame, 20, 30, order=16).weight[1, 20:30].all()


def test_gaps_less_than_an_order_apart_are_filled_together():
    frame = frame_of(RAMPS, TONES, noise=0.0)
    samples = frame.samples.copy()
    samples[:, 1, 400:410] += 1e4
    samples[:, 1, 420:425] += 1e4
    cleaned = Autoregression(guard=0.0).mitigate(frame.with_samples(samples))
    assert cleaned.weight[1, 400:425].all()
    assert np.abs(cleaned.samples - frame.samples)[:, 1].max() < 1e-3


def test_the_interpolator_makes_the_prediction_error_least():
    """Slow reference: all prediction errors through the gap, as a matrix."""
    draw = np.random.default_rng(3)
    model = np.concatenate([[1.0], 0.3 * (draw.normal(size=5) + 1j * draw.normal(size=5))])
    missing = np.array([5, 6, 9])
    span = np.arange(15)
    known = np.setdiff1d(span, missing)
    error = np.array([[model[n - i] if 0 <= n - i <= 5 else 0.0 for i in span] for n in span[5:]])
    samples = draw.normal(size=known.size) + 1j * draw.normal(size=known.size)
    expected = np.linalg.lstsq(error[:, missing], -error[:, known] @ samples)[0]
    assert interpolator(model, missing, known) @ samples == pytest.approx(expected, abs=1e-12)


def test_the_model_makes_forward_and_backward_errors_least():
    """Slow reference: every equation on its own, those with a bad sample left out."""
    draw = np.random.default_rng(4)
    samples = draw.normal(size=(2, 60)) + 1j * draw.normal(size=(2, 60))
    is_good = np.arange(60) != 30
    rows, right = [], []
    for channel in samples:
        for n in range(4, 60):
            if is_good[n - 4 : n + 1].all():
                rows += [channel[n - 4 : n][::-1], channel[n - 3 : n + 1].conj()]
                right += [-channel[n], -channel[n - 4].conj()]
    expected = np.linalg.lstsq(np.array(rows), np.array(right))[0]
    assert covariance_model(samples, is_good, 4)[1:] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("wrong", "word"), [({"order": 0}, "order"), ({"longest_gap": 0.0}, "gap")]
)
def test_what_cannot_be_is_refused(wrong, word):
    with pytest.raises(InputError, match=word):
        Autoregression(**wrong)
