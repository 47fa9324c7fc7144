"""What oscillators that err do to echoes and interference, against theory and a direct product."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.fft import next_fast_len
from scipy.linalg import hadamard
from scipy.signal import welch
from scipy.special import jv

from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.leakage import Leakage
from polychirp.model.oscillator import Oscillator, PhaseNoise, QuadraticError, SinusoidalError
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.impairments.oscillator_errors import Oscillating, highest_offset, shared
from polychirp.synthesis.impairments.phase_error import noise_record, noise_waves, phase_error
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.units import from_db, to_db
from tests.support.references.fullband import FullBand

SLOPE = 1e12
START = 79e9
DURATION = 100e-6
STREAMS = Streams(seed=5)
ENGINE = Oscillating(inner=Stretch(), streams=STREAMS)
TYPICAL = Oscillator(phase_noise=PhaseNoise())


def white(level):
    """The same level at every offset from 100 Hz on."""
    return Oscillator(phase_noise=PhaseNoise(offset=(100.0,), level=(level,)))


def ramps(number=1, *, start_time=0.0, duration=DURATION, slope=SLOPE, start_frequency=START):
    return RampSchedule(
        start_time=start_time + duration * np.arange(number),
        duration=np.full(number, duration),
        start_frequency=np.full(number, start_frequency),
        slope=np.full(number, slope),
        start_phase=np.zeros(number),
        sweep=np.arange(number),
    )


def world(*oscillators, **fields):
    array = AntennaArray(num_channels=1, pattern=ISOTROPIC)
    radars = tuple(
        Radar(name=f"radar {n}", array=array, oscillator=oscillator, **fields)
        for n, oscillator in enumerate(oscillators)
    )
    car = Actor(name="car", kind="vehicle")
    return Scene(time=0.0, actors=(car,), radars=radars, carriers=(0,) * len(radars))


def received(engine, scene, plans, *paths):
    """The first radar's samples, ``(ramp, fast)``; the paths come from one transmitter."""
    y = engine.contribution(
        scene, plans, [paths_of(*paths)], victim=0, transmitter=paths[0].transmitter
    )
    return y.sum(axis=0)[0]


def deviation(scene, plans, *paths):
    """What the errors add, and the samples without them."""
    clean = received(Stretch(), scene, plans, *paths)
    return received(ENGINE, scene, plans, *paths) - clean, clean


# ── the slow twin ───────────────────────────────────────────────────────────────────────────────


def gauss_nodes(begin, end, corners, rate=100e6):
    """Times and weights of panels of 16 nodes that no corner lies in."""
    inside = [c for c in corners if begin < c < end]
    edge = np.unique([begin, *inside, end])
    node, weight = np.polynomial.legendre.leggauss(16)
    times, weights = [], []
    for low, high in pairwise(edge):
        count = int(np.ceil((high - low) * rate / 16))
        width = (high - low) / count
        times.append((low + width * (np.arange(count)[:, None] + 0.5 * (node + 1))).ravel())
        weights.append(np.tile(0.5 * width * weight, count))
    return np.concatenate(times), np.concatenate(weights)


def direct_product(scene, plans, *paths):
    """Both noisy phases at their own times, multiplied, and filtered by quadrature."""
    victim, sender = scene.radars[0], scene.radars[paths[0].transmitter]
    own, sent = plans[0], plans[paths[0].transmitter]
    errors = [
        phase_error(radar, plan, highest_offset=highest_offset(scene), streams=STREAMS)
        or np.zeros_like
        for radar, plan in ((victim, own), (sender, sent))
    ]

    def phase(plan, error, t):
        into = t - plan.start_time[0]
        return plan.start_frequency[0] * into + 0.5 * plan.slope[0] * into**2 + error(t)

    def is_on(plan, t):
        return (t >= plan.start_time[0]) & (t < plan.end_time[0])

    power = sender.transmit_power * sender.transmit_gain * victim.receive_gain
    corners = [own.start_time[0], own.end_time[0]]
    corners += [
        end + path.delay for path in paths for end in (sent.start_time[0], sent.end_time[0])
    ]
    times = sample_times(own, victim.converter)
    half = 0.5 * victim.if_filter.support
    out = np.zeros(times.most_samples, dtype=np.complex128)
    for n, moment in enumerate(times.time[0]):
        t, weight = gauss_nodes(moment - half, moment + half, corners)
        y = np.zeros(t.size, dtype=np.complex128)
        for path in paths:
            u = t - path.delay
            turns = phase(own, errors[0], t) - phase(sent, errors[1], u)
            gain = np.conj(path.gain) * np.sqrt(power)
            y += gain * np.exp(2j * np.pi * turns) * (is_on(own, t) & is_on(sent, u))
        out[n] = (y * weight) @ victim.if_filter.impulse_response(moment - t)
    return out


