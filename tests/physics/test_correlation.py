"""Correlation and ambiguity of chirps, against theory, and fast routes against slow ones."""

import math

import numpy as np
import pytest

from polychirp.correlation.ambiguity import ambiguity
from polychirp.correlation.base import correlate
from polychirp.correlation.lobes import lobes
from polychirp.correlation.theory import (
    BOTH_ENDS_OVERSHOOT,
    OVERSHOOT,
    crossing_peak,
    disjoint_peak,
    expected,
    opposite_peak,
)
from polychirp.model.baseband import Baseband
from polychirp.rng import Streams
from polychirp.units import to_db
from polychirp.waveform import DiverseTriangular, Sawtooth, Triangular
from polychirp.waveform.playing import played
from tests.support.references.correlation import plain_correlate

SINC_WIDTH = 0.885893
"""Full width of sinc² at half its height."""

SIDE_LOBE = 0.0471904
"""Power of the first side lobe of a sinc, −13.26 dB."""

SIDE_LOBE_ENERGY = 0.107541
"""Energy of sinc² outside its main lobe over the energy inside, −9.68 dB."""

CARRIER = 4e9
TIME = 100e-6
RATE = 130e6


def ramp(bandwidth, duration=TIME, *, carrier=CARRIER, direction="up"):
    chirp = Sawtooth(
        start_frequency=carrier - bandwidth / 2,
        bandwidth=bandwidth,
        ramp_duration=duration,
        direction=direction,
    )
    return chirp.schedule(num_sweeps=1, streams=Streams(seed=1))


def samples(plan, rate=RATE, carrier=CARRIER):
    return played(plan, sample_rate=rate, centre_frequency=carrier)


def noise(count, seed):
    draw = np.random.default_rng(seed).standard_normal((count, 2)).view(complex)[:, 0]
    return Baseband(samples=draw, sample_rate=1e6)


def quadrature(a, b, lag):
    """The normalised integral over a million points, with no Fresnel function."""
    begin = max(a.start_time[0] - lag, b.start_time[0])
    end = min(a.end_time[0] - lag, b.end_time[0])
    count = 1_000_000
    t = begin + (np.arange(count) + 0.5) * (end - begin) / count
    turns = [
        plan.start_frequency[0] * u + 0.5 * plan.slope[0] * u**2
        for plan, u in ((a, t + lag - a.start_time[0]), (b, t - b.start_time[0]))
    ]
    total = np.exp(2j * np.pi * ((turns[0] - turns[1]) % 1.0)).mean() * (end - begin)
    return total / math.sqrt(a.duration[0] * b.duration[0])


# ── on one scale ──────────────────────────────────────────────────────────────


def test_transforms_give_what_the_definition_gives():
    a, b = noise(301, 1), noise(77, 2)
    fast, slow = correlate(a, b), plain_correlate(a, b)
    np.testing.assert_allclose(fast.lag, slow.lag, rtol=0, atol=1e-15)
    np.testing.assert_allclose(fast.amplitude, slow.amplitude, rtol=0, atol=1e-14)


@pytest.mark.parametrize("oversampling", [2, 5, 16])
def test_finer_lags_go_through_the_coarse_ones(oversampling):
    a, b = noise(200, 1), noise(120, 2)
    fine, coarse = correlate(a, b, oversampling=oversampling), correlate(a, b)
    np.testing.assert_allclose(fine.amplitude[::oversampling], coarse.amplitude, atol=1e-14)
    np.testing.assert_allclose(fine.lag[::oversampling], coarse.lag, rtol=0, atol=1e-15)


def test_a_signal_with_itself_has_a_peak_of_one_and_none_exceeds_it():
    a, b = noise(500, 1), noise(400, 2)
    assert lobes(correlate(a, a)).peak == pytest.approx(1.0, abs=1e-12)
    assert np.abs(correlate(a, b, oversampling=4).amplitude).max() < 1.0


