"""Powers of blocks of range rates against sums over the ramps, one range rate after the other."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.radar import Converter
from polychirp.receiver.coherent.coherent_map import MapLimits, map_axes
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.profiles import STEPS_PER_RANGE, Profiles, shifts
from polychirp.receiver.coherent.rate_blocks import (
    MOST_DRIFT,
    MOST_LOSS,
    Lines,
    powers,
    rates_per_block,
)
from polychirp.receiver.coherent.spectra import Spectra
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of
from tests.support.profiles import in_order
from tests.support.schedules import drawn_chirps

FAST = Converter(sample_rate=20e6, start=2e-6, margin=1e-6)
FRAMES = {
    "equal": (Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule, None),
    "diverse": (DiverseTriangular().schedule, None),
    "chirps": (lambda **_: drawn_chirps(63, seed=4), FAST),
}


def profiled(kind, greatest_speed):
    schedule, converter = FRAMES[kind]
    points = [HandPoint(range=12.3, range_rate=-7.7, power=0.5)]
    one = frame_of(schedule(num_sweeps=8, streams=Streams(3)), points, converter=converter)
    seen = Observation.of(one, mitigated(None, one))
    limits = MapLimits(range=(0.5, 20.0), range_rate=(-greatest_speed, greatest_speed))
    axes = map_axes(seen, limits)
    return seen, Profiles.of(seen, Spectra.of(seen, seen.samples), axes)


def starts(profiles, size):
    """First range rate of the block in which each range rate is; the last block ends the axis."""
    count = profiles.axes.range_rate.size
    row = np.arange(count)
    return np.where(row < count - size, row // size * size, count - size)


def phasors(seen, profiles, row):
    """Places and phasors of the ramps at range rates, with lines in place of cosines and sines."""
    axes, size = profiles.axes, rates_per_block(seen, profiles)
    middle = axes.range_rate[starts(profiles, size)[row]] + 0.5 * (size - 1) * axes.range_rate_step
    place, turn = profiles.places(seen, middle)
    omega = 4 * np.pi / SPEED_OF_LIGHT * seen.frequency * (seen.middle - seen.model.time)
    offset = axes.range_rate_step * (np.arange(size // 2) + 0.5)
    length = Lines.of(omega, offset).length
    exact = np.exp(-1j * omega * (axes.range_rate[row] - middle)[:, None])
    near = exact.copy()
    for first in range(0, omega.size if length else 0, max(length, 1)):
        own = slice(first, first + length)
        line = np.stack([np.ones_like(omega[own]), omega[own]], axis=1)
        factors = np.linalg.lstsq(line, exact[:, own].T, rcond=1e-9)[0]
        near[:, own] = (line @ factors).T
    return place, turn * near, turn * exact


@pytest.mark.parametrize("greatest_speed", [0.02, 12.0])
@pytest.mark.parametrize("kind", FRAMES)
def test_the_power_is_that_of_the_sum_of_all_ramps(kind, greatest_speed):
    """Sums of some 10² products in single precision are right to 10⁻⁵ of the greatest."""
    seen, profiles = profiled(kind, greatest_speed)
    axes = profiles.axes
    fast = powers(seen, profiles)
    row = np.unique(np.random.default_rng(2).integers(0, axes.range_rate.size, 40))
    place, turn, _ = phasors(seen, profiles, row)
    (real, imag), weight = in_order(profiles.value), in_order(profiles.weight)
    value = real + 1j * imag
    ramp = np.arange(seen.middle.size)[:, None]
    for n in range(row.size):
        column = place[n][:, None] + STEPS_PER_RANGE * np.arange(axes.range.size)
        total = np.einsum("k,mki->mi", turn[n], value[:, ramp, column])
        slow = np.sum(np.abs(total) ** 2, axis=0) / weight[ramp, column].sum(axis=0)
        assert fast[row[n]] == pytest.approx(slow, rel=1e-3, abs=1e-5 * float(fast.max()))


@pytest.mark.parametrize("kind", FRAMES)
def test_lines_lose_a_tenth_of_a_decibel_at_most(kind):
    """The power of a point over that of noise, both after sums with the phasors of lines."""
    seen, profiles = profiled(kind, 12.0)
    _, near, exact = phasors(seen, profiles, np.arange(profiles.axes.range_rate.size))
    matched = np.abs(np.sum(near * exact.conj(), axis=1)) ** 2
    gain = matched / np.sum(np.abs(near) ** 2, axis=1) / seen.middle.size
    assert 10.0 * np.log10(np.min(gain)) > -0.1
    assert np.min(gain) >= 1.0 - MOST_LOSS


@pytest.mark.parametrize("kind", FRAMES)
def test_profiles_of_a_block_stand_no_further_from_their_places_than_stated(kind):
    seen, profiles = profiled(kind, 12.0)
    axes, size = profiles.axes, rates_per_block(seen, profiles)
    middle = axes.range_rate[starts(profiles, size)] + 0.5 * (size - 1) * axes.range_rate_step
    place = profiles.places(seen, middle)[0] + profiles.first
    true = shifts(seen, axes.range_rate) * STEPS_PER_RANGE / axes.range_step
    assert size >= 2
    assert np.max(np.abs(true - place)) <= 0.5 + MOST_DRIFT