ECHOES = (HandPath(delay=2e-8), HandPath(delay=2.6e-7, gain=0.5j), HandPath(delay=4.2e-7))
DIRECT = (
    HandPath(delay=1e-7, transmitter=1),
    HandPath(delay=1.7e-7, gain=0.3j, transmitter=1),
)
CROSSING = ramps(start_time=15e-6, slope=1.01e12, start_frequency=START + 14.7e6)


@pytest.mark.parametrize(
    ("sent", "paths"), [(ramps(), ECHOES), (ramps(start_time=-3e-7), DIRECT), (CROSSING, DIRECT)]
)
def test_errors_of_phase_are_the_same_as_in_a_direct_product(sent, paths):
    """Windows within the victim's ramp; the crossing one begins in the middle, in band."""
    both = Oscillator(phase_noise=PhaseNoise(), ramp_error=SinusoidalError(peak=50e3, cycles=3))
    scene, plans = world(both, both), [ramps(), sent]
    slow = direct_product(scene, plans, *paths)
    fast = received(ENGINE, scene, plans, *paths)[0]
    # the rms of 1e-6 between nodes of delay, and the fourth order of the noise that folds back
    assert np.abs(fast - slow).max() < 5e-6 * np.abs(slow).max()
    clean = received(Stretch(), scene, plans, *paths)[0]
    assert np.abs(clean - slow).max() > 1e-2 * np.abs(slow).max()


BENT = SinusoidalError(peak=5e6, cycles=3)


@pytest.mark.parametrize("who", [0, 1])
@pytest.mark.parametrize("start", [0.0, 5e-6])
def test_a_ramp_error_far_beyond_the_band_is_the_same_as_in_a_direct_product(who, start):
    """±5 MHz take a beat of 0 through the band of 0.7 MHz and out, and bring one of 5 MHz in."""
    errors = [Oscillator(), Oscillator()]
    errors[who] = Oscillator(ramp_error=BENT)
    scene, plans = world(*errors), [ramps(), ramps(start_time=start)]
    slow = direct_product(scene, plans, *DIRECT)
    fast = received(ENGINE, scene, plans, *DIRECT)[0]
    assert np.abs(slow).max() > 1.0
    assert np.abs(fast - slow).max() < 3e-5 * np.abs(slow).max()


@pytest.mark.parametrize("cycles", [300, 600, 1030])
def test_a_fast_ripple_of_own_ramps_is_the_same_as_in_a_direct_product(cycles):
    """3, 6 and 10.3 MHz are beyond the band of 0.7 MHz: paired echoes are outside, or come in.

    The echo at 3.1 MHz has one at 0.1 MHz with the ripple of 3 MHz. A ripple near the rate at which
    errors are multiplied, 6 MHz without it, must not fold back into the band.
    """
    ripple = Oscillator(ramp_error=SinusoidalError(peak=100e3, cycles=cycles))
    echoes = (HandPath(delay=1e-7), HandPath(delay=3.1e-6))
    scene, plans = world(ripple), [ramps()]
    slow = direct_product(scene, plans, *echoes)
    fast = received(ENGINE, scene, plans, *echoes)[0]
    assert np.abs(fast - slow).max() < 3e-5 * np.abs(slow).max()


