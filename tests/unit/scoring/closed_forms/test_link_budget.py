"""Link budgets, against the numbers of their sources."""

from __future__ import annotations

import math

import pytest

from polychirp.scoring.closed_forms.link_budget import (
    echo_power,
    greatest_range,
    interference_to_noise,
    interferer_power,
    range_at_interferer,
    range_beside_interferer,
    share_in_band,
    signal_to_interference,
    slope_factor,
)
from polychirp.scoring.closed_forms.overlap import parallel
from polychirp.units import from_db, to_db

ALLAND = "Alland et al. 2019"
TARGET = {"cross_section": 10.0, "gain": 1e5}
"""10 dBsm, and 50 dB of processing gain."""

RANGES = {
    "the target carries the interferer": (range_at_interferer(10.0, **TARGET), 89.2, 0.05),
    "an interferer at 10 m": (
        range_beside_interferer(10.0, interferer_distance=10.0, **TARGET),
        *(29.87, 5e-3),
    ),
    "end of the IF band, 300 MHz in 30 µs, 15 MHz": (
        greatest_range(duration=30e-6, bandwidth=300e6, if_band=15e6),
        *(225.0, 0.5),
    ),
    "end of the IF band, 750 MHz in 50 µs, 4.5 MHz": (
        greatest_range(duration=50e-6, bandwidth=750e6, if_band=4.5e6),
        *(45.0, 0.1),
    ),
}
FACTORS = {
    "equal centres, opposite slopes": (2 * slope_factor(own_slope=1, other_slope=-1), 1.0),
    "equal centres, slopes as 5 to 6": (2 * slope_factor(own_slope=6, other_slope=5), 10.0),
}
TABLE = {
    (77e9, 0.01): (24, 10, 4),
    (77e9, 0.1): (34, 20, 14),
    (60e9, 0.01): (26, 12, 6),
    (60e9, 0.1): (36, 22, 16),
}
"""dB of interference over noise at 1, 5 and 10 m, for a frequency and a share of the time."""


@pytest.mark.parametrize("case", RANGES)
def test_a_range_is_that_of_its_source(case, compare):
    measured, expected, tolerance = RANGES[case]
    compare(
        page="closed-forms",
        case=case,
        quantity="range, m",
        expected=expected,
        measured=measured,
        tolerance=tolerance,
        source=ALLAND,
    )


@pytest.mark.parametrize("case", FACTORS)
def test_a_factor_is_that_of_its_source(case, compare):
    measured, expected = FACTORS[case]
    compare(
        page="closed-forms",
        case=case,
        quantity="factor K on the density of an interferer, real samples",
        expected=expected,
        measured=measured,
        tolerance=1e-9,
        source=ALLAND,
    )


@pytest.mark.parametrize(("frequency", "share"), TABLE)
def test_all_entries_of_the_table_follow_from_ten_megahertz(frequency, share, compare):
    for distance, expected in zip((1.0, 5.0, 10.0), TABLE[frequency, share], strict=True):
        ratio = share_in_band(
            power=0.01,
            gain=from_db(14.0),
            frequency=frequency,
            distance=distance,
            share=share,
            noise_figure=from_db(14.0),
            band=10e6,
        )
        compare(
            page="closed-forms",
            case=f"{frequency / 1e9:g} GHz, {distance:g} m, {100 * share:g} % of the time",
            quantity="interference over noise, dB",
            expected=expected,
            measured=float(to_db(ratio)),
            tolerance=0.5,
            source="SWRA662A, table 2-1",
        )


def test_the_ratio_of_both_powers_is_the_ratio_in_closed_form():
    link = {"power": 0.02, "gain": 300.0, "wavelength": 3.9e-3}
    echo = echo_power(cross_section=4.0, distance=35.0, **link)
    other = interferer_power(distance=60.0, **link)
    ratio = signal_to_interference(cross_section=4.0, distance=35.0, interferer_distance=60.0)
    assert echo / other == pytest.approx(ratio)
    limit = range_beside_interferer(ratio, cross_section=4.0, interferer_distance=60.0, gain=1.0)
    assert limit == pytest.approx(35.0)
    at = range_at_interferer(2.0, cross_section=4.0, gain=1e4)
    same = signal_to_interference(cross_section=4.0, distance=at, interferer_distance=at, gain=1e4)
    assert same == pytest.approx(2.0)


def test_one_chirp_of_512_is_two_thousandths_of_the_density():
    rest = {"power": 1e-10, "bandwidth": 1e9, "factor": 10.0, "noise_figure": 10.0}
    share = interference_to_noise(share=1 / 512, **rest) / interference_to_noise(**rest)
    assert share == pytest.approx(0.002, abs=5e-5)
    ten = interference_to_noise(**rest) / interference_to_noise(**{**rest, "factor": 1.0})
    assert to_db(ten) == pytest.approx(10.0)


def test_ten_parallel_radars_of_the_report_are_in_the_band_for_a_hundredth_of_the_time():
    """20 m, 100 µs: 1.3 %, the share with which the report then reads its table."""
    share = parallel(greatest_delay=2 * 20.0 / 3e8, duration=1e-4, number=10)
    assert math.isclose(share, 0.013, rel_tol=0.03)
