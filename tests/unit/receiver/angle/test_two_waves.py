"""Two plane waves in one snapshot: found where there are two, and not where there is one."""

import numpy as np
import pytest

from polychirp.receiver.angle.two_waves import two_waves


def wave(sine, count=4, spacing=0.5):
    return np.exp(-2j * np.pi * spacing * sine * np.arange(count))


def noise(seed, count=4):
    draw = np.random.default_rng(seed)
    return np.sqrt(0.5) * (draw.normal(size=count) + 1j * draw.normal(size=count))


@pytest.mark.parametrize("count", [4, 6, 12])
def test_two_waves_without_noise_are_found_exactly(count):
    snapshot = 1e4 * wave(-0.3, count) + 4e3j * wave(0.25, count)
    found = two_waves(snapshot, spacing=0.5)
    assert found.sine == pytest.approx([-0.3, 0.25], abs=2e-3)
    assert np.abs(found.amplitude) == pytest.approx([1e4, 4e3], rel=0.02)


def test_two_waves_one_cell_apart_are_found_in_noise():
    """20 dB in the beam of four elements each; the phases are drawn."""
    found = 0
    for seed in range(100):
        draw = np.random.default_rng([7, seed])
        first = draw.uniform(-0.75, 0.25)
        turn = 5.0 * np.exp(2j * np.pi * draw.uniform(size=2))
        waves = turn[0] * wave(first) + turn[1] * wave(first + 0.5)
        pair = two_waves(waves + noise(seed), spacing=0.5)
        found += pair is not None and np.allclose(
            np.sort(pair.sine), [first, first + 0.5], atol=0.2
        )
    assert found >= 90


@pytest.mark.parametrize("amplitude", [0.0, 3.0, 30.0, 3000.0])
def test_one_wave_in_noise_is_not_taken_for_two(amplitude):
    """At a stated probability of 1e-4, 500 snapshots have none, or one at most."""
    pairs = 0
    for seed in range(500):
        sine = np.random.default_rng([8, seed]).uniform(-0.95, 0.95)
        pairs += two_waves(amplitude * wave(sine) + noise(seed), spacing=0.5) is not None
    assert pairs <= 1


def test_a_small_error_of_a_strong_wave_is_no_second_wave():
    wrong = 1e4 * wave(0.2) * (1.0 + 0.02 * np.array([1.0, -1.0, 1.0, -1.0]))
    assert two_waves(wrong, spacing=0.5) is None


@pytest.mark.parametrize("count", [1, 2, 3])
def test_fewer_than_four_elements_tell_no_two_waves(count):
    assert two_waves(100.0 * wave(0.1, count) + 90j * wave(0.6, count), spacing=0.5) is None