def test_errors_of_phase_are_right_where_windows_reach_over_the_ends_of_a_ramp():
    """There, what the wide filter takes of the corner is missed by its ripple over the beat."""
    both = Oscillator(phase_noise=PhaseNoise(), ramp_error=QuadraticError(peak=50e3))
    scene = world(both, converter=Converter(start=1e-7, margin=1e-7))
    slow = direct_product(scene, [ramps()], *ECHOES)
    fast = received(ENGINE, scene, [ramps()], *ECHOES)[0]
    assert np.abs(fast - slow).max() < 3e-5 * np.abs(slow).max()


@pytest.mark.slow
def test_any_engine_can_be_inside():
    """Three ramps that touch, windows that open with them: the errors run on from ramp to ramp."""
    both = Oscillator(phase_noise=PhaseNoise(), ramp_error=SinusoidalError(peak=100e3))
    scene = world(
        both,
        if_filter=IfFilter(passband=2e6, stopband=4e6, attenuation=from_db(50.0)),
        converter=Converter(sample_rate=10e6, start=0.1e-6, margin=0.1e-6),
    )
    plans = [ramps(3, duration=8e-6, slope=3e12)]
    fast, slow = (
        received(Oscillating(inner=inner, streams=STREAMS), scene, plans, *ECHOES[:2])
        for inner in (Stretch(), FullBand())
    )
    clean = received(Stretch(), scene, plans, *ECHOES[:2])
    assert np.abs(fast - slow).max() < 1e-6 * np.abs(slow).max()
    assert np.abs(clean - slow).max() > 1e-2 * np.abs(slow).max()


# ── records of noise ────────────────────────────────────────────────────────────────────────────


def test_a_record_has_the_spectrum_of_its_table(compare):
    """Welch's estimate of 2πθ is one-sided: twice L (IEEE 1139)."""
    noise, rate = PhaseNoise(), 10e6
    record = noise_record(noise, begin=0.0, end=0.05, highest_offset=2e6, streams=STREAMS)
    theta = 2 * np.pi * record(np.arange(500_000) / rate)
    offset, density = welch(theta, rate, nperseg=8192, detrend="linear")
    for at in (2e4, 1e5, 5e5, 1.8e6):
        near = np.abs(offset / at - 1.0) < 0.1
        measured = np.mean(density[near] / (2.0 * noise.density(offset[near])))
        compare(
            page="impairments",
            case=f"phase noise at {at / 1e3:g} kHz",
            quantity="spectrum over 2L(f), dB",
            expected=0.0,
            measured=float(to_db(measured)),
            # four deviations of an average over 120 overlapping segments and their bins,
            # and the window's leakage of a slope
            tolerance=4 * 4.34 / (60 * max(1.0, float(near.sum()) / 2)) ** 0.5 + 0.1,
            source="one-sided spectrum 2L(f) (IEEE 1139)",
        )
    assert np.all(density[offset > 2.1e6] < 1e-6 * 2 * noise.density(np.array([2e6])))


def test_a_record_is_the_sum_of_its_waves():
    """The splines against every wave evaluated by itself."""
    begin, end, highest = -1e-4, 2e-4, 1e6
    record = noise_record(
        PhaseNoise(), begin=begin, end=end, highest_offset=highest, streams=STREAMS
    )
    rate = 8.0 * highest
    size = int(np.ceil((end - begin) * rate)) + 8
    period = next_fast_len(2 * size, real=True)
    offset, height = noise_waves(
        PhaseNoise(), spacing=rate / period, highest_offset=highest, streams=STREAMS
    )
    t = np.linspace(begin, end, 137)
    # time zero of the waves is three grid points before the record begins
    turn = np.exp(2j * np.pi * np.outer(t - begin + 3.0 / rate, offset))
    direct = 2.0 * (turn @ height).real / (2 * np.pi)
    assert np.abs(record(t) - direct).max() < 1e-6 * np.abs(direct).max()


