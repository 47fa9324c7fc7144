"""Laws of what lies between IF filter and samples: each step against its closed form."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.front_end import (
    Digitiser,
    FrontEnd,
    GainControl,
    HighPass,
    IqImbalance,
    Offset,
)
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import PARTS, sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.impairments.adc import digitised, gains
from polychirp.synthesis.impairments.front_end import reading
from polychirp.synthesis.impairments.high_pass import (
    coefficients,
    high_passed,
    refuse_unfollowed,
    with_lead,
)
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.units import from_db
from tests.support.front_end import image_rejection

SLOPE = 1e12
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def plan(*, num_ramps=1, slope=SLOPE):
    number = np.arange(num_ramps)
    return RampSchedule(
        start_time=number * 500e-6,
        duration=np.full(num_ramps, 500e-6),
        start_frequency=np.full(num_ramps, 79e9),
        slope=np.full(num_ramps, slope),
        start_phase=np.zeros(num_ramps),
        sweep=number,
    )


def world(*radars):
    car = Actor(name="car", kind="vehicle")
    return Scene(time=0.0, actors=(car,), radars=radars, carriers=(0,) * len(radars))


def radar(name="victim", *, num_channels=1, **fields):
    array = AntennaArray(num_channels=num_channels, pattern=ISOTROPIC)
    return Radar(name=name, array=array, **fields)


def made(victim, *paths, others=(), plans=None):
    plans = plans or [plan()] * (1 + len(others))
    return synthesize(
        Stretch(),
        world(victim, *others),
        plans,
        [paths_of(*paths)],
        victim=0,
        interferers=None,
        streams=Streams(seed=2),
    )


def tone(amplitude, *, count=20_000, turns_per_sample=0.1 * GOLDEN):
    """A complex tone whose phases fill the circle evenly: ``(1, 1, fast)``."""
    return (amplitude * np.exp(2j * np.pi * turns_per_sample * np.arange(count)))[None, None]


def line(samples, *, turns_per_sample):
    """Amplitude of the line at a frequency, under a Blackman window."""
    window = np.blackman(samples.size)
    wave = np.exp(-2j * np.pi * turns_per_sample * np.arange(samples.size))
    return abs(np.sum(samples.ravel() * window * wave)) / window.sum()


# ── high-pass ───────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("corners", [(20e3,), (100e3,), (175e3, 350e3)])
@pytest.mark.parametrize("beat", [5e3, 40e3, 290e3])
def test_a_high_pass_takes_from_a_beat_what_its_analog_takes(compare, corners, beat):
    """Long after the ramp's start an echo is weighted by Π jf/(f_i + jf), phase included."""
    high_pass = HighPass(corners=corners)
    _, plain = made(radar(), HandPath(delay=beat / SLOPE))
    _, parts = made(radar(front_end=FrontEnd(high_pass=high_pass)), HandPath(delay=beat / SLOPE))
    late = slice(150, None)  # 160 µs, e^{-20} of the slowest ringing
    ratio = parts["echo"][0, 0, late] / plain["echo"][0, 0, late]
    expected = high_pass.response(np.array([beat]))[0]
    assert np.abs(ratio - expected).max() < 1e-3
    text = ", ".join(f"{corner / 1e3:g}" for corner in corners)
    compare(
        page="impairments",
        case=f"high-pass at {text} kHz, beat of {beat / 1e3:g} kHz",
        quantity="amplitude kept",
        expected=abs(expected),
        measured=float(np.abs(ratio).mean()),
        tolerance=1e-3,
        source="product of jf/(f_i + jf)",
    )


@pytest.mark.parametrize("corners", [(20e3,), (175e3, 350e3)])
def test_a_high_pass_rings_like_a_recursion_at_fifty_times_the_rate(corners):
    """The obvious twin: samples at 100 MS/s from the ramp's start, one trapezoid step each.

    At 2 MS/s nothing that the filter lets through is aliased, so that an interferer that sweeps
    through the band comes out alike too.
    """
    victim = radar(
        converter=Converter(sample_rate=2e6, start=5e-6),
        front_end=FrontEnd(high_pass=HighPass(corners=corners)),
    )
    fine = replace(
        victim, front_end=FrontEnd(), converter=Converter(sample_rate=100e6, start=0.0, margin=0.0)
    )
    paths = (HandPath(delay=2e-9), HandPath(delay=0.2e-6), HandPath(delay=0.0, transmitter=1))
    sweep = replace(plan(slope=0.7e12), start_frequency=[79e9 + 0.3e12 * 250e-6])
    plans = [plan(), sweep]

    def sums(chosen):
        _, parts = made(chosen, *paths, others=(radar("other"),), plans=plans)
        return (parts.echo + parts.interference)[0, 0]

    y = sums(fine)
    for corner in corners:
        a = 2 * np.pi * corner / 100e6
        x, out = y, np.empty_like(y)
        out[0] = x[0]
        for n in range(1, x.size):
            out[n] = ((1 - a / 2) * out[n - 1] + x[n] - x[n - 1]) / (1 + a / 2)
        y = out
    samples = sums(victim)
    twin = y[500::50][: samples.size]
    assert np.abs(samples - twin).max() < 2 * 1e-3 * np.abs(y).max()


