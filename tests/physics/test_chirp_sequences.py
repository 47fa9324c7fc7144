"""Equal chirps, as most car radars transmit them, from the street to the score."""

import math
from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray, ElementPattern
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Converter
from polychirp.model.score import Score
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.receiver.selection import AnyReceiver
from polychirp.study.spec import Study, StudyRadar
from polychirp.study.trial import Trial, run_trial
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.units import from_db
from polychirp.waveform import DopplerDivision, PhaseCoded, Sawtooth, TimeDivision

WAVEFORM = Sawtooth(start_frequency=76.5e9, bandwidth=500e6, ramp_duration=25e-6, idle=10e-6)
SPAN = SPEED_OF_LIGHT / 76.75e9 / (2 * 35e-6)  # of the range rates that chirps 35 us apart tell
EGO = Vehicle(name="ego", x=0.0, y=0.0, coarseness=4.0)
RADAR = StudyRadar(
    name="front",
    vehicle="ego",
    mount=Pose(x=2.4, z=0.5),
    waveform=WAVEFORM,
    transmit_power=10e-3,
    noise_figure=from_db(13.0),
    array=AntennaArray(
        spacing=0.5 * SPEED_OF_LIGHT / 76.75e9,
        pattern=ElementPattern(peak_gain=from_db(13.0), azimuth_beamwidth=np.radians(90)),
    ),
    if_filter=IfFilter(passband=6e6, stopband=7e6),
    converter=Converter(sample_rate=14e6, start=2e-6, margin=1e-6),
)

READER = RangeDoppler(greatest_range=45.0)


def trial(seed: int, num_sweeps: int = 96, receiver: AnyReceiver = READER, **changes) -> Trial:
    """A car of 10 dBsm and a pedestrian of -8 dBsm at drawn places, with drawn range rates."""
    draw = np.random.default_rng([15, seed])

    def point(name: str, level: float, distance: float) -> Point:
        azimuth, rate = draw.uniform(-0.5, 0.5), draw.uniform(-0.48, 0.48) * SPAN
        ahead = np.array([np.cos(azimuth), np.sin(azimuth)])
        x, y = distance * ahead + [2.4, 0.0]
        velocity = rate * ahead
        return Point(
            name=name,
            x=float(x),
            y=float(y),
            z=0.5,
            rcs=from_db(level),
            velocity=(float(velocity[0]), float(velocity[1]), 0.0),
        )

    points = (
        point("car", 10.0, draw.uniform(15, 40)),
        point("pedestrian", -8.0, draw.uniform(8, 25)),
    )
    return run_trial(
        Study(
            name="chirps",
            seed=seed,
            num_sweeps=num_sweeps,
            street=Street(vehicles=(EGO,), points=points),
            radars=(replace(RADAR, **changes),),
            targets=("car", "pedestrian"),
            tracer=FreeSpace(),
            receiver=receiver,
        )
    )


def test_a_car_and_a_pedestrian_are_found_where_they_are():
    """12 drawn streets: both found in each, within a tenth of a cell, and nothing else.

    A cell is 0.31 m and 0.58 m/s; the weakest echo is some 20 dB above the noise of its cell. A
    wave front of 8 m or more and a Doppler shift beyond the carrier's bend the azimuth little.
    """
    scores = [trial(seed).victim("front").score for seed in range(12)]
    assert all(score.is_detected.all() for score in scores)
    assert max(np.abs(score.range_error).max() for score in scores) < 0.05
    assert max(np.abs(score.range_rate_error).max() for score in scores) < 0.06
    assert max(np.abs(score.azimuth_error).max() for score in scores) < np.radians(2.5)
    assert sum(len(score.nature) for score in scores) <= 24 + 1  # 1e-6 of 9000 cells, per frame
    assert {nature for score in scores for nature in score.nature} <= {"body", "target"}


