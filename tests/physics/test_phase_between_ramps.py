"""The phase of a free-running oscillator is the integral of its frequency."""

import numpy as np
import pytest
from scipy.integrate import quad

from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular


@pytest.mark.parametrize("family", [Triangular(), DiverseTriangular()])
def test_every_ramp_starts_with_the_phase_at_which_the_last_one_ended(family):
    """Cycles from one ramp's start to the next, by quadrature of f + bt; whole cycles are nothing.

    A ramp has 1e8 cycles, of which double precision keeps 1e-8.
    """
    ramps = family.schedule(num_sweeps=3, streams=Streams(2))
    for k in range(ramps.num_ramps - 1):
        frequency = lambda t, k=k: ramps.start_frequency[k] + ramps.slope[k] * t  # noqa: E731
        cycles, _ = quad(frequency, 0.0, ramps.duration[k])
        jump = ramps.start_phase[k + 1] - ramps.start_phase[k] - cycles
        assert abs(jump - np.round(jump)) < 1e-5
