"""Interference of all radars of a road, against the numbers of the sources and against draws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.special import erfc

from polychirp.scoring.closed_forms.access import (
    best_density,
    hop_gain,
    slotted_density,
    targets_where_hopping_wins,
    undisturbed_density,
)
from polychirp.scoring.closed_forms.roads import (
    BEST_LOAD,
    best_duty,
    hard_core_density,
    interference_below,
    mean_of_lane,
    mean_of_lane_in_lobes,
    success,
)

LANE = {"density": 1 / 30, "offset": 3.5, "opening": math.radians(30.0)}
ECHO = {"distance": 30.0, "cross_section": 10.0, "gain": 1e5, "least_ratio": 10.0}


def places(draw, *, density, length, count):
    """Poisson places from 0 to a length, m, a row for each of ``count`` roads; NaN is no place."""
    number = draw.poisson(density * length, count)
    place = draw.uniform(0.0, length, (count, number.max()))
    return np.where(np.arange(number.max()) < number[:, None], place, np.nan)


def test_the_mean_of_a_lane_is_that_of_its_source_and_of_draws(compare):
    expected, tolerance = 0.00252, 4 * 2e-5
    x = places(np.random.default_rng(1), density=1 / 30, length=3000.0, count=20_000)
    angle = np.arctan2(3.5, x)
    inside = np.where(angle <= math.radians(15.0), 1 / (x**2 + 3.5**2), 0.0)
    drawn = np.nansum(inside, axis=1)
    form = mean_of_lane(1.0, **LANE)
    assert form == pytest.approx(np.mean(drawn), abs=4 * np.std(drawn) / np.sqrt(len(drawn)))
    compare(
        page="closed-forms",
        case="one radar in 30 m, lane at 3.5 m, 30°",
        quantity="sum of 1/r², 1/m²",
        expected=expected,
        measured=form,
        tolerance=tolerance,
        source="Aydogdu et al. 2020, drawn",
    )


def test_gaussian_lobes_weight_the_lane_as_drawn():
    beamwidth = math.radians(20.0)
    x = places(np.random.default_rng(2), density=1 / 30, length=3000.0, count=20_000)
    angle = np.arctan2(3.5, x)
    both = 0.5 ** (2.0 * (2.0 * angle / beamwidth) ** 2)  # half at half the width, at both ends
    drawn = np.nansum(np.where(angle <= 0.5 * LANE["opening"], both / (x**2 + 3.5**2), 0.0), axis=1)
    form = mean_of_lane_in_lobes(1.0, beamwidth=beamwidth, **LANE)
    assert form == pytest.approx(np.mean(drawn), abs=4 * np.std(drawn) / np.sqrt(len(drawn)))


def test_kept_vehicles_are_as_many_as_drawn():
    """A Poisson point with a random mark is kept if no point within the gap has a smaller one."""
    draw, density, gap, length = np.random.default_rng(3), 0.1, 6.0, 20_000.0
    kept = 0
    for _ in range(40):
        x = np.sort(draw.uniform(0.0, length, draw.poisson(density * length)))
        mark = draw.uniform(size=x.size)
        first, last = np.searchsorted(x, x - gap), np.searchsorted(x, x + gap, side="right")
        kept += sum(mark[a:b].min() == m for a, b, m in zip(first, last, mark, strict=True))
    drawn = kept / (40 * length)
    form = hard_core_density(density, gap=gap)
    assert form == pytest.approx(drawn, abs=4 * np.sqrt(kept) / (40 * length))


STATED = {1e-4: 0.0122, 3e-4: 0.1478, 1e-3: 0.4280, 3e-3: 0.6472}
DRAWN_IN_SOURCE = {1e-4: 0.0132, 3e-4: 0.1487, 1e-3: 0.4298, 3e-3: 0.6473}


@pytest.mark.parametrize("level", STATED)
def test_the_distribution_is_that_of_its_source_and_of_draws(level, compare):
    x = places(np.random.default_rng(4), density=0.02, length=20_000.0, count=10_000)
    drawn = np.mean(np.nansum(1 / x**2, axis=1) <= level)
    form = float(interference_below(level, power=1.0, density=0.02))
    # the rest of the line beyond 20 km adds 1e-6 W in the mean
    assert form == pytest.approx(drawn, abs=4 * 0.5 / np.sqrt(10_000))
    compare(
        page="closed-forms",
        case=f"density 0.02, level {level:g}",
        quantity="probability that the interference of a line is below a level",
        expected=STATED[level],
        measured=form,
        tolerance=5e-5,
        source="Al-Hourani et al. 2018",
    )
    assert DRAWN_IN_SOURCE[level] == pytest.approx(form, abs=3e-3)


def test_two_lines_are_one_of_the_sum_of_their_densities():
    draw = np.random.default_rng(6)
    x, y = (places(draw, density=d, length=20_000.0, count=10_000) for d in (0.01, 0.03))
    drawn = np.mean(np.nansum(1 / x**2, axis=1) + np.nansum(1 / y**2, axis=1) <= 3e-3)
    form = interference_below(3e-3, power=1.0, density=0.04)
    assert float(form) == pytest.approx(drawn, abs=0.02)


def test_an_echo_succeeds_as_often_as_drawn():
    x = places(np.random.default_rng(5), density=0.02, length=20_000.0, count=10_000)
    echo = ECHO["gain"] * ECHO["cross_section"] / (4 * np.pi * ECHO["distance"] ** 4)
    drawn = np.mean(echo / np.nansum(1 / x**2, axis=1) >= ECHO["least_ratio"])
    assert success(density=0.02, **ECHO) == pytest.approx(drawn, abs=0.02)


def test_the_best_duty_maximises_the_number_of_echoes_that_succeed():
    best = minimize_scalar(
        lambda duty: -duty * success(density=0.2 * duty, **ECHO), bounds=(0.0, 1.0)
    )
    assert best_duty(density=0.2, **ECHO) == pytest.approx(best.x, abs=1e-4)
    assert best_duty(density=0.02, **ECHO) == 1.0
    root = 2.0 * BEST_LOAD * math.exp(-(BEST_LOAD**2)) / math.sqrt(math.pi)
    assert float(erfc(BEST_LOAD)) == pytest.approx(root, rel=1e-6)
    assert round(BEST_LOAD, 4) == 0.5316


def test_radars_are_undisturbed_as_often_as_drawn():
    """Others within ± d start uniformly in a period and in one of M bands; one is too many."""
    draw, bands = np.random.default_rng(7), 3
    density, reach, window, period = 1.5, 100.0, 0.2e-6, 20e-6
    number = draw.poisson(2 * density * reach, 20_000)
    is_clean = [
        not np.any((draw.uniform(0, period, n) < window) & (draw.integers(bands, size=n) == 0))
        for n in number
    ]
    rest = {"reach": reach, "window": window, "period": period, "gain": bands}
    form = undisturbed_density(density, **rest)
    assert form == pytest.approx(density * np.mean(is_clean), abs=4 * density * 0.5 / 141)
    best = minimize_scalar(lambda d: -undisturbed_density(d, **rest), bounds=(0.1, 10.0))
    assert best_density(**rest) == pytest.approx(best.x, rel=1e-3)
    assert undisturbed_density(best.x, **rest) == pytest.approx(best.x / math.e, rel=1e-6)


def test_a_hop_disturbs_a_target_as_often_as_drawn():
    draw = np.random.default_rng(8)
    targets, beat = draw.integers(64, size=(40_000, 10)), draw.integers(64, size=40_000)
    drawn = np.mean(np.any(targets == beat[:, None], axis=1))
    assert 1 / hop_gain(num_bins=64, num_targets=10) == pytest.approx(drawn, abs=0.008)


def test_hopping_and_bands_are_equal_where_the_form_says():
    count = targets_where_hopping_wins(num_bins=256, num_bands=4)
    fewer = hop_gain(num_bins=256, num_targets=math.floor(count))
    more = hop_gain(num_bins=256, num_targets=math.ceil(count))
    assert more < 4.0 < fewer


def test_slots_hold_as_many_radars_as_fit_into_a_chirp():
    """Both directions of a road of the length 2d share the slots of one chirp."""
    slot = 10e6 / 1e13 + 100.0 / 299_792_458.0
    assert slotted_density(
        bandwidth=200e6, if_band=10e6, slope=1e13, reach=100.0, num_bands=2
    ) == pytest.approx(2 * (200e6 / 1e13 / slot) / 200.0)