def test_a_high_pass_kills_what_stands_still():
    """0 Hz: what is left is the ringing of its start, e^{-2π·100 kHz·10 µs} = 0.2 % and falling."""
    _, plain = made(radar(), HandPath(delay=0.0))
    _, parts = made(
        radar(front_end=FrontEnd(high_pass=HighPass(corners=(100e3,)))), HandPath(delay=0.0)
    )
    level = np.abs(plain["echo"]).max()
    assert np.abs(parts["echo"][0, 0, 0]) < 3e-3 * level
    assert np.abs(parts["echo"][0, 0, 30:]).max() < 1e-8 * level


def test_noise_behind_a_high_pass_has_the_power_that_passes_both_filters():
    """∫|H|²|H_hp|² df, where nothing is aliased: 64 channels of 480 µs in 1 MHz, 5σ is 3 %."""
    high_pass = HighPass(corners=(150e3,))
    converter = Converter(sample_rate=2e6)
    victim = radar(num_channels=64, converter=converter, front_end=FrontEnd(high_pass=high_pass))
    _, parts = made(victim)
    _, plain = made(radar(num_channels=64, converter=converter))
    frequency = np.linspace(-0.7e6, 0.7e6, 1401)
    power = victim.if_filter.response(frequency) ** 2
    passed = np.sum(power * np.abs(high_pass.response(frequency)) ** 2) / np.sum(power)
    measured = np.mean(np.abs(parts.noise) ** 2) / np.mean(np.abs(plain.noise) ** 2)
    assert measured == pytest.approx(passed, rel=0.03)


def test_short_ramps_are_filtered_as_if_they_were_alone():
    """Padding behind a short ramp's samples stays zero, and its samples know nothing of it."""
    long, short = plan(), replace(plan(), duration=[300e-6])
    both = RampSchedule(
        start_time=[0.0, 500e-6],
        duration=[300e-6, 500e-6],
        start_frequency=[79e9] * 2,
        slope=[SLOPE] * 2,
        start_phase=[0.0] * 2,
        sweep=[0, 1],
    )
    victim = radar(front_end=FrontEnd(high_pass=HighPass(corners=(50e3,))))
    path = HandPath(delay=1e-7)
    _, together = made(victim, path, plans=[both])
    _, first = made(victim, path, plans=[short])
    _, second = made(victim, path, plans=[long])
    count = first["echo"].shape[-1]
    assert together["echo"][:, 0, :count] == pytest.approx(first["echo"][:, 0], rel=1e-9)
    assert together["echo"][:, 1] == pytest.approx(second["echo"][:, 0], rel=1e-6)
    assert not together.samples[:, :, 0, count:].any()


def test_a_converter_that_cannot_follow_is_told_what_would_help():
    victim = radar(
        if_filter=IfFilter(passband=0.45e6, stopband=0.55e6),
        converter=Converter(margin=0.0),
        front_end=FrontEnd(high_pass=HighPass(corners=(350e3,))),
    )
    with pytest.raises(InputError, match=r"sample at 2 MS/s"):
        made(victim)


def sampled_at_twice_the_stopband(stopband, corners, *, margin=1e-6, faster=1.0):
    return Radar(
        name="front",
        if_filter=IfFilter(passband=0.9 * stopband, stopband=stopband, attenuation=from_db(60.0)),
        converter=Converter(sample_rate=2.0 * faster * stopband, margin=margin),
        front_end=FrontEnd(high_pass=HighPass(corners=corners)),
    )


def test_a_high_pass_may_be_sampled_at_twice_the_stop_edge():
    """No filter of samples has the analog response at half the rate, where nothing arrives."""
    refuse_unfollowed(sampled_at_twice_the_stopband(10e6, (50e3, 50e3)))


