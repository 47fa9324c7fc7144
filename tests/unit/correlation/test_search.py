"""Search for a reference in a long recording, block by block."""

from dataclasses import dataclass

import numpy as np
import pytest

from polychirp.correlation.search import search
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband

RATE = 1e6


def noise(count, seed=1):
    return np.random.default_rng(seed).standard_normal((count, 2)).view(complex)[:, 0]


def signal(samples, rate=RATE):
    return Baseband(samples=samples, sample_rate=rate)


def plain(samples, reference):
    """Values of ρ by its definition, one for each place."""
    size = reference.size
    out = []
    for n in range(samples.size - size + 1):
        piece = samples[n : n + size]
        out.append(
            abs(np.vdot(reference, piece)) / np.linalg.norm(piece) / np.linalg.norm(reference)
        )
    return np.array(out)


@pytest.mark.parametrize("block", [64, 100, 10_000])
def test_blocks_give_what_the_definition_gives(block):
    samples, reference = noise(1500), noise(40, 2)
    found = search(signal(samples), signal(reference), threshold=1.1, block=block)
    np.testing.assert_allclose(found.envelope, plain(samples, reference), atol=1e-12)


def test_every_repetition_is_found_at_any_level():
    """ρ is 1 where the reference is alone, 40 dB weaker or not, and across blocks."""
    reference = noise(50, 2)
    samples = np.zeros(5000, dtype=complex)
    places = [0, 255, 1000, 1050, 4950]
    for n, place in enumerate(places):
        samples[place : place + 50] = reference * 10.0 ** (-n / 2)
    found = search(signal(samples), signal(reference), threshold=0.9, block=256)
    np.testing.assert_allclose(found.lag * RATE, places, atol=1e-9)
    np.testing.assert_allclose(found.peak, 1.0, atol=1e-6)


def test_noise_lowers_a_peak_as_the_formula_says():
    """√(SNR/(1 + SNR)), with 2000 samples to ± 2 %."""
    reference = noise(2000, 2)
    samples = noise(20_000, 3)
    samples[7000:9000] += reference
    (peak,) = search(signal(samples), signal(reference), threshold=0.5).peak
    assert peak == pytest.approx(np.sqrt(0.5), abs=0.02)


def test_a_place_is_not_lost_to_one_that_is_lost_itself():
    """Of three places, each 30 samples apart, the middle one is lost to the last, the first stays.

    The greatest is kept, and what is half a length of 100 samples away from it or less is not."""
    reference = noise(100, 2)
    samples = np.zeros(1000, dtype=complex)
    for place, weight in ((300, 1.0), (330, 1.6), (360, 2.5)):
        samples[place : place + 100] += weight * reference
    for block in (64, 4096):
        found = search(signal(samples), signal(reference), threshold=0.25, block=block)
        np.testing.assert_allclose(found.lag * RATE, [300, 360], atol=1e-9)


def test_silence_is_no_peak():
    found = search(signal(np.zeros(1000)), signal(noise(10)), threshold=0.1)
    assert found.peak.size == 0
    assert np.all(found.envelope == 0.0)


@dataclass
class Counting:
    """A recording that remembers the largest piece it was asked for."""

    num_samples: int
    sample_rate: float = RATE
    centre_frequency: float = 0.0
    largest: int = 0

    def read(self, first, last):
        self.largest = max(self.largest, last - first)
        return np.exp(2j * np.pi * 0.1 * np.arange(first, last))


def test_a_long_recording_is_read_in_pieces_with_progress():
    recording = Counting(1_000_000)
    seen = []
    search(
        recording,
        signal(noise(100)),
        block=10_000,
        progress=lambda _, done, total: seen.append((done, total)),
    )
    assert recording.largest < 11_000
    assert seen[0] == (0, 999_901)
    assert seen[-1] == (999_901, 999_901)
    assert len(seen) > 50


@pytest.mark.parametrize(
    ("recording", "reference", "sentence"),
    [
        (signal(noise(10)), signal(noise(20)), "fewer than the reference's 20; record for longer"),
        (
            signal(noise(10), 2e6),
            signal(noise(5)),
            "resample the reference to the recording's rate",
        ),
        (signal(noise(10)), signal(np.zeros(5)), "the reference has no energy"),
    ],
)
def test_what_cannot_be_searched_is_refused(recording, reference, sentence):
    with pytest.raises(InputError, match=sentence):
        search(recording, reference)