def test_all_victims_hear_the_same_noise_of_a_radar_and_nobody_elses():
    scene = world(TYPICAL, TYPICAL, Oscillator())
    t = np.linspace(0.0, DURATION, 9)
    first, again, other = (
        phase_error(scene.radars[n], ramps(), highest_offset=1.4e6, streams=STREAMS)(t)
        for n in (0, 0, 1)
    )
    assert first.tolist() == again.tolist()
    assert not np.any(first == other)
    assert phase_error(scene.radars[2], ramps(), highest_offset=1.4e6, streams=STREAMS) is None


class CountingEngine:
    """Stretch, and what it was asked for."""

    def __init__(self):
        self.asked = []

    def contribution(self, scene, schedules, snapshots, *, victim, transmitter):
        self.asked.append(scene)
        return Stretch().contribution(
            scene, schedules, snapshots, victim=victim, transmitter=transmitter
        )


def test_ideal_oscillators_cost_nothing_and_change_nothing():
    """A third radar's noise is none of a pair's business either."""
    inner = CountingEngine()
    scene, plans = world(Oscillator(), Oscillator(), TYPICAL), [ramps(), CROSSING, ramps()]
    engine = Oscillating(inner=inner, streams=STREAMS)
    y = received(engine, scene, plans, *DIRECT)
    assert len(inner.asked) == 1
    assert inner.asked[0] is scene
    assert y.tobytes() == received(Stretch(), scene, plans, *DIRECT).tobytes()


def test_shares_of_a_path_sum_to_the_path():
    shots = [paths_of(*ECHOES), paths_of(*ECHOES[:1], reference_time=1e-3)]
    total = {}
    for _, parts in shared(shots, world(TYPICAL).radars[0], highest=1.4e6, shortest=1e-4):
        for n, part in enumerate(parts):
            for delay, transfer in zip(part.delay, part.transfer, strict=True):
                total[n, delay] = total.get((n, delay), 0.0) + transfer
    assert len(total) == 4
    for n, shot in enumerate(shots):
        for delay, transfer in zip(shot.delay, shot.transfer, strict=True):
            assert total[n, delay] == pytest.approx(transfer, abs=1e-12)


# ── what noise does ─────────────────────────────────────────────────────────────────────────────


def skirt(noise, rate, beat):
    """Offsets from a beat, and the noise's two-sided spectrum there, averaged over ramps."""
    carrier = np.exp(2j * np.pi * np.arange(noise.shape[-1]) * beat / rate)
    offset, density = welch(
        noise / carrier, rate, nperseg=256, return_onesided=False, detrend=False
    )
    return offset, density.mean(axis=0)


@pytest.mark.parametrize("delay", [2e-8, 2e-7])
def test_the_skirt_of_an_own_echo_is_suppressed_by_range_correlation(compare, delay):
    """L(ν)·4 sin²(πντ): both mixers' inputs carry the same noise, τ apart.

    So little noise that its square, which nothing suppresses, is below a hundredth of it.
    """
    level, rate = 1e-11, 1e6
    scene = world(white(level))
    noise, clean = deviation(scene, [ramps(40, duration=1.2e-3)], HandPath(delay=delay))
    offset, density = skirt(noise, rate, SLOPE * delay)
    density /= np.mean(np.abs(clean) ** 2)
    for at in (-1.0e5, 5e4, 8e4):
        near = np.abs(offset - at) < 1.2e4
        theory = level * 4.0 * np.sin(np.pi * offset[near] * delay) ** 2
        compare(
            page="impairments",
            case=f"phase noise of an own echo at {delay * 1e9:g} ns, {at / 1e3:g} kHz off",
            quantity="side lobe, dBc/Hz",
            expected=float(to_db(theory.mean())),
            measured=float(to_db(density[near].mean())),
            # four deviations over 40 ramps of 8 half-overlapping segments and 3 windows' bins
            tolerance=4 * 4.34 / (40 * 4 * 3) ** 0.5,
            source="L(ν)·4 sin²(πντ) (Budge and Burt 1993)",
        )


