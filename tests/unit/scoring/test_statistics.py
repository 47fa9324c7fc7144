"""Intervals contain the truth as often as stated; targets of a trial are no independent draws.

Coverage is counted over simulated experiments whose truth is known; a count of 2000 has a standard
error of 0.005 at 0.95.
"""

import math

import numpy as np
import pytest
from scipy import stats

from polychirp.scoring.statistics import (
    mean_count,
    proportion,
    ratio_difference,
    rms,
    rms_difference,
    wilson,
)

EXPERIMENTS = 2000


def coverage(truth, experiment):
    rng = np.random.default_rng(5)
    found = [experiment(rng) for _ in range(EXPERIMENTS)]
    return np.mean([estimate.low <= truth <= estimate.high for estimate in found])


@pytest.mark.parametrize(("hits", "number"), [(0, 10), (3, 10), (10, 10), (70, 200)])
def test_wilsons_interval_is_scipys(hits, number):
    found = wilson(hits / number, number)
    expected = stats.binomtest(hits, number).proportion_ci(method="wilson")
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_a_single_target_per_trial_gives_wilsons_interval():
    hits = (np.arange(40) % 4 == 0).astype(float)
    assert proportion(hits, np.ones(40)) == wilson(0.25, 40)


def test_targets_that_share_their_fate_count_as_one():
    fate = (np.arange(40) % 4 == 0).astype(float)
    five = proportion(5 * fate, np.full(40, 5.0))
    one = wilson(0.25, 40)
    assert five.value == one.value
    # Student's t instead of the normal distribution: 3 % at 39 degrees of freedom
    assert one.half_width <= five.half_width <= 1.05 * one.half_width


def test_targets_that_are_independent_count_each():
    rng = np.random.default_rng(1)
    hits = rng.binomial(5, 0.3, size=400).astype(float)
    found = proportion(hits, np.full(400, 5.0))
    assert found.half_width == pytest.approx(wilson(found.value, 2000).half_width, rel=0.1)


def test_finding_all_is_no_certainty():
    found = proportion(np.full(20, 5.0), np.full(20, 5.0))
    assert found.high == 1.0
    assert found.low < wilson(1.0, 20).low + 1e-12


def test_without_targets_nothing_is_known():
    assert math.isnan(proportion(np.zeros(5), np.zeros(5)).value)
    assert math.isnan(rms(np.zeros(0), np.zeros(0)).value)
    assert math.isnan(mean_count(np.zeros(0)).value)


def test_normal_errors_have_the_chi_square_interval():
    rng = np.random.default_rng(2)
    errors = rng.normal(size=2000)
    found = rms(errors**2, np.ones(2000))
    low, high = stats.chi2.ppf([0.975, 0.025], 2000)
    expected = np.sqrt(np.sum(errors**2) / np.array([low, high]))
    assert (found.low, found.high) == pytest.approx(tuple(expected), rel=5e-3)


def test_poisson_counts_have_garwoods_interval():
    counts = np.random.default_rng(3).poisson(0.8, size=500).astype(float)
    found, total = mean_count(counts), counts.sum()
    expected = stats.chi2.ppf([0.025, 0.975], [2 * total, 2 * total + 2]) / 2 / 500
    assert (found.low, found.high) == pytest.approx(tuple(expected), rel=0.03)


def test_a_single_trial_does_not_tell_how_ghosts_cluster():
    """Poisson limits of one count hold a mean of counts that vary between trials hardly ever."""
    one = mean_count(np.array([99.0]))
    assert (one.value, math.isnan(one.low), math.isnan(one.high)) == (99.0, True, True)
    none = mean_count(np.zeros(1))
    assert (none.low, none.high) == pytest.approx((0.0, -math.log(0.025)))
    rng = np.random.default_rng(6)
    pairs = rng.poisson(rng.uniform(40.0, 150.0, size=(1000, 2))).astype(float)
    found = [mean_count(pair) for pair in pairs]
    assert np.mean([each.low <= 95.0 <= each.high for each in found]) > 0.92


def test_what_both_variants_share_cancels_in_their_difference():
    """Paired draws tell a difference that independent ones could not."""
    rng = np.random.default_rng(4)
    hard = rng.uniform(size=(200, 5))
    seen = np.full(200, 5.0)
    first, second = (hard < 0.6).sum(1).astype(float), (hard < 0.55).sum(1).astype(float)
    paired = ratio_difference((first, seen), (second, seen))
    apart = ratio_difference((first, seen), (rng.permutation(second), seen))
    assert paired.value == pytest.approx(apart.value)
    assert paired.half_width < 0.6 * apart.half_width
    assert paired.low > 0.0


def test_variants_that_never_differ_may_still_differ_rarely():
    found, seen = np.full(100, 4.0), np.full(100, 5.0)
    same = ratio_difference((found, seen), (found, seen))
    assert same.value == 0.0
    # a chance of 3.6 % shows nothing in 100 trials once in 40 times
    assert same.high == pytest.approx(1 - 0.025 ** (1 / 100))


@pytest.mark.parametrize("trials", [3, 7, 20, 100])
def test_variants_that_always_differ_alike_do_so_whatever_rounding_says(trials):
    """One target of ten more in every trial: ±(1 − 0.025^(1/n)) about 0.1."""
    found = np.random.default_rng(trials).integers(1, 11, trials).astype(float)
    seen = np.full(trials, 10.0)
    more = ratio_difference((found, seen), (found - 1.0, seen))
    assert more.value == pytest.approx(0.1)
    assert more.half_width == pytest.approx(1 - 0.025 ** (1 / trials))


