"""From samples to detections."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.front_end import HighPass
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.mitigation import Autoregression, Blanking, Imat, StftExcision
from polychirp.rng import Streams
from polychirp.units import from_db
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.interference import with_noisy_ramps
from tests.support.points import HandPoint, frame_of, true_motions

STREET = [
    HandPoint(range=5.0, range_rate=12.0, azimuth=-0.7, power=3e4),
    HandPoint(range=9.0, range_rate=-17.0, acceleration=6.0, azimuth=0.3, power=1e3),
    HandPoint(range=17.0, range_rate=0.2, azimuth=0.0, power=100.0),
    HandPoint(range=24.0, range_rate=25.0, azimuth=0.9, power=10.0),
]


@pytest.mark.parametrize("family", [Triangular(), DiverseTriangular()])
def test_every_point_is_found_once_with_its_range_rate_and_azimuth(family):
    """35 dB between them, ridges of the strong across the weak, range walk, an acceleration.

    The power is that in the middle of the frame.
    """
    ramps = family.schedule(num_sweeps=16, streams=Streams(2))
    found = CoherentReceiver().detect(frame_of(ramps, STREET))
    assert found.num_detections == len(STREET)
    for n, (point, true) in enumerate(zip(STREET, true_motions(ramps, STREET), strict=True)):
        assert found.range[n] == pytest.approx(true[0], abs=1e-3)
        assert found.range_rate[n] == pytest.approx(true[1], abs=5e-3)
        assert found.azimuth[n] == pytest.approx(true[3], abs=2e-3)
        power = point.power * (point.range / true[0]) ** 4
        assert found.power[n] == pytest.approx(power, rel=0.01)


@pytest.mark.parametrize("angle", ["root-music", "bartlett", "capon"])
def test_azimuths_are_found_by_any_of_the_methods(angle):
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    found = CoherentReceiver(angle=angle).detect(frame_of(ramps, STREET[1:3]))
    expected = true_motions(ramps, STREET[1:3])[:, 3]
    assert found.azimuth == pytest.approx(expected, abs=0.005)


def test_a_residue_margin_below_0_db_is_refused():
    with pytest.raises(InputError, match="choose 1 \\(0 dB\\) or more"):
        CoherentReceiver(residue_margin=0.5)


def test_an_unknown_estimator_of_azimuths_is_refused():
    with pytest.raises(InputError, match="not one of root-music, bartlett, capon"):
        CoherentReceiver(angle="music")


def test_points_below_the_dynamic_range_are_not_detected():
    ramps = Triangular().schedule(num_sweeps=16, streams=Streams(2))
    points = [HandPoint(range=5.0, power=1e6), HandPoint(range=20.0, power=30.0)]  # 45 dB
    frame = frame_of(ramps, points)
    for dynamic_range, expected in ((40.0, [5.0]), (50.0, [5.0, 20.0])):
        found = CoherentReceiver(dynamic_range=from_db(dynamic_range)).detect(frame)
        assert found.range == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    "mitigation",
    [Blanking(), Blanking(taper=8e-6), Autoregression(), Imat(), StftExcision()],
    ids=["blanking", "tapered", "autoregression", "imat", "stft-excision"],
)
def test_a_burst_that_is_taken_out_hides_no_target(mitigation):
    """A crossing interferer, 60 dB above the echoes in 2 % of every ramp."""
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    frame = frame_of(ramps, STREET[2:])
    samples = frame.samples.copy()
    draw = np.random.default_rng(4)
    for k in range(ramps.num_ramps):
        start = draw.integers(0, int(frame.times.num_samples[k]) - 20)
        samples[:, k, start : start + 20] += 1e4 * np.exp(2j * np.pi * draw.random(20))
    hit = frame.with_samples(samples)
    found = CoherentReceiver(mitigation=mitigation).detect(hit)
    assert found.num_detections == 2
    for n, true in enumerate(true_motions(ramps, STREET[2:])):
        assert found.range[n] == pytest.approx(true[0], abs=5e-3)
        assert found.azimuth[n] == pytest.approx(true[3], abs=0.02)
    unrepaired = CoherentReceiver().detect(hit).range
    error = np.abs(unrepaired[:, None] - true_motions(ramps, STREET[2:])[:, 0])
    assert not np.all(np.min(error, axis=0, initial=np.inf) < 5e-3)


def test_blanked_samples_weaken_no_detection():
    """A fifth of each ramp, in its middle."""
    ramps = Triangular().schedule(num_sweeps=8, streams=Streams(2))
    frame = frame_of(ramps, STREET[:1])
    samples = frame.samples.copy()
    samples[:, :, 600:900] += 1e4
    whole = CoherentReceiver().detect(frame)
    found = CoherentReceiver(mitigation=Blanking()).detect(frame.with_samples(samples))
    assert found.power[0] == pytest.approx(whole.power[0], rel=0.02)


def test_a_high_pass_whose_phase_is_known_hides_no_target():
    """At its corner up- and down-beats are turned by 90° each, against each other.

    It is applied by its response to each frequency, which wraps its transients round the ends of
    the ramps: they are 45 dB below the points. A receiver that does not know the filter takes the
    up- and down-ramps of a point for signals of opposite phases.
    """
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    high_pass = HighPass(corners=(100e3, 100e3))
    frame = frame_of(ramps, STREET[2:])
    spectrum = np.fft.fft(frame.samples, axis=-1)
    response = high_pass.response(np.fft.fftfreq(spectrum.shape[-1], 1.0 / frame.times.rate))
    passed = frame.with_samples(np.fft.ifft(spectrum * response, axis=-1) * frame.times.is_sample)
    receiver = CoherentReceiver(dynamic_range=from_db(40.0))
    found = receiver.detect(replace(passed, high_pass=high_pass))
    distance, rate = true_motions(ramps, STREET[2:]).T[:2]
    assert found.range == pytest.approx(distance, abs=1e-3)
    blind = receiver.detect(passed)
    is_near = np.abs(blind.range[:, None] - distance) < 1e-3
    assert not np.any(is_near & (np.abs(blind.range_rate[:, None] - rate) < 0.01))


@pytest.mark.parametrize("family", [Triangular(), DiverseTriangular()])
def test_no_detection_of_a_body_that_fades_is_stronger_than_the_body(family):
    """Its amplitude grows by half or to four times. Points that nearly cancel describe that too."""
    ramps = family.schedule(num_sweeps=16, streams=Streams(2))
    alone = frame_of(ramps, [HandPoint(range=12.0, power=100.0)], noise=0.0).samples
    counts = []
    for seed, least in product((3, 4, 5), (0.8, 2.0 / 3.0, 0.4)):
        growth = np.linspace(least, 2.0 - least, ramps.num_ramps)
        noise = frame_of(ramps, [], seed=seed)
        fading = noise.with_samples(noise.samples + growth[:, None] * alone)
        found = CoherentReceiver().detect(fading)
        assert found.range == pytest.approx(12.0, abs=0.01)
        assert 20.0 < found.power[0] < 110.0
        counts.append(found.num_detections)
    assert max(counts) >= 2


def test_an_azimuth_beside_interference_is_not_one_of_a_grid():
    """20 dB of interference from one direction on all ramps; ten drawn azimuths."""
    ramps = Triangular().schedule(num_sweeps=4, streams=Streams(2))
    draw = np.random.default_rng(8)
    error = []
    for seed in range(10):
        point = HandPoint(range=12.0, azimuth=draw.uniform(-0.9, -0.3), power=100.0)
        frame = with_noisy_ramps(
            frame_of(ramps, [point], seed=seed),
            np.full(ramps.num_ramps, 100.0),
            azimuth=0.5,
            seed=seed,
        )
        error.append(CoherentReceiver().detect(frame).azimuth[0] - point.azimuth)
    assert np.sqrt(np.mean(np.square(error))) < 4e-4
