"""The stated false-alarm probability and the rejection of side lobes decide what is detected."""

import numpy as np
import pytest

from polychirp.receiver.chain import Receiver
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=4, streams=Streams(2))
FRAMES = 10


def detected_share(*, false_alarm_probability):
    """Share of frames in which a weak point is detected within a range cell of its place."""
    receiver = Receiver(false_alarm_probability=false_alarm_probability)
    point = HandPoint(range=12.0, range_rate=3.0, power=1.5e-3)
    detections = [receiver.detect(frame_of(RAMPS, [point], seed=seed)) for seed in range(FRAMES)]
    return np.mean([np.any(np.abs(found.range - 12.0) < 0.2) for found in detections])


def test_a_weak_point_is_detected_if_more_false_alarms_are_accepted():
    """Per ramp the point has 4 times the noise's power, 1.6 nepers in the mean of logarithms.

    Eight ramps of noise alone exceed their median by 0.8 nepers in 5 % of the cells, and by 2.1 in
    1e-12 of them: the point is between the two thresholds.
    """
    assert detected_share(false_alarm_probability=5e-2) >= 0.6
    assert detected_share(false_alarm_probability=1e-12) <= 0.2


@pytest.mark.parametrize(("ratio", "is_kept"), [(10**2.6, False), (10**1.0, True)])
def test_a_point_far_below_a_neighbour_counts_as_its_side_lobe(ratio, is_kept):
    """26 dB below, in the same range cell and 2.5 m/s apart, against 10 dB below.

    The frame resolves 2.5 m/s: without the rejection both pairs are two detections.
    """
    strong = HandPoint(range=12.0, range_rate=3.0, power=1e2)
    weak = HandPoint(range=12.02, range_rate=5.5, power=1e2 / ratio)
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    found = Receiver().detect(frame_of(ramps, [strong, weak]))
    near = np.abs(found.range_rate - 5.5) < 0.3
    assert np.any(np.abs(found.range_rate - 3.0) < 0.3)
    assert bool(np.any(near)) is is_kept