def test_what_is_said_to_help_helps():
    with pytest.raises(InputError, match=r"front_end\.high_pass: corners") as caught:
        refuse_unfollowed(sampled_at_twice_the_stopband(4.652e6, (175e3,), margin=0.2e-6))
    faster, margin = re.search(
        r"at ([\d.]+) MS/s, or .* to ([\d.]+) µs", str(caught.value)
    ).groups()
    refuse_unfollowed(
        sampled_at_twice_the_stopband(
            4.652e6, (175e3,), margin=0.2e-6, faster=float(faster) / 9.304
        )
    )
    refuse_unfollowed(sampled_at_twice_the_stopband(4.652e6, (175e3,), margin=float(margin) * 1e-6))


def test_without_a_high_pass_nothing_is_looked_at_besides():
    scene = world(radar())
    assert with_lead(scene, 0) is scene
    samples = np.ones((1, 1, 1, 3), dtype=complex)
    times = sample_times(plan(), scene.radars[0].converter)
    assert high_passed(scene.radars[0], samples, times) is samples


def test_the_response_of_the_fit_has_no_pole_but_the_analog_ones():
    _, poles, _ = coefficients(HighPass(corners=(1e5, 2e5)), IfFilter(), rate=1e6, ahead=10)
    assert np.sort(np.roots(poles)) == pytest.approx(np.exp(-2 * np.pi * np.array([0.2, 0.1])))


# ── I/Q imbalance and offset ────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    ("gain", "phase"), [(from_db(1.0), 0.0), (1.0, math.radians(3.0)), (from_db(-0.5), -0.02)]
)
def test_an_echo_has_an_image_at_minus_its_beat(compare, gain, phase):
    """|α/β|² = (1 + 2g cos φ + g²) / (1 − 2g cos φ + g²), the amplitude g in power twice."""
    victim = radar(front_end=FrontEnd(imbalance=IqImbalance(gain=gain, phase=phase)))
    _, parts = made(victim, HandPath(delay=0.1e-6))
    echo = parts["echo"][0, 0]
    straight, image = (line(echo, turns_per_sample=sign * 0.1) for sign in (1, -1))
    g = math.sqrt(gain)
    expected = (1 + 2 * g * math.cos(phase) + gain) / (1 - 2 * g * math.cos(phase) + gain)
    assert image_rejection(victim.front_end.imbalance) == pytest.approx(expected, rel=1e-9)
    compare(
        page="impairments",
        case=f"I/Q imbalance {10 * math.log10(gain):.1f} dB, {math.degrees(phase):.1f}°",
        quantity="image rejection, dB",
        expected=10 * math.log10(expected),
        measured=20 * math.log10(straight / image),
        tolerance=0.01,
        source="Razavi, RF Microelectronics, §4.2",
    )


def test_the_branches_are_what_the_imbalance_says():
    """I stays; Q becomes g(q cos φ − i sin φ)."""
    y = np.array([3.0 + 0.0j, 2.0j, 1.0 - 1.0j])
    out = IqImbalance(gain=4.0, phase=math.pi / 6).applied(y)
    assert out.real == pytest.approx(y.real)
    assert out.imag == pytest.approx(2.0 * (y.imag * math.cos(math.pi / 6) - 0.5 * y.real))


def test_an_offset_is_a_constant_and_belongs_to_nobody():
    victim = radar(front_end=FrontEnd(offset=Offset(power=4e-6, phase=math.pi / 2)))
    frame, parts = made(victim, HandPath(delay=1e-7))
    _, plain = made(radar(), HandPath(delay=1e-7))
    assert parts["distortion"] == pytest.approx(2e-3j, rel=1e-12)
    assert np.array_equal(parts["echo"], plain["echo"])
    assert frame.samples == pytest.approx(plain.total() + 2e-3j)


# ── saturation ──────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("ratio", [1.001, 1.5, 4.0])
def test_a_clipped_tone_keeps_what_its_describing_function_says(compare, ratio):
    """(2/π)(asin k + k√(1−k²)) of its amplitude, k = V/A, on I and Q alike."""
    k = 1.0 / ratio
    expected = 2 / np.pi * (math.asin(k) + k * math.sqrt(1 - k * k))
    out = digitised(Digitiser(full_scale=4.0), tone(2.0 * ratio))
    measured = line(out.samples, turns_per_sample=0.1 * GOLDEN) / (2.0 * ratio)
    assert out.is_overloaded.mean() == pytest.approx(
        min(1.0, 4 / np.pi * math.acos(k)), abs=2e-3
    )  # each branch is beyond 2·acos(k)/π of the time, at other times up to √2
    compare(
        page="impairments",
        case=f"tone {20 * math.log10(ratio):.2f} dB over full scale",
        quantity="describing function",
        expected=expected,
        measured=measured,
        tolerance=1e-4,
        source="clipping of a sine, closed form",
    )


