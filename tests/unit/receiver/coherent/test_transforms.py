"""Transforms of ramps, their energies and their levels, against sums over all samples."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.spectra import BINS_PER_SAMPLE, Spectra, transform_size
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=6, streams=Streams(2))
"""Their numbers of samples differ; some are even."""


def observed():
    one = frame_of(RAMPS, [], noise=1.0, seed=1)
    return Observation.of(one, mitigated(None, one))


def transforms(seen, beat):
    """Sums over the samples of every ramp at beats ``(ramp, step)``, ``(channel, ramp, step)``."""
    out = np.empty((len(seen.samples), *beat.shape), dtype=np.complex128)
    for k, count in enumerate(seen.model.times.num_samples):
        time = (np.arange(count) - 0.5 * (count - 1)) / seen.model.times.rate
        out[:, k] = seen.samples[:, k, :count] @ np.exp(-2j * np.pi * beat[k] * time[:, None])
    return out


def test_transforms_refer_to_the_middle_of_every_ramp():
    seen = observed()
    counts = seen.model.times.num_samples
    assert 0 < np.sum(counts % 2) < counts.size
    found = Spectra.of(seen, seen.samples).value
    bins = np.random.default_rng(1).integers(0, found.shape[1], (counts.size, 5))
    exact = transforms(
        seen,
        (bins / found.shape[1] + 0.5) % 1.0 * seen.model.times.rate - 0.5 * seen.model.times.rate,
    )
    values = found[np.arange(counts.size)[:, None], bins].transpose(2, 0, 1)
    assert values == pytest.approx(exact, abs=1e-4 * np.sqrt(counts.max()))


def test_values_between_bins_are_right_to_a_per_cent():
    seen = observed()
    rate, draw = seen.model.times.rate, np.random.default_rng(2)
    first, last = draw.uniform(-0.5 * rate, 0.5 * rate, (2, RAMPS.num_ramps))
    step = (last - first) / 39
    parts = Spectra.of(seen, seen.samples).at(seen, first, step, 40)
    found = parts[0::2] + 1j * parts[1::2]
    error = found - transforms(seen, first[:, None] + step[:, None] * np.arange(40))
    assert np.sqrt(np.mean(np.abs(error) ** 2) / seen.count.mean()) < 0.01


def test_energies_hold_the_weights_of_frequencies_and_the_mixing_of_channels():
    seen = observed()
    draw = np.random.default_rng(3)
    mixing = draw.normal(size=(4, 4)) + 1j * draw.normal(size=(4, 4))
    weight = draw.uniform(size=(RAMPS.num_ramps, 24))
    seen = replace(seen, mixing=mixing, weight=weight)
    residual = Residual.of(seen, Points.none(4))
    bins = transform_size(seen) // BINS_PER_SAMPLE
    value = np.fft.fft(seen.samples, bins, axis=2)
    share = weight[:, np.rint(np.arange(bins) * 24 / bins).astype(int) % 24]
    power = np.sum(np.abs(np.einsum("ab,bkn->akn", mixing, value)) ** 2, axis=0)
    assert residual.energy == pytest.approx(np.sum(power * share) / bins, rel=1e-6)


def test_powers_with_hanns_window_are_those_of_windowed_samples():
    """Its length is that of a whole number of bins, so that it ends a little beside the ramp's end;
    in noise both have the same power in every bin but for the difference of the windows."""
    seen = observed()
    found = Spectra.of(seen, seen.samples).hann_power(seen, 2)
    bins = 2 * found.shape[1]
    slow = np.empty_like(found)
    for k, count in enumerate(seen.model.times.num_samples):
        time = np.arange(count) - 0.5 * (count - 1)
        window = 0.5 + 0.5 * np.cos(2 * np.pi * np.rint(bins / count) / bins * time)
        value = np.fft.fft(seen.samples[:, k, :count] * window, bins, axis=1)[:, ::2]
        slow[k] = np.mean(np.abs(value) ** 2, axis=0) / np.sum(window**2)
    assert found == pytest.approx(slow, rel=1e-3, abs=1e-5)
    assert found.mean() == pytest.approx(1.0, rel=0.05)