def test_another_radar_is_heard_with_the_noise_of_both(compare):
    """A steady beat: P (L_v + L_i) ∫|H|² df, nothing cancels."""
    levels = 1e-10, 3e-10
    scene = world(*(white(level) for level in levels))
    plans = [ramps(20, duration=1.2e-3)] * 2
    noise, clean = deviation(scene, plans, HandPath(delay=5e-8, transmitter=1))
    band = scene.radars[0].if_filter.noise_bandwidth
    compare(
        page="impairments",
        case="white phase noise of an interferer at a steady beat",
        quantity="power in the IF band, dBc",
        expected=float(to_db(sum(levels) * band)),
        measured=float(to_db(np.mean(np.abs(noise) ** 2) / np.mean(np.abs(clean) ** 2))),
        # four deviations of 24 ms of noise that is independent every 1/band
        tolerance=4 * 4.34 / (20 * 1.2e-3 * band) ** 0.5,
        source="(L_v + L_i) ∫|H|² df",
    )


def test_the_noise_of_a_chirp_that_crosses_is_the_same_near_and_far_from_the_band(compare):
    """White noise has P (L_v + L_i) ∫|H|² df at whatever beat: waves near, a floor far out."""
    level, power = 1e-10, 0.01 * 10**0.9 * 10**1.5
    scene = world(white(level), white(level))
    # 1.2 ms at 1e10 Hz/s: from −6 to 6 MHz, so that both treatments take part
    sent = ramps(40, duration=1.2e-3, slope=1.01e12, start_frequency=START - 6e6)
    plans = [ramps(40, duration=1.2e-3), sent]
    noise, _ = deviation(scene, plans, HandPath(delay=0.0, transmitter=1))
    band = scene.radars[0].if_filter.noise_bandwidth
    t = 10e-6 + np.arange(noise.shape[-1]) * 1e-6
    beat = np.abs(6e6 - 1e10 * t)
    for name, where in (
        ("in band", beat < 0.5e6),
        ("1 to 2 MHz off", (beat > 1e6) & (beat < 2e6)),
        ("2 to 6 MHz off", beat > 2e6),
    ):
        compare(
            page="impairments",
            case=f"white phase noise of a crossing interferer, {name}",
            quantity="power in the IF band, dBc",
            expected=float(to_db(2 * level * band)),
            measured=float(to_db(np.mean(np.abs(noise[:, where]) ** 2) / power)),
            tolerance=4 * 4.34 / float(40 * where.sum() * 1e-6 * band) ** 0.5,
            source="(L_v + L_i) ∫|H|² df",
        )


STEEP = Oscillator(phase_noise=PhaseNoise(offset=(1e5, 1e7), level=(1e-8, 1e-12)))


@pytest.mark.parametrize("oscillator", [white(1e-10), STEEP], ids=["white", "20 dB per decade"])
@pytest.mark.parametrize("beat", [-1.5, 2.0, 2.25, -4.0])
@pytest.mark.parametrize("delay", [2e-6, 20e-6])
def test_noise_of_a_steady_beat_is_whole_at_every_distance_from_the_band(oscillator, beat, delay):
    """P ∫(L_v + L_i)(f − f_IF) |H(f)|² df at beats up to 4 stop edges.

    The victim's own ramp beats at 0.7 and at 7 stop edges after the way.
    """
    power = 0.01 * 10**0.9 * 10**1.5
    scene = world(oscillator, oscillator, if_filter=IfFilter(passband=2.5e6, stopband=2.8e6))
    chain = scene.radars[0].if_filter
    steady = beat * chain.stopband
    # what arrives has left when the sweep's frequency was lower by SLOPE · delay
    sent = ramps(8, duration=1.2e-3, start_frequency=START - steady + SLOPE * delay)
    plans = [ramps(8, duration=1.2e-3), sent]
    noise, _ = deviation(scene, plans, HandPath(delay=delay, transmitter=1))
    f = np.linspace(-chain.stopband, chain.stopband, 20_001)
    passed = np.abs(chain.response(f)) ** 2
    level = oscillator.phase_noise.density(np.maximum(np.abs(f - steady), 1e3))
    expected = np.trapezoid(2 * level * passed, f)
    found = np.mean(np.abs(noise[:, 10:]) ** 2) / power
    # four deviations of independent samples
    assert to_db(found / expected) == pytest.approx(0.0, abs=4 * 4.34 / noise[:, 10:].size ** 0.5)