def test_a_soft_amplifier_makes_the_third_harmonic_at_minus_three_beats(compare):
    """p = 1: v/√(1+v²/V²) ≈ v − v³/2V², and I³ + jQ³ of A e^{jθ} is A³(3e^{jθ} + e^{−3jθ})/4."""
    amplitude, scale = 0.05, 1.0
    out = digitised(Digitiser(full_scale=scale**2, softness=1.0), tone(amplitude)).samples
    image = line(out, turns_per_sample=-0.3 * GOLDEN)
    compare(
        page="impairments",
        case="Rapp, p = 1, tone 26 dB below saturation",
        quantity="third-order line, dB below the tone",
        expected=20 * math.log10(8 * scale**2 / amplitude**2),
        measured=20 * math.log10(amplitude / image),
        tolerance=0.05,
        source="series to third order; the fifth brings 0.03 dB",
    )
    assert line(out, turns_per_sample=0.3 * GOLDEN) < 1e-3 * image


def test_a_hard_rapp_curve_is_a_clip_and_stays_below_full_scale():
    x = tone(3.0)
    soft = digitised(Digitiser(full_scale=1.0, softness=300.0), x).samples
    hard = digitised(Digitiser(full_scale=1.0), x).samples
    assert np.abs(soft - hard).max() < 2**0.5 * (1 - 2 ** (-1 / 600)) * 1.01
    assert max(np.abs(soft.real).max(), np.abs(soft.imag).max()) <= 1.0


# ── quantisation ────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_a_full_scale_tone_has_six_decibels_per_bit(compare, bits):
    """3/2·4^b of signal to noise; the tone stops one step short of full scale."""
    step = 2.0 / 2**bits
    x = tone(1.0 - step, count=200_000)
    error = digitised(Digitiser(full_scale=1.0, bits=bits), x).samples - x
    compare(
        page="impairments",
        case=f"{bits} bits",
        quantity="signal to quantisation noise, dB",
        expected=10 * math.log10(1.5 * 4**bits * (1 - step) ** 2),
        measured=-10 * math.log10(np.mean(np.abs(error) ** 2) / (1 - step) ** 2),
        tolerance=0.15,
        source="6.02 b + 1.76 dB",
    )


def test_codes_are_whole_steps_from_minus_half_to_half_less_one():
    """Mid-tread: 3 bits at ±1 V have −1, −0.75, …, 0.75; zero is a code."""
    ramp_up = np.linspace(-2.0, 2.0, 801)[None, None] + 0j
    read = digitised(Digitiser(full_scale=1.0, bits=3), ramp_up).samples.real
    assert np.unique(read).tolist() == [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75]
    assert not digitised(Digitiser(full_scale=1.0, bits=3), 0j * ramp_up).samples.any()


def test_noise_read_with_fine_steps_gains_a_sixth_of_a_step_squared():
    """Δ²/12 for I and for Q; 4 × 481 samples of each, within 5σ of 0.9·Δ²/12/√n: 10 %."""
    noise = 10 ** (-95 / 10) * 1e-3  # −95 dBm: thermal noise of the default radar, about
    scale = noise * 4**6
    digitiser = Digitiser(full_scale=scale, bits=8)
    _, parts = made(radar(num_channels=4, front_end=FrontEnd(digitiser=digitiser)))
    step = 2 * math.sqrt(scale) / 2**8
    assert np.mean(np.abs(parts["distortion"]) ** 2) == pytest.approx(step**2 / 6, rel=0.1)


# ── gain control ────────────────────────────────────────────────────────────────────────────────


def test_gains_follow_the_former_ramp_in_steps():
    """Full scale 1, back-off 6.02 dB, steps of 6.02 dB: the largest 4^n with 4^n·peak² ≤ 1/4."""
    control = GainControl(step=4.0, least=4.0**-2, greatest=4.0**3, back_off=4.0)
    peaks = np.array([0.5, 0.1, 1e-9, 3.0, 100.0, 0.5])
    assert gains(control, 1.0, peaks) == pytest.approx([1.0, 1.0, 16.0, 64.0, 1 / 16, 1 / 16])


def test_gains_remember_as_many_ramps_as_they_are_told():
    control = GainControl(step=4.0, least=1e-3, greatest=1e3, back_off=1.0, num_ramps=2)
    assert gains(control, 1.0, np.array([2.0, 0.5, 0.5, 0.5])).tolist() == [0.25, 0.25, 0.25, 4.0]


