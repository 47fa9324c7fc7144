"""Phase-shift beams."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.receiver.angle.beamform import beamform, orthogonal_sines, steering

ARRAY = AntennaArray()


def wave(azimuth, frequency=79e9):
    """Beats of a wave from ``azimuth``: an element nearer to it receives it earlier."""
    advance = ARRAY.position[:, 1] * np.sin(azimuth) / SPEED_OF_LIGHT
    return np.exp(-2j * np.pi * frequency * advance)[:, None, None]


@pytest.mark.parametrize("azimuth", [-0.7, 0.0, 0.3])
def test_a_beam_towards_a_wave_adds_all_channels(azimuth):
    """Four channels in phase: four times the power of one, where noise keeps that of one."""
    weights = steering(ARRAY, frequency=79e9, sine=np.array([np.sin(azimuth), -np.sin(azimuth)]))
    beams = np.abs(beamform(wave(azimuth), weights)[:, 0, 0]) ** 2
    assert beams[0] == pytest.approx(4.0)
    if azimuth:
        assert beams[1] < 1.5


def test_noise_is_independent_between_the_beams_of_the_fan():
    """Half a wavelength apart, the weights are orthonormal."""
    weights = steering(ARRAY, frequency=79e9, sine=orthogonal_sines(4))
    assert weights @ weights.conj().T == pytest.approx(np.eye(4), abs=1e-12)