def test_a_signal_that_is_later_has_a_positive_lag():
    a = noise(100, 1)
    late = Baseband(samples=np.concatenate([np.zeros(30), a.samples]), sample_rate=1e6)
    assert lobes(correlate(late, a)).lag == pytest.approx(30e-6, abs=1e-9)
    assert lobes(correlate(a, late)).lag == pytest.approx(-30e-6, abs=1e-9)


# ── one ramp with itself ──────────────────────────────────────────────────────


@pytest.mark.parametrize("bandwidth", [50e6, 100e6])
@pytest.mark.parametrize("duration", [100e-6, 1e-3])
def test_a_ramp_has_the_lobes_of_a_sinc(bandwidth, duration, compare):
    """|R| = (1 − |τ|/T) sinc(Bτ(1 − |τ|/T)): 0.886/B, −13.26 dB, −9.68 dB for large BT."""
    plan = ramp(bandwidth, duration)
    found = lobes(correlate(samples(plan), samples(plan), oversampling=8))
    case = f"{bandwidth / 1e6:g} MHz in {duration * 1e6:g} µs"
    row = {"page": "correlation", "case": case, "source": "sinc², large BT"}
    compare(
        quantity="width of the auto-correlation, ns",
        expected=SINC_WIDTH / bandwidth * 1e9,
        measured=found.width * 1e9,
        tolerance=0.005,
        **row,
    )
    compare(
        quantity="peak side lobe, dB",
        expected=float(to_db(SIDE_LOBE)),
        measured=float(to_db(found.peak_side_lobe)),
        tolerance=0.05,
        **row,
    )
    compare(
        quantity="integrated side lobes, dB",
        expected=float(to_db(SIDE_LOBE_ENERGY)),
        measured=float(to_db(found.integrated_side_lobe)),
        tolerance=0.05,
        **row,
    )


def test_a_ramp_with_itself_is_the_formula_of_books():
    """Klauder et al. 1960: (1 − |τ|/T) sinc(Bτ(1 − |τ|/T)), here to rounding."""
    plan = ramp(100e6)
    lag = np.linspace(-TIME, TIME, 20_001)
    rest = 1.0 - np.abs(lag) / TIME
    formula = np.abs(rest * np.sinc(100e6 * lag * rest))
    np.testing.assert_allclose(np.abs(expected(plan, plan, lag).amplitude), formula, atol=2e-9)


def test_samples_of_a_ramp_follow_the_closed_form():
    """What 130 MS/s fold of a chirp of 100 MHz is 80 dB down."""
    plan = ramp(100e6)
    found = correlate(samples(plan), samples(plan), oversampling=8)
    closed = expected(plan, plan, found.lag)
    assert np.abs(np.abs(found.amplitude) - np.abs(closed.amplitude)).max() < 3e-4


# ── two ramps ─────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("lag", [0.0, 7.3e-6, -31.1e-6, 60e-6])
@pytest.mark.parametrize(
    ("bandwidth", "duration", "direction"),
    [(120e6, 100e-6, "up"), (100e6, 120e-6, "up"), (100e6, 100e-6, "down"), (80e6, 70e-6, "up")],
)
def test_the_closed_form_is_the_integral(bandwidth, duration, direction, lag):
    """About a carrier of 60 MHz, where a million points resolve the phase (midpoint rule)."""
    a = ramp(bandwidth, duration, carrier=60.1e6, direction=direction)
    b = ramp(100e6, carrier=60.1e6)
    closed = expected(a, b, np.array([lag - 1e-9, lag, lag + 1e-9])).amplitude[1]
    assert abs(closed - quadrature(a, b, lag)) < 1e-6