def test_amplified_signals_are_quantised_finer_and_come_back_in_volts():
    """Error power Δ²/6 over the gain; 24 dB are the most that is given."""
    x = np.concatenate([tone(0.01, count=4000)] * 3, axis=1)
    coarse = Digitiser(full_scale=1.0, bits=8)
    fine = replace(coarse, gain_control=GainControl(greatest=from_db(24.0)))
    without, adjusted = digitised(coarse, x), digitised(fine, x)
    assert adjusted.gain == pytest.approx(from_db(24.0))
    step = 2.0 / 2**8
    errors = [np.mean(np.abs(out.samples - x) ** 2) for out in (without, adjusted)]
    assert errors == pytest.approx([step**2 / 6, step**2 / 6 / from_db(24.0)], rel=0.25)


def test_a_gain_that_was_right_for_the_former_ramp_clips_a_stronger_one():
    quiet, loud = tone(0.01, count=500), tone(0.9, count=500)
    frame = np.concatenate([quiet, loud, loud], axis=1)
    control = GainControl(greatest=from_db(40.0))
    out = digitised(Digitiser(full_scale=1.0, gain_control=control), frame)
    assert out.is_overloaded.any(axis=(0, 2)).tolist() == [False, True, False]
    assert np.abs(out.samples[0, 2] - frame[0, 2]).max() < 1e-15


# ── the sum ─────────────────────────────────────────────────────────────────────────────────────


def everything():
    return FrontEnd(
        high_pass=HighPass(corners=(20e3,)),
        imbalance=IqImbalance(gain=from_db(0.5), phase=0.02),
        offset=Offset(power=1e-9),
        digitiser=Digitiser(full_scale=1e-8, bits=10, softness=3.0, gain_control=GainControl()),
    )


def crossing():
    """An echo, and a strong interferer that sweeps through the band in mid-ramp."""
    sweep = replace(plan(num_ramps=2, slope=-1e12), start_frequency=[79e9 + 0.5e9] * 2)
    paths = (HandPath(delay=1e-7, gain=1e-5), HandPath(delay=0.0, gain=1e-2, transmitter=1))
    return {"others": (radar("other"),), "plans": [plan(num_ramps=2), sweep]}, paths


def test_parts_sum_to_the_samples_and_the_linear_ones_do_not_know_of_each_other():
    options, paths = crossing()
    victim = radar(num_channels=2, front_end=everything())
    frame, parts = made(victim, *paths, **options)
    _, alone = made(victim, paths[0], **options)
    assert parts.names == (*PARTS[:5], "distortion")
    assert np.array_equal(frame.samples, parts.samples.sum(axis=0))
    assert np.array_equal(frame.samples, parts.total())
    assert np.array_equal(parts["echo"], alone["echo"])
    assert np.abs(parts["distortion"]).max() > 10 * np.abs(alone["distortion"]).max()


def test_samples_are_codes_over_the_gain():
    options, paths = crossing()
    victim = radar(num_channels=2, front_end=everything())
    frame, parts = made(victim, *paths, **options)
    read = reading(victim, parts, frame.times)
    step = 2 * math.sqrt(1e-8) / 2**10 / np.sqrt(read.gain)[:, None]
    codes = frame.samples / step
    assert np.abs(codes - np.rint(codes.real) - 1j * np.rint(codes.imag)).max() < 1e-9
    assert frame.samples == pytest.approx(read.samples, abs=1e-15)


def test_an_interferer_overloads_while_it_is_in_band():
    """It crosses ±0.5 MHz within 0.5 µs of mid-ramp, and rings for the filter's 7 µs."""
    options, paths = crossing()
    victim = radar(front_end=FrontEnd(digitiser=Digitiser(full_scale=1e-8)))
    frame, parts = made(victim, *paths, **options)
    over = reading(victim, parts, frame.times).is_overloaded
    assert over.any()
    middle = plan(num_ramps=2).start_time[:, None] + 250e-6
    assert np.abs(frame.times.time - middle)[over[0]].max() < 8e-6


def test_what_is_equal_is_made_again():
    options, paths = crossing()
    victim = radar(front_end=everything())
    first, again = (made(victim, *paths, **options)[0] for _ in range(2))
    assert np.array_equal(first.samples, again.samples)


def test_a_radar_without_a_front_end_has_five_parts_and_no_reading():
    frame, parts = made(radar())
    assert parts.names == PARTS[:5]
    assert parts.samples.shape[0] == 5
    assert not parts["distortion"].any()
    with pytest.raises(InputError, match="give its front end one"):
        reading(radar(), parts, frame.times)
