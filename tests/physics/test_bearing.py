"""Root-MUSIC: the sign of an azimuth from geometry, its spread from the Cramér–Rao bound."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.receiver.angle.doa import root_music

FREQUENCY = 79e9


@pytest.mark.parametrize("azimuth", [-1.0, -0.3, 0.0, 0.3, 1.0])
def test_a_source_on_the_left_has_a_positive_azimuth(azimuth: float):
    """From geometry alone: delays from a far source to every element, y = tx · conj(rx).

    The source is at 10⁵ m, so that its wave front bends by less than 1e-8 of a wavelength over
    the array; delays are differences of lengths of that size, hence the tolerance.
    """
    array = AntennaArray(num_channels=4, spacing=0.5 * SPEED_OF_LIGHT / FREQUENCY)
    direction = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    # distance to the element minus that to the origin, for a plane wave
    delay = -(array.position @ direction) / SPEED_OF_LIGHT
    transmitted = 1.0
    received = np.exp(-2j * np.pi * FREQUENCY * delay)  # s(t − τ) at t = 0
    beat = transmitted * received.conj()
    sine = root_music(beat[None, :, None], spacing=0.5)
    assert np.arcsin(sine[0]) == pytest.approx(azimuth, abs=1e-12)


@pytest.mark.parametrize("num_elements", [4, 8, 16])
@pytest.mark.parametrize("num_snapshots", [1, 16])
def test_the_spread_of_an_azimuth_is_near_the_cramer_rao_bound(num_elements, num_snapshots):
    r"""One source of unknown amplitude and phase per snapshot, 20 dB per element and snapshot.

    Rife and Boorstyn 1974, with complex noise of total power σ²:
    var(ω) ≥ 6σ² / (A² L N(N² − 1)); the sine is ω/π at half-wave spacing. Of 2000 trials the
    standard deviation is known to 1/√4000 = 1.6 %; 5 % is three of those.
    """
    trials, snr = 2000, 100.0
    random = np.random.default_rng([num_elements, num_snapshots])
    sine = random.uniform(-0.8, 0.8, trials)
    shape = (trials, num_elements, num_snapshots)
    wave = np.exp(-1j * np.pi * np.arange(num_elements)[:, None] * sine[:, None, None])
    wave = wave * np.exp(2j * np.pi * random.random((trials, 1, num_snapshots)))
    noise = (random.normal(size=shape) + 1j * random.normal(size=shape)) / np.sqrt(2 * snr)
    error = root_music(wave + noise, spacing=0.5) - sine
    variance = 6.0 / (snr * num_snapshots * num_elements * (num_elements**2 - 1))
    assert np.sqrt(np.mean(error**2)) == pytest.approx(np.sqrt(variance) / np.pi, rel=0.05)