@pytest.mark.parametrize("difference", [1e-3, 0.02, 0.3, 3.0])
def test_nearly_equal_slopes_lose_no_digits(difference):
    """``difference`` cycles of bend over the whole ramp: between sinc and Fresnel."""
    a, b = ramp(100e6, carrier=60.1e6), ramp(100e6 + difference / TIME, carrier=60.1e6)
    closed = expected(b, a, np.array([0.0, 3.3e-9, 6.6e-9])).amplitude[1]
    assert abs(closed - quadrature(b, a, 3.3e-9)) < 3e-5


@pytest.mark.parametrize("difference", [2e6, 5e6, 10e6, 20e6, 40e6, 60e6, 80e6])
@pytest.mark.parametrize("duration", [100e-6, 1e-3])
def test_crossing_ramps_follow_the_time_bandwidth_law(difference, duration, compare):
    """−10 log₁₀(|ΔB| T) + 1.37 dB: ripples of the far end are left out, 1/(π√(2·ΔBT)) of it."""
    a, b = ramp(100e6, duration), ramp(100e6 - difference, duration)
    slopes = 100e6 / duration, (100e6 - difference) / duration
    found = lobes(correlate(samples(b), samples(a), oversampling=4))
    compare(
        page="correlation",
        case=f"|ΔB| {difference / 1e6:g} MHz, T {duration * 1e6:g} µs",
        quantity="peak of crossing ramps, dB",
        expected=float(to_db(crossing_peak(*slopes, duration, duration))),
        measured=float(to_db(found.peak**2)),
        tolerance=0.15,
        source="stationary phase, Fresnel overshoot",
    )


def test_the_overshoots_are_those_of_cornus_spiral():
    """|F(x) − F(−∞)|²/2 and 2|F(x)|², by a sum over the spiral."""
    x = np.linspace(0.0, 6.0, 2_000_001)
    spiral = np.cumsum(np.exp(0.5j * np.pi * (x[:-1] + 0.5 * x[1]) ** 2)) * x[1]
    one = np.abs(spiral + 0.5 + 0.5j) ** 2 / 2
    assert one.max() == pytest.approx(OVERSHOOT, abs=1e-5)
    assert 2 * (np.abs(spiral) ** 2).max() == pytest.approx(BOTH_ENDS_OVERSHOOT, abs=1e-5)


def test_opposite_slopes_overshoot_at_both_ends(compare):
    up, down = ramp(100e6), ramp(100e6, direction="down")
    compare(
        page="correlation",
        case="opposite slopes, 100 MHz, 100 µs",
        quantity="peak of crossing ramps, dB",
        expected=float(to_db(opposite_peak(1e12, TIME, TIME))),
        measured=float(
            to_db(lobes(correlate(samples(down), samples(up), oversampling=4)).peak ** 2)
        ),
        tolerance=0.15,
        source="stationary phase, both ends",
    )


def test_bands_that_share_nothing_stay_below_the_bound_of_their_ends(compare):
    """The paper's second case at radio frequency: 140 MHz between the bands."""
    a, b = ramp(120e6, carrier=3.75e9), ramp(100e6)
    lag = np.linspace(-TIME, TIME, 400_001)
    highest = lobes(expected(a, b, lag)).peak ** 2
    bound = disjoint_peak(140e6, TIME, TIME)
    compare(
        page="correlation",
        case="120 MHz at 3.75 GHz, 100 MHz at 4 GHz, 100 µs",
        quantity="peak of disjoint ramps, dB",
        expected=float(to_db(bound)),
        measured=float(to_db(highest)),
        tolerance=0.2,
        source="ends of the integral, 1/πΔf√(TaTb)",
    )
    assert highest <= bound * 1.001


@pytest.mark.parametrize(
    "waveform",
    [
        Triangular(start_frequency=3.95e9, bandwidth=100e6, ramp_duration=20e-6),
        DiverseTriangular(
            start_frequency=3.95e9, bandwidth=(60e6, 100e6), ramp_duration=(10e-6, 20e-6)
        ),
    ],
    ids=["triangles", "diverse"],
)
def test_schedules_of_many_ramps_add_their_pairs_in_phase(waveform):
    """Closed form against samples; what is folded is 1/(bandwidth · time of a ramp)."""
    a, b = (waveform.schedule(num_sweeps=3, streams=Streams(seed)) for seed in (1, 2))
    found = correlate(samples(a, 520e6), samples(b, 520e6))
    closed = expected(a, b, found.lag)
    assert np.abs(np.abs(found.amplitude) - np.abs(closed.amplitude)).max() < 5e-4


