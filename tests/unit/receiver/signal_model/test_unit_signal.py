"""The recurrences of a point's signal against its phase at every sample."""

import numpy as np
import pytest

from polychirp.receiver.signal_model.unit_signal import unit_signal_into


@pytest.mark.parametrize("count", [1, 15, 16, 17, 1000])
def test_recurrences_give_the_phase_of_every_sample(count):
    draw, rate = np.random.default_rng(count), 2e6
    for _ in range(20):
        phase = draw.uniform(-1.0, 1.0, 3) * [1e4, 0.5 * rate, 1e9]
        time = np.arange(count) / rate
        cycles = phase[0] + time * (phase[1] + 0.5 * time * phase[2])
        real, imag = np.empty(count), np.empty(count)
        unit_signal_into(real, imag, phase, rate)
        assert real + 1j * imag == pytest.approx(np.exp(2j * np.pi * cycles), abs=1e-8)