@pytest.mark.parametrize("later", [0.5, 1.5, 2.5])
def test_every_path_brings_its_own_far_noise(later):
    """Two paths whose beats differ by so many stop edges: 1.64 P (L_v + L_i) ∫|H|² df."""
    level, power = 1e-10, 0.01 * 10**0.9 * 10**1.5
    scene = world(white(level), white(level))
    stopband = scene.radars[0].if_filter.stopband
    plans = [
        ramps(20, duration=1.2e-3),
        ramps(20, duration=1.2e-3, start_frequency=START - 5.0 * stopband),
    ]
    paths = (
        HandPath(delay=1e-6, transmitter=1),
        HandPath(delay=1e-6 + later * stopband / SLOPE, gain=0.8, transmitter=1),
    )
    noise, _ = deviation(scene, plans, *paths)
    found = np.mean(np.abs(noise[:, 10:]) ** 2) / (1.64 * power)
    expected = 2 * level * scene.radars[0].if_filter.noise_bandwidth
    assert to_db(found / expected) == pytest.approx(0.0, abs=4 * 4.34 / noise[:, 10:].size ** 0.5)


@pytest.mark.parametrize("sweeps_per_ramp", [1, 10])
def test_far_noise_of_elements_that_send_together_is_the_sum_of_their_powers(sweeps_per_ramp):
    """Codes that are orthogonal over 4 sweeps: 4 P (L_v + L_i) ∫|H|² df, straight ahead too.

    Sweeps are as long as the victim's ramps, or ten times shorter.
    """
    level, power = 1e-10, 0.01 * 10**0.9 * 10**1.5
    scene = world(white(level), white(level))
    array = AntennaArray(num_channels=1, num_transmitters=4, pattern=ISOTROPIC)
    scene = replace(scene, radars=tuple(replace(radar, array=array) for radar in scene.radars))
    own = ramps(40, duration=1.2e-3)
    sent = ramps(
        40 * sweeps_per_ramp, duration=1.2e-3 / sweeps_per_ramp, start_frequency=START - 6e6
    )
    plans = [
        replace(
            plan, transmit_weight=np.tile(hadamard(4), (plan.num_ramps // 4, 1)).astype(complex)
        )
        for plan in (own, sent)
    ]
    noise, _ = deviation(scene, plans, HandPath(delay=0.0, transmitter=1))
    band = scene.radars[0].if_filter.noise_bandwidth
    found = np.mean(np.abs(noise) ** 2) / (4 * power)
    # straight ahead, one sweep in four has the power 16 P and the others none: 12 ms of noise
    assert to_db(found) == pytest.approx(
        to_db(2 * level * band), abs=4 * 4.34 / 12e-3**0.5 / band**0.5
    )


def test_far_noise_that_nobody_hears_is_left_out():
    """A floor 60 dB below the victim's thermal noise asks nothing more of the inner engine."""
    far = ramps(start_frequency=START + 50e6, slope=1.2e12)
    counts = []
    for level in (1e-10, 1e-26):
        inner = CountingEngine()
        received(
            Oscillating(inner=inner, streams=STREAMS),
            world(Oscillator(), white(level)),
            [ramps(), far],
            DIRECT[0],
        )
        counts.append(len(inner.asked))
    assert counts[0] == counts[1] + 1


# ── what bent ramps do ──────────────────────────────────────────────────────────────────────────


def test_a_ramp_that_swings_has_paired_echoes(compare):
    """ε(x) − ε(x−τ) makes J₁(m)/J₀(m), m = 2 ε̂ T/n · sin(πnτ/T)."""
    duration, cycles, peak, delay = 1.02e-3, 51, 400e3, 2e-7
    scene = world(Oscillator(ramp_error=SinusoidalError(peak=peak, cycles=cycles)))
    y = received(ENGINE, scene, [ramps(duration=duration)], HandPath(delay=delay))[0]
    # 50 kHz swing: 20 samples to a period, and a whole number of them
    whole = y[: y.size // 20 * 20]
    t = np.arange(whole.size) * 1e-6
    line = [
        abs(np.mean(whole * np.exp(-2j * np.pi * (SLOPE * delay + n * 50e3) * t))) for n in (0, 1)
    ]
    swing = 2 * peak * duration / cycles * np.sin(np.pi * cycles * delay / duration)
    compare(
        page="impairments",
        case="own echo of 200 ns on a ramp that swings by 400 kHz",
        quantity="paired echo, dB",
        expected=float(to_db((jv(1, swing) / jv(0, swing)) ** 2)),
        measured=float(to_db((line[1] / line[0]) ** 2)),
        tolerance=0.01,
        source="J₁(m)/J₀(m), m = 2(ε̂T/n) sin(πnτ/T)",
    )
    assert to_db(jv(1, swing) ** 2) == pytest.approx(20 * np.log10(np.pi * peak * delay), abs=0.3)


def test_a_ramp_that_bows_spreads_a_beat_by_the_change_of_its_error():
    """ε(t) − ε(t − τ) = 4ε̂(τ/T)(1 − 2x + τ/T)."""
    duration, peak, delay = 1e-3, 2e6, 2.5e-7
    scene = world(Oscillator(ramp_error=QuadraticError(peak=peak)))
    y = received(ENGINE, scene, [ramps(duration=duration)], HandPath(delay=delay))[0]
    t = 10e-6 + np.arange(y.size) * 1e-6
    beat = np.diff(np.unwrap(np.angle(y))) / (2 * np.pi * 1e-6)
    x = 0.5 * (t[1:] + t[:-1]) / duration
    expected = SLOPE * delay + 4 * peak * delay / duration * (1 - 2 * x + delay / duration)
    assert beat == pytest.approx(expected, abs=0.5)  # of 2 kHz: the filter's ripple


# ── what a radar hears of itself ────────────────────────────────────────────────────────────────


def test_leakage_keeps_as_much_noise_as_an_echo_of_its_delay():
    """Two leaks and an echo at once: each carries the error of its own delay."""
    echo = HandPath(delay=80e-9, gain=0.3)
    leaks = (Leakage(isolation=4.0, delay=0.2e-9), Leakage(isolation=100.0, delay=20e-9, phase=1.0))
    as_paths = [
        HandPath(delay=x.delay, gain=x.isolation**-0.5 * np.exp(1j * x.phase)) for x in leaks
    ]
    plans = [ramps(2)]
    both = ENGINE.contribution(
        world(TYPICAL, leakage=leaks), plans, [paths_of(echo)], victim=0, transmitter=0
    )
    alone = [received(ENGINE, world(TYPICAL), plans, path) for path in (echo, *as_paths)]
    clean = [received(Stretch(), world(TYPICAL), plans, path) for path in as_paths]
    noise = np.abs(sum(alone[1:]) - sum(clean)).max()
    assert np.abs(both[2, 0] - sum(alone[1:])).max() < 1e-3 * noise
    assert np.abs(both[0, 0] - alone[0]).max() < 1e-9 * np.abs(alone[0]).max()


def test_a_radar_that_receives_itself_alone_needs_no_paths():
    scene = world(TYPICAL, leakage=(Leakage(isolation=1.0, delay=1e-9),))
    y = ENGINE.contribution(scene, [ramps()], [paths_of()], victim=0, transmitter=0)
    assert not np.any(y[:2])
    assert np.any(
        y[2] != Stretch().contribution(scene, [ramps()], [paths_of()], victim=0, transmitter=0)[2]
    )
