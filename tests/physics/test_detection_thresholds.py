"""The stated false-alarm probability decides what is detected."""

import numpy as np

from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of, true_motions

RAMPS = DiverseTriangular().schedule(num_sweeps=4, streams=Streams(2))
FRAMES = 10


def detected_share(*, false_alarm_probability):
    """Share of frames in which a point of 14 dB is detected within a range cell of its place."""
    receiver = CoherentReceiver(false_alarm_probability=false_alarm_probability)
    size = 4 * np.count_nonzero(frame_of(RAMPS, []).times.is_sample)
    point = HandPoint(range=12.0, range_rate=3.0, power=10.0**1.4 / size)
    true = true_motions(RAMPS, [point])[0, 0]
    detections = [receiver.detect(frame_of(RAMPS, [point], seed=seed)) for seed in range(FRAMES)]
    return np.mean([np.any(np.abs(found.range - true) < 0.2) for found in detections])


def test_a_weak_point_is_detected_if_more_false_alarms_are_accepted():
    """The ideal detector finds 93 % of such points at 1e-4, and 7 % of them at 1e-12."""
    assert detected_share(false_alarm_probability=1e-4) >= 0.6
    assert detected_share(false_alarm_probability=1e-12) <= 0.2
