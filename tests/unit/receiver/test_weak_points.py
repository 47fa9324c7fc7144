"""Points hardly above the thresholds."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.receiver.chain import Receiver
from polychirp.receiver.estimation.azimuth_rate import TYPICAL_CROSSING_SPEED
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of


@pytest.mark.parametrize("trial", [48, 95, 98])
def test_an_acceleration_that_weak_beats_invent_does_not_spoil_the_rate(trial):
    """At -28 dB per sample, frames in which beats alone give 9 to 16 m/s² and 0.12 to 0.4 m/s.

    Without the phases the rate is off by 34 to 106 bounds, of 4 mm/s; with them, by no more than 4.
    """
    draw = np.random.default_rng([1, trial])
    point = HandPoint(
        range=draw.uniform(4.0, 26.0),
        range_rate=draw.uniform(-25.0, 25.0),
        acceleration=draw.uniform(-3.0, 3.0),
        azimuth=draw.uniform(-0.87, 0.87),
        power=10.0**-2.8,
    )
    sine_rate = TYPICAL_CROSSING_SPEED / point.range * draw.normal()
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    found = Receiver().detect(
        frame_of(ramps, [replace(point, sine_rate=sine_rate)], seed=100_003 + trial)
    )
    assert found.range_rate[0] == pytest.approx(point.range_rate, abs=0.016)


@pytest.mark.parametrize("waveform", [Triangular(), DiverseTriangular()], ids=lambda w: w.kind)
@pytest.mark.parametrize("level", [-26, -24, -22])
def test_a_weak_point_in_noise_is_not_taken_for_two(waveform, level):
    """8 drawn points each, in noise that leaves a fifth of the phases' power unexplained.

    With a pair accepted for its share of the power alone, a quarter to a half of such frames have
    another detection beside the point.
    """
    for trial in range(8):
        draw = np.random.default_rng([16, trial])
        point = HandPoint(
            range=draw.uniform(4.0, 26.0),
            range_rate=draw.uniform(-25.0, 25.0),
            acceleration=0.0,
            azimuth=draw.uniform(-0.87, 0.87),
            power=10.0 ** (level / 10),
        )
        ramps = waveform.schedule(num_sweeps=16, streams=Streams(trial))
        found = Receiver().detect(frame_of(ramps, [point], seed=200_003 + trial))
        assert found.range == pytest.approx([point.range], abs=0.03)
