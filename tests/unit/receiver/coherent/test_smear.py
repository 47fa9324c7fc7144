"""Motions of bodies that pass nearby, from the powers of single ramps."""

import numpy as np
import pytest

from polychirp.receiver.coherent import new_points, smear
from polychirp.receiver.coherent.acceleration import GREATEST_ACCELERATION
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.smear import likeliest_motions
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth, Triangular
from tests.support.points import HandPoint, frame_of, true_motions


def passer(random):
    """A point at 15 to 25 m/s, 2.2 to 3.5 m beside the radar and 1 to 3 m ahead."""
    ahead, speed = random.uniform(1.0, 3.0), random.uniform(15.0, 25.0)
    beside = random.uniform(2.2, 3.5) * random.choice((-1.0, 1.0))
    distance = float(np.hypot(ahead, beside))
    return HandPoint(
        range=distance,
        range_rate=-speed * ahead / distance,
        acceleration=(speed * beside) ** 2 / distance**3,
        azimuth=float(np.arctan2(beside, ahead)),
        sine_rate=speed * ahead * beside / distance**3,
        power=10.0 ** random.uniform(0.0, 4.0),
    )


DIVERSE, EQUAL = DiverseTriangular(), Triangular(bandwidth=1e9, ramp_duration=1e-3)


def observed(number, waveform=DIVERSE):
    """A passer on triangles, the schedule and the frame."""
    point = passer(np.random.default_rng(number))
    schedule = waveform.schedule(num_sweeps=16, streams=Streams(number))
    return point, schedule, frame_of(schedule, [point], seed=number)


@pytest.mark.parametrize("beside", [(0.2, 2.0), (-0.2, -3.0)])
def test_the_motion_is_found_from_metres_per_second_beside_it(beside):
    """To a ramp's resolution: 0.19 m and λ/2T, 1.3 m/s for ramps of 1.5 ms."""
    point, schedule, frame = observed(7003)
    seen = Observation.of(frame, mitigated(None, frame))
    true = true_motions(schedule, [point])[0]
    start = Points(
        motion=np.array([[true[0] + beside[0], true[1] + beside[1], 0.0, 0.0]]),
        amplitude=np.zeros((1, 4), dtype=np.complex128),
        floor=np.ones(1),
        sine=np.zeros(1),
        growth=np.zeros(1),
        power=np.ones(1),
    )
    found = likeliest_motions(seen, Residual.of(seen, Points.none(4)), start)[0]
    assert abs(found[0] - true[0]) < 0.2
    assert abs(found[1] - true[1]) < 1.3


@pytest.mark.parametrize(
    ("waveform", "direction"),
    [(EQUAL, 1.0), (EQUAL, -1.0), (Sawtooth(bandwidth=1e9, ramp_duration=1e-3), 1.0)],
)
def test_motions_are_tried_that_have_the_beats_of_one_kind_of_ramps(waveform, direction):
    schedule = waveform.schedule(num_sweeps=16, streams=Streams(1))
    frame = frame_of(schedule, [])
    seen = Observation.of(frame, mitigated(None, frame))
    motion = np.array([[12.0, -8.0, 0.0, 0.0]]) + smear._offsets(seen)
    kind = np.sign(schedule.slope) == direction
    beat = seen.model.beats(motion[:, 0], motion[:, 1])[:, kind].mean(axis=1)
    start = seen.model.beats(np.array([12.0]), np.array([-8.0]))[:, kind].mean()
    rates = motion[np.abs(beat - start) < 0.02 / waveform.ramp_duration, 1]
    assert np.ptp(rates) > seen.duration * GREATEST_ACCELERATION


def read(numbers=range(8000, 8060), waveform=DIVERSE):
    """Numbers of drawn passers, of those found, and of detections, on seeds not used in tuning."""
    found = detections = drawn = 0
    for number in numbers:
        point, schedule, frame = observed(number, waveform)
        if point.acceleration > 125.0:
            continue  # faster than the receiver reads
        seen = CoherentReceiver().detect(frame)
        distance, rate, *_ = true_motions(schedule, [point])[0]
        is_near = (np.abs(seen.range - distance) < 0.3) & (np.abs(seen.range_rate - rate) < 0.5)
        found += bool(np.any(is_near))
        detections += seen.num_detections
        drawn += 1
    return drawn, found, detections


@pytest.mark.slow
def test_passers_within_four_metres_are_found_with_fewer_others(monkeypatch):
    """With starts at the map's peaks alone some are lost, and more detections are false."""
    drawn, found, detections = read()
    monkeypatch.setattr(new_points, "likeliest_motions", lambda *given: given[2].motion)
    _, found_by_peaks, detections_by_peaks = read()
    assert found == drawn > found_by_peaks
    assert detections - found < 0.5 * (detections_by_peaks - found_by_peaks)


@pytest.mark.slow
@pytest.mark.parametrize("waveform", [DIVERSE, EQUAL], ids=["diverse", "equal"])
def test_99_of_100_passers_within_four_metres_are_found(waveform):
    drawn, found, _ = read(range(11000, 11200), waveform)
    assert drawn == 172
    assert found >= 0.99 * drawn
