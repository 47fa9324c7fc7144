"""Whether ramps move like one point."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.chain import Receiver
from polychirp.receiver.estimation.coherence_test import (
    CHANCE_COHERENCE_PROBABILITY,
    FALSE_REJECTION_PROBABILITY,
    HIGHEST_HALF_THRESHOLD,
    LEAST_COHERENCE,
    aligned,
    coherence,
    coherence_of_halves,
    half_threshold,
    is_on_both_slopes,
    least_coherence,
)
from polychirp.receiver.signal_model.point_signal import replica
from polychirp.rng import Streams
from polychirp.waveform import Triangular
from tests.support.points import HandPoint, frame_of

RAMPS = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(num_sweeps=16, streams=Streams(1))
MIDDLE = RAMPS.start_time + 0.5 * RAMPS.duration
FREQUENCY = RAMPS.centre_frequency


def turned(rate, acceleration):
    """Amplitudes of a point whose rate and acceleration were fitted that much wrong: (1, 1, K)."""
    elapsed = MIDDLE - MIDDLE.mean()
    way = rate * elapsed + 0.5 * acceleration * elapsed**2
    return np.exp(4j * np.pi * FREQUENCY / SPEED_OF_LIGHT * way)[None, None]


@pytest.mark.parametrize(("rate", "acceleration"), [(0.0, 0.0), (0.08, -9.0), (-0.1, 30.0)])
def test_one_point_coheres_whatever_its_fit_left_open(rate, acceleration):
    """Steps of a third of a cycle: at most an eighth of a cycle rms is lost, sinc² > 0.8."""
    assert coherence(turned(rate, acceleration), FREQUENCY, MIDDLE)[0] > 0.8


def test_a_false_pair_does_not_cohere():
    """Up-ramps of one echo with down-ramps of another, of a metre per second between them."""
    pair = turned(0.0, 0.0)
    pair[..., 1::2] = 1j * turned(1.1, 3.0)[..., 1::2]
    assert coherence(pair, FREQUENCY, MIDDLE)[0] < LEAST_COHERENCE


def test_noise_does_not_cohere():
    draw = np.random.default_rng(3)
    noise = draw.normal(size=(200, 4, 32)) + 1j * draw.normal(size=(200, 4, 32))
    assert coherence(noise, FREQUENCY, MIDDLE).max() < LEAST_COHERENCE


def test_an_echo_whose_phase_jumps_from_ramp_to_ramp_is_not_detected():
    """Strong on every ramp, but no body moves like that."""
    frame = frame_of(RAMPS, [])
    times = sample_times(RAMPS, Converter())
    signal = replica(RAMPS, times, motion=np.array([9.0, 3.0, 0.0]), time=0.0)
    phase = np.exp(2j * np.pi * np.random.default_rng(5).random(RAMPS.num_ramps))
    jumping = frame.with_samples(frame.samples + 30.0 * (phase[:, None] * signal))
    steady = frame.with_samples(frame.samples + 30.0 * signal)
    assert Receiver().detect(jumping).num_detections == 0
    assert Receiver().detect(steady).num_detections == 1


UP = RAMPS.slope > 0
HEARD = np.ones(RAMPS.num_ramps)


def halves(amplitude, present=HEARD, slope=RAMPS.slope):
    straight = aligned(amplitude, FREQUENCY, MIDDLE)[1]
    return coherence_of_halves(straight, slope=slope, present=present)


def is_whole(amplitude, present=HEARD, slope=RAMPS.slope):
    straight = aligned(amplitude, FREQUENCY, MIDDLE)[1]
    return is_on_both_slopes(straight, slope=slope, present=present)


def noise_like(amplitude, seed, power=1.0):
    draw = np.random.default_rng(seed)
    return np.sqrt(0.5 * power) * (
        draw.normal(size=amplitude.shape) + 1j * draw.normal(size=amplitude.shape)
    )


@pytest.mark.parametrize(("rate", "acceleration"), [(0.0, 0.0), (0.08, -9.0), (-0.1, 30.0)])
def test_a_point_coheres_on_both_halves_as_on_the_whole(rate, acceleration):
    point = turned(rate, acceleration)
    assert halves(point).min() > 0.7
    assert is_whole(point)[0]


def test_an_arm_coheres_by_a_half_and_is_not_on_the_other():
    """In phase on all up-ramps, noise 20 dB below on the others."""
    ridge = np.where(UP, turned(0.05, 4.0), 0.0) + noise_like(turned(0.0, 0.0), 1, 0.01)
    assert coherence(ridge, FREQUENCY, MIDDLE)[0] == pytest.approx(0.5, rel=0.1)
    assert coherence(ridge, FREQUENCY, MIDDLE)[0] > LEAST_COHERENCE
    assert halves(ridge)[0] == pytest.approx([2.0, 0.0], abs=0.4)
    assert not is_whole(ridge)[0]


def test_ramps_of_one_direction_have_no_second_half():
    rising = np.abs(RAMPS.slope)
    assert is_whole(turned(0.0, 0.0), slope=rising)[0]
    assert is_whole(turned(0.0, 0.0), slope=-rising)[0]


def test_a_half_that_mitigation_left_out_is_not_asked_for():
    """Nor do ramps without samples count as ramps without an echo."""
    silent = np.where(UP, turned(0.0, 0.0), 0.0)
    assert is_whole(silent, present=np.where(UP, HEARD, 0.0))[0]
    few = np.where(np.arange(RAMPS.num_ramps) < 20, 0.0, HEARD)
    assert halves(few * turned(0.0, 0.0), present=few)[0] == pytest.approx([1.0, 1.0], abs=0.02)


@pytest.mark.parametrize("sweeps", [4, 8])
def test_noise_takes_a_weak_point_for_an_arm_as_seldom_as_stated(sweeps):
    """Of the least coherence, on all channels alike, before corrections: 2 · 10⁵ draws of a half.

    With 8 ramps of a half and more, what is asked is `HIGHEST_HALF_THRESHOLD`, and it is rarer.
    """
    signal = np.sqrt(LEAST_COHERENCE / (1.0 - LEAST_COHERENCE))
    draw = np.random.default_rng(sweeps)
    shape = (200_000, 4, 2)
    mean = signal + np.sqrt(0.5 / sweeps) * draw.normal(size=shape) @ [1.0, 1j]
    share = np.sum(np.abs(mean) ** 2, axis=1) / (4.0 * (signal**2 + 1.0))
    least = half_threshold(num_ramps=sweeps, channels=4)
    expected = 0.5 * FALSE_REJECTION_PROBABILITY
    found = np.mean(share < least)
    assert least <= HIGHEST_HALF_THRESHOLD
    assert found <= expected + 3.0 * np.sqrt(expected / len(share))
    if least < HIGHEST_HALF_THRESHOLD:
        assert found == pytest.approx(expected, abs=3.0 * np.sqrt(expected / len(share)))


@pytest.mark.parametrize("sweeps", [4, 8, 16])
def test_points_that_pass_for_coherent_pass_both_halves(sweeps):
    """Of 4000 in noise, of any coherence above the threshold, no more than stated are refused."""
    ramps = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(
        num_sweeps=sweeps, streams=Streams(1)
    )
    middle = ramps.start_time + 0.5 * ramps.duration
    draw = np.random.default_rng(7)
    shape = (4000, 4, ramps.num_ramps)
    level = 10.0 ** draw.uniform(-0.2, 1.0, size=(4000, 1, 1))
    noisy = np.sqrt(level) + np.sqrt(0.5) * (draw.normal(size=(*shape, 2)) @ [1.0, 1j])
    share, straight = aligned(noisy, ramps.centre_frequency, middle)
    is_accepted = share >= LEAST_COHERENCE
    is_kept = is_on_both_slopes(straight, slope=ramps.slope, present=np.ones(ramps.num_ramps))
    lost = np.sum(is_accepted & ~is_kept)
    assert lost <= FALSE_REJECTION_PROBABILITY * np.sum(is_accepted) + 3.0 * np.sqrt(
        FALSE_REJECTION_PROBABILITY * np.sum(is_accepted)
    )


BEYOND = [
    HandPoint(range=12.0, range_rate=45.0, power=10.0),
    HandPoint(range=33.0, range_rate=-20.0, power=10.0),
]


@pytest.mark.parametrize("beyond", BEYOND)
def test_a_target_beyond_the_map_is_not_detected_in_it(beyond):
    """Too fast, or too far: its cross-pairing ridges cross the map 60 dB above the threshold."""
    target = HandPoint(range=9.0, range_rate=3.0, power=1.0)
    found = Receiver().detect(frame_of(RAMPS, [beyond, target]))
    assert found.range == pytest.approx([9.0], abs=5e-3)
    assert found.range_rate == pytest.approx([3.0], abs=5e-3)


# ── what is asked ───────────────────────────────────────────────────────────────────────────────


def test_bursts_from_one_direction_seldom_cohere_by_chance():
    """Of any amplitude on each of 16 ramps, the same on four channels."""
    ramps = 1.5e-3 * np.arange(16)
    frequency = np.full(16, 79.5e9)
    drawn = np.random.default_rng(4).standard_normal((20_000, 1, 16, 2)).view(np.complex128)
    found = coherence(np.repeat(drawn[..., 0], 4, axis=1), frequency, ramps)
    asked = least_coherence(frequency, ramps)
    assert np.mean(found >= asked) <= CHANCE_COHERENCE_PROBABILITY
    assert np.mean(found >= LEAST_COHERENCE) > 10 * CHANCE_COHERENCE_PROBABILITY


def test_of_many_ramps_no_more_is_asked():
    assert least_coherence(np.full(32, 79.5e9), 1.5e-3 * np.arange(32)) == LEAST_COHERENCE