@pytest.mark.parametrize("trials", [50, 5000])
def test_the_difference_of_a_mean_is_students_with_two_more_trials(trials):
    rng = np.random.default_rng(6)
    one, two, ones = rng.poisson(2.0, trials), rng.poisson(1.0, trials), np.ones(trials)
    found = ratio_difference((one, ones), (two, ones))
    expected = stats.ttest_rel(one, two).confidence_interval(0.95)
    assert found.low + found.high == pytest.approx(expected.low + expected.high)
    wider = found.half_width / (0.5 * (expected.high - expected.low))
    # the typical difference has the kurtosis of the differences, about 3, as its variance
    kurtosis = stats.kurtosis(one - two, fisher=False)
    assert wider == pytest.approx(math.sqrt(1 + 2 * kurtosis * (trials - 1) / trials**2))


@pytest.mark.slow
@pytest.mark.parametrize("trials", [20, 100])
@pytest.mark.parametrize("probability", [0.5, 0.9, 0.98])
@pytest.mark.parametrize("kinship", [0.0, 0.3, 0.9])
def test_the_interval_of_a_detection_probability_holds_it(trials, probability, kinship):
    """Targets of a trial succeed by a chance that they share (beta-binomial)."""

    def experiment(rng):
        counts = rng.integers(1, 9, size=trials)
        chance = np.full(trials, probability)
        if kinship:
            total = 1 / kinship - 1
            chance = rng.beta(probability * total, (1 - probability) * total, size=trials)
        return proportion(rng.binomial(counts, chance).astype(float), counts.astype(float))

    assert coverage(probability, experiment) >= 0.935


@pytest.mark.slow
def test_an_interval_that_ignores_kinship_does_not_hold():
    def experiment(rng):
        chance = rng.beta(0.5, 0.5, size=100)
        return wilson(rng.binomial(5, chance).sum() / 500, 500)

    assert coverage(0.5, experiment) < 0.85


@pytest.mark.slow
@pytest.mark.parametrize("trials", [20, 100])
@pytest.mark.parametrize("mean", [0.02, 0.5, 3.0])
@pytest.mark.parametrize("law", ["poisson", "overdispersed", "at most one"])
def test_the_interval_of_a_mean_count_holds_it(trials, mean, law):
    def experiment(rng):
        if law == "poisson":
            counts = rng.poisson(mean, trials)
        elif law == "overdispersed":
            counts = rng.poisson(mean * rng.gamma(2.0, 0.5, trials))
        else:
            counts = int(mean) + (rng.uniform(size=trials) < mean - int(mean))
        return mean_count(counts.astype(float))

    assert coverage(mean, experiment) >= 0.925


@pytest.mark.slow
@pytest.mark.parametrize("trials", [20, 100])
@pytest.mark.parametrize("kinship", [0.0, 0.8])
def test_the_interval_of_an_rms_error_holds_it(trials, kinship):
    """Errors of a trial are normal, and share a part."""

    def experiment(rng):
        counts = rng.integers(1, 6, size=trials)
        own, common = rng.normal(size=(trials, 5)), rng.normal(size=(trials, 1))
        errors = math.sqrt(1 - kinship) * own + math.sqrt(kinship) * common
        used = np.arange(5) < counts[:, None]
        return rms(np.sum(np.where(used, errors**2, 0.0), axis=1), counts.astype(float))

    assert coverage(1.0, experiment) >= (0.895 if trials == 20 else 0.93)


@pytest.mark.slow
@pytest.mark.parametrize("trials", [20, 100])
def test_the_intervals_of_paired_differences_hold_them(trials):
    def probabilities(rng):
        hard = 0.6 * rng.uniform(size=(trials, 4)) + 0.4 * rng.uniform(size=(trials, 1))
        seen = np.full(trials, 4.0)
        better, worse = (hard < 0.6).sum(1), (hard < 0.5).sum(1)
        return ratio_difference((better.astype(float), seen), (worse.astype(float), seen))

    def errors(rng):
        common = rng.normal(size=trials)
        one = common + 0.5 * rng.normal(size=trials)
        two = common + 0.2 * rng.normal(size=trials)
        return rms_difference((one**2, np.ones(trials)), (two**2, np.ones(trials)))

    # P(0.6 u + 0.4 v < x) for x between 0.4 and 0.6 is (x − 0.2)/0.6
    assert coverage(0.1 / 0.6, probabilities) >= 0.925
    assert coverage(math.sqrt(1.25) - math.sqrt(1.04), errors) >= 0.915


@pytest.mark.slow
@pytest.mark.parametrize("trials", [100, 200])
@pytest.mark.parametrize("rarity", [0.03, 0.1, 0.5])
def test_the_interval_of_a_difference_holds_it_where_few_trials_differ(trials, rarity):
    """One variant finds one target more in few of the trials, and never one less."""
    seen = np.full(trials, 5.0)

    def experiment(rng):
        found = rng.binomial(4, 0.7, trials).astype(float)
        return ratio_difference((found + (rng.uniform(size=trials) < rarity), seen), (found, seen))

    assert coverage(rarity / 5.0, experiment) >= 0.93
