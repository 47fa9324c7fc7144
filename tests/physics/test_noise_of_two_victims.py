"""Every radar has a receiver, and so noise, of its own."""

import numpy as np

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.rng import Streams
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.shapes import around
from polychirp.waveform import Triangular

RAMPS = Triangular().schedule(num_sweeps=2, streams=Streams(1))


def noise_of(victim, seed=1):
    scene = around([], [(0, 0, 0.5), (10, 3, 0.5)])
    _, parts = synthesize(
        Stretch(),
        scene,
        [RAMPS, RAMPS],
        [FreeSpace().trace(scene)],
        victim=victim,
        interferers=None,
        streams=Streams(seed),
    )
    noise = parts.noise
    return noise[noise != 0]


def test_the_noise_of_two_radars_is_independent():
    """The normalised correlation of N independent samples is below 5/√N but once in 10⁶ draws.

    The IF filter makes neighbouring samples alike, which leaves a third of N at least.
    """
    first, second = noise_of(0), noise_of(1)
    correlation = abs(np.vdot(first, second)) / (np.linalg.norm(first) * np.linalg.norm(second))
    assert correlation < 5 / np.sqrt(first.size / 3)


def test_the_same_seed_gives_the_same_noise_and_another_seed_another():
    np.testing.assert_array_equal(noise_of(0), noise_of(0))
    assert not np.any(noise_of(0) == noise_of(0, seed=2))
