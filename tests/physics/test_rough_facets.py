"""A rough metal body echoes less of its wave coherently.

Heights with the standard deviation σ, at normal incidence, shift the phase of the echo by a
Gaussian variable of standard deviation 2kσ. The mean of its phasor is exp(−(2kσ)²/2), so that the
coherent power falls by exp(−(2kσ)²) (Ament 1953; Beckmann and Spizzichino 1963).
"""

import numpy as np
import pytest

from polychirp.channel.tracers.composite import Composite, NamedMaterial
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, transfer_at

WAVENUMBER = 2 * np.pi * 79e9 / SPEED_OF_LIGHT


def echo_power(roughness):
    material = NamedMaterial(name="cast", conductivity=np.inf, roughness=roughness)
    body = Actor(name="plate", kind="object", mesh=mesh_of(plate(0.1, 0.02), "cast"))
    tracer = Composite(materials=(material,), diffuse=False)
    paths = tracer.trace(around([body], [(20.0, 0.0, 0.0)]))
    return abs(transfer_at(paths, 79e9)[0, 0]) ** 2


@pytest.mark.parametrize("roughness", [0.1e-3, 0.3e-3])
def test_the_echo_of_a_rough_plate_falls_as_beckmann_says(roughness):
    expected = np.exp(-((2 * WAVENUMBER * roughness) ** 2))
    assert echo_power(roughness) / echo_power(0.0) == pytest.approx(expected, rel=0.02)
