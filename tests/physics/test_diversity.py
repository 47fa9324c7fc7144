"""How well waveforms of different diversity keep two radars apart, against theory."""

from __future__ import annotations

import numpy as np
import pytest

from polychirp.model.radar import Radar
from polychirp.rng import Streams
from polychirp.units import to_db
from polychirp.waveform import DiverseTriangular, Sawtooth, Triangular
from tools.experiments.diversity import (
    FAMILIES,
    IN_BAND,
    ambiguity,
    compare_families,
    law,
    measured,
    spread_time,
)

EQUAL = Triangular().schedule(num_sweeps=4, streams=Streams(1))


def test_a_radar_in_step_with_equal_ramps_makes_a_whole_ghost() -> None:
    _, peak, per_sweep, duty = measured(EQUAL, EQUAL)
    assert peak == pytest.approx(1.0, rel=1e-6)  # the fit's ridge is 1e-7
    assert per_sweep == pytest.approx(1.0, rel=1e-9)
    assert duty == 1.0


def test_diverse_ramps_leave_of_a_ghost_what_the_product_of_bandwidth_and_time_allows() -> None:
    """The mean over cells stays at 1/(B T_frame): 2 dB of room for pulses that miss the band."""
    name = "T and B at every triangle (the paper)"
    (row,) = compare_families({name: FAMILIES[name]}, num_sweeps=8, num_draws=6)
    assert to_db(row.matched_mean / row.law) == pytest.approx(0.0, abs=2.0)


def test_adding_only_loud_samples_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    plans = [DiverseTriangular().schedule(num_sweeps=2, streams=Streams(seed)) for seed in (1, 2)]
    sparse = measured(plans[0], plans[1])
    monkeypatch.setattr("tools.experiments.diversity.FEW_SAMPLES", -1.0)
    assert measured(plans[0], plans[1]) == pytest.approx(sparse, rel=1e-3)


def test_the_law_counts_all_ramps() -> None:
    assert law(EQUAL) == pytest.approx(1.0 / (8 * 900e6 * 1.5e-3))


def test_equal_ramps_apart_by_more_than_the_band_are_not_heard() -> None:
    (row,) = compare_families(
        {"apart": FAMILIES["equal ramps starting together, 2 MHz apart"]}, num_sweeps=2, num_draws=1
    )
    assert row.matched_peak < 1e-10
    assert row.duty == 0.0


def test_a_slow_crossing_lasts_as_long_as_the_band_is_wide() -> None:
    """Slopes that differ by 10 GHz/s: the beat is in the band for its width over that."""
    first = Sawtooth().schedule(num_sweeps=1, streams=Streams(1))
    other = Sawtooth(start_frequency=79.001e9, bandwidth=885e6)
    second = other.schedule(num_sweeps=1, streams=Streams(1))
    *_, duty = measured(first, second)
    frequency = np.linspace(0.0, 1e6, 10_001)
    passed = np.abs(Radar(name="r").if_filter.response(frequency))
    half = frequency[np.argmax(passed < IN_BAND)]
    assert duty == pytest.approx(2 * half / 1e10 / 1.48e-3, rel=0.03)


@pytest.mark.slow
def test_more_spread_suppresses_more_until_it_saturates() -> None:
    pairs = {f"{spread:g}": spread_time(spread) for spread in (1e-4, 1e-2, 0.3)}
    rows = compare_families(pairs, num_sweeps=8, num_draws=4)
    strongest = [float(to_db(row.matched_peak)) for row in rows]
    assert strongest[0] > strongest[1] + 10 > strongest[2] + 10


@pytest.mark.slow
def test_diverse_ramp_times_lower_the_side_lobes_in_speed() -> None:
    equal = ambiguity(Triangular().schedule(num_sweeps=16, streams=Streams(1)))
    diverse = ambiguity(DiverseTriangular().schedule(num_sweeps=16, streams=Streams(1)))
    assert np.all(to_db(diverse) < to_db(equal) - 3.0)


def test_the_first_side_lobe_of_equal_triangles_is_half_the_energy_and_a_sinc() -> None:
    """At v = λ/2T_triangle all up-ramps agree, and all down-ramps, but not with each other."""
    slow, _ = ambiguity(Triangular().schedule(num_sweeps=16, streams=Streams(1)))
    assert to_db(slow) == pytest.approx(-6.0, abs=1.0)


@pytest.mark.slow
def test_suppression_agrees_with_what_others_measured() -> None:
    """Sixteen triangles, ±1e-3 and ±1e-2 of T: 46 and 58 dB in the strongest cell."""
    pairs = {f"{spread:g}": spread_time(spread) for spread in (1e-3, 1e-2)}
    thousandth, hundredth = compare_families(pairs, num_draws=8)
    assert -to_db(thousandth.matched_peak) == pytest.approx(46.0, abs=3.5)
    assert -to_db(hundredth.matched_peak) == pytest.approx(58.0, abs=3.5)