# ── ambiguity ─────────────────────────────────────────────────────────────────


def test_without_doppler_the_ambiguity_function_is_the_correlation(monkeypatch):
    """Also where the second signal is cut into many blocks."""
    monkeypatch.setattr("polychirp.correlation.ambiguity.LEAST_BLOCK", 64)
    a, b = noise(700, 1), noise(500, 2)
    found = ambiguity(a, b, doppler=np.array([0.0]), greatest_lag=20e-6)
    whole = correlate(a, b).within(20e-6)
    np.testing.assert_allclose(found.lag, whole.lag, atol=1e-12)
    np.testing.assert_allclose(found.amplitude[0], whole.amplitude, atol=1e-13)


def test_lags_count_from_both_signals_start_times():
    """Signals that start 100 and 130 µs late overlap around lag −30 µs of their first samples."""
    a = Baseband(samples=noise(300, 1).samples, sample_rate=1e6, start_time=100e-6)
    b = Baseband(samples=noise(200, 2).samples, sample_rate=1e6, start_time=130e-6)
    found = ambiguity(a, b, doppler=np.array([0.0]), greatest_lag=15e-6)
    whole = correlate(a, b).within(15e-6)
    np.testing.assert_allclose(found.lag, whole.lag, atol=1e-12)
    np.testing.assert_allclose(found.amplitude[0], whole.amplitude, atol=1e-13)


def test_a_shifted_signal_peaks_at_its_doppler_and_delay(monkeypatch):
    monkeypatch.setattr("polychirp.correlation.ambiguity.LEAST_BLOCK", 100)
    b = noise(1000, 3)
    turned = b.samples * np.exp(2j * np.pi * 2e3 * b.time)
    a = Baseband(samples=np.concatenate([np.zeros(7), turned]), sample_rate=1e6)
    found = ambiguity(a, b, doppler=np.arange(-5e3, 5.1e3, 1e3), greatest_lag=20e-6)
    row, column = np.unravel_index(np.argmax(np.abs(found.amplitude)), found.amplitude.shape)
    assert (found.doppler[row], found.lag[column]) == pytest.approx((2e3, 7e-6))
    assert abs(found.amplitude[row, column]) == pytest.approx(1.0, abs=1e-9)


def test_a_ramp_trades_doppler_for_delay():
    """The ridge ν = slope · τ has height 1 − |ν|/B (Klauder et al. 1960)."""
    signal = samples(ramp(100e6))
    shift = 1e12 * 130 / RATE  # of 130 samples
    found = ambiguity(signal, signal, doppler=np.array([shift]), greatest_lag=2e-6)
    top = int(np.argmax(np.abs(found.amplitude[0])))
    assert found.lag[top] == pytest.approx(1e-6, abs=1e-12)
    assert abs(found.amplitude[0, top]) == pytest.approx(1 - shift / 100e6, abs=1e-3)


def test_the_volume_of_an_ambiguity_function_is_one_whatever_the_waveform():
    """∬|χ|² dτ dν = 1 (Woodward 1953): diversity moves ambiguity, it removes none."""
    rate, count = 1e6, 64
    a = Baseband(samples=noise(count, 5).samples, sample_rate=rate)
    doppler = np.arange(count * 2) * rate / (count * 2)
    found = ambiguity(a, a, doppler=doppler, greatest_lag=count / rate)
    volume = (np.abs(found.amplitude) ** 2).sum() / rate * (doppler[1] - doppler[0])
    assert volume == pytest.approx(1.0, abs=1e-9)