@pytest.mark.parametrize("speed", [1.0, 2.2])
def test_the_coherent_receiver_finds_both_also_beyond_the_span_of_speeds(speed):
    """Range migration over the frame tells folds apart: searched are 1 and 2.2 spans of speeds."""
    reader = CoherentReceiver(greatest_range=45.0, greatest_speed=0.5 * speed * SPAN)
    scores = [trial(seed, receiver=reader).victim("front").score for seed in range(4)]
    assert all(score.is_detected.all() for score in scores)
    assert max(np.abs(score.range_error).max() for score in scores) < 0.05
    assert max(np.abs(score.range_rate_error).max() for score in scores) < 0.06
    assert max(np.abs(score.azimuth_error).max() for score in scores) < np.radians(2.5)
    assert sum(len(score.nature) for score in scores) <= 8 + 1
    assert {nature for score in scores for nature in score.nature} <= {"body", "target"}


@pytest.mark.parametrize(
    "coding", [TimeDivision(), DopplerDivision(num_bands=4), PhaseCoded()], ids=lambda c: c.kind
)
def test_coded_elements_keep_the_whole_span_of_speeds(coding):
    """Three elements read one range rate in three or four: the beam tells which it is."""
    array = replace(RADAR.array, num_transmitters=3)
    scores = [
        trial(seed, coding=coding, array=array).victim("front").score for seed in range(20, 28)
    ]
    found = np.array([score.is_detected for score in scores])
    assert found.mean() >= 15 / 16
    errors = np.abs(np.array([score.range_rate_error for score in scores]))[found]
    assert errors.max() < 0.06
    angles = np.abs(np.array([score.azimuth_error for score in scores]))[found]
    assert angles.max() < np.radians(1.0)


def score_of_a_point(level: float, seed: int) -> Score:
    """Score of a point of ``level`` dBsm, 20 m ahead of the radar."""
    point = Point(name="point", x=22.4, y=0.0, z=0.5, rcs=from_db(level))
    study = Study(
        name="one",
        seed=seed,
        num_sweeps=96,
        street=Street(vehicles=(EGO,), points=(point,)),
        radars=(replace(RADAR, transmit_gain=1.0),),
        targets=("point",),
        tracer=FreeSpace(frequency=76.75e9),
        receiver=RangeDoppler(greatest_range=45.0),
    )
    return run_trial(study).victim("front").score


def test_the_snr_of_a_target_is_that_of_the_radar_equation_found_or_not():
    """SNR = P λ² G² σ M T / ((4π)³ R⁴ k T₀ F L): T is the sampled time, L the loss of both tapers.

    Sampled are 22 µs of each of 96 ramps, in 4 channels. A taper w of n samples loses n Σw²/(Σw)².
    The noise is a mean over cells about the target: 16 frames know it to 1 %. Another 26 dB less is
    not detected.
    """
    wavelength = SPEED_OF_LIGHT / 76.75e9
    received = 10e-3 * from_db(26.0) * wavelength**2 * from_db(-10.0) / ((4 * np.pi) ** 3 * 20.0**4)
    energy = received * 4 * 96 * (1 + round(22e-6 * 14e6)) / 14e6
    loss = math.prod(n * np.sum(taper(n) ** 2) for n in (96, 1 + round(22e-6 * 14e6)))
    expected = energy / (1.380649e-23 * 290.0 * from_db(13.0) * loss)
    strong = [score_of_a_point(-10.0, seed) for seed in range(16)]
    assert all(score.is_detected[0] for score in strong)
    noise = np.mean([1.0 / score.snr[0] for score in strong])
    assert 1.0 / noise == pytest.approx(expected, rel=0.03)
    weak = score_of_a_point(-36.0, seed=0)
    assert not weak.is_detected[0]
    assert weak.snr[0] == pytest.approx(from_db(-26.0) * strong[0].snr[0], rel=1e-6)
    assert strong[0].inr[0] == 0.0
    assert strong[0].mitigated_sinr[0] == strong[0].snr[0]
