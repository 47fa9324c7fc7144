"""From samples to detections."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.front_end import HighPass
from polychirp.receiver.chain import Receiver
from polychirp.receiver.detection.sidelobe_rejection import without_cross_pairs
from polychirp.receiver.mitigation import Autoregression, Blanking, Imat, StftExcision
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Triangular
from tests.support.points import HandPoint, frame_of

STREET = [
    HandPoint(range=5.0, range_rate=12.0, azimuth=-0.7, power=3e4),
    HandPoint(range=9.0, range_rate=-17.0, acceleration=6.0, azimuth=0.3, power=1e3),
    HandPoint(range=17.0, range_rate=0.2, azimuth=0.0, power=100.0),
    HandPoint(range=24.0, range_rate=25.0, azimuth=0.9, power=10.0),
]


@pytest.mark.parametrize("family", [Triangular(), DiverseTriangular()])
def test_every_point_is_found_once_with_its_range_rate_and_azimuth(family):
    """35 dB between them, ridges of the strong across the weak, range walk, an acceleration."""
    ramps = family.schedule(num_sweeps=16, streams=Streams(2))
    found = Receiver().detect(frame_of(ramps, STREET))
    assert found.num_detections == len(STREET)
    for n, point in enumerate(STREET):  # both are strongest first
        assert found.range[n] == pytest.approx(point.range, abs=5e-3)
        assert found.range_rate[n] == pytest.approx(point.range_rate, abs=0.05)
        assert found.azimuth[n] == pytest.approx(point.azimuth, abs=0.02)
        assert found.power[n] == pytest.approx(point.power, rel=0.05)


@pytest.mark.parametrize("angle", ["root-music", "bartlett", "capon"])
def test_azimuths_are_found_by_any_of_the_methods(angle):
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    found = Receiver(angle=angle).detect(frame_of(ramps, STREET[1:3]))
    assert found.azimuth == pytest.approx([0.3, 0.0], abs=0.005)


def test_an_unknown_estimator_of_azimuths_is_refused():
    with pytest.raises(InputError, match="not one of root-music, bartlett, capon"):
        Receiver(angle="music")


def test_noise_alone_is_no_target():
    """1e-6 per cell and some 1e5 dependent cells: one frame in ten or more."""
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    found = sum(Receiver().detect(frame_of(ramps, [], seed=s)).num_detections for s in range(3))
    assert found <= 1


def test_points_below_the_dynamic_range_are_not_detected():
    ramps = Triangular().schedule(num_sweeps=16, streams=Streams(2))
    points = [HandPoint(range=5.0, power=1e6), HandPoint(range=20.0, power=30.0)]  # 45 dB
    frame = frame_of(ramps, points)
    assert Receiver().detect(frame).num_detections == 1
    assert Receiver(dynamic_range=1e6).detect(frame).num_detections == 2


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
    found = Receiver(mitigation=mitigation).detect(hit)
    assert found.num_detections == 2
    for n, point in enumerate(STREET[2:]):
        assert found.range[n] == pytest.approx(point.range, abs=5e-3)
        assert found.azimuth[n] == pytest.approx(point.azimuth, abs=0.02)
        assert found.power[n] == pytest.approx(point.power, rel=0.1)
    assert Receiver().detect(hit).num_detections < 2


def test_blanked_samples_weaken_no_detection():
    """A fifth of each ramp, in its middle: a third of what the window lets through."""
    ramps = Triangular().schedule(num_sweeps=8, streams=Streams(2))
    frame = frame_of(ramps, STREET[:1])
    samples = frame.samples.copy()
    samples[:, :, 600:900] += 1e4
    found = Receiver(mitigation=Blanking()).detect(frame.with_samples(samples))
    assert found.power[0] == pytest.approx(STREET[0].power, rel=0.02)


def test_a_high_pass_whose_phase_is_known_hides_no_target():
    """At its corner up- and down-beats are turned by 90° each, against each other.

    It is applied by its response to each beat; without telling the receiver, nothing coheres.
    """
    ramps = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(2))
    high_pass = HighPass(corners=(100e3, 100e3))
    frame = frame_of(ramps, STREET[2:])
    spectrum = np.fft.fft(frame.samples, axis=-1)
    response = high_pass.response(np.fft.fftfreq(spectrum.shape[-1], 1.0 / frame.times.rate))
    passed = frame.with_samples(np.fft.ifft(spectrum * response, axis=-1) * frame.times.is_sample)
    found = Receiver().detect(replace(passed, high_pass=high_pass))
    assert sorted(found.range) == pytest.approx([17.0, 24.0], abs=0.02)
    assert Receiver().detect(passed).num_detections < 2


def test_candidates_that_share_beats_wait():
    beats = np.array([[10.0, -10.0], [10.0, -40.0], [60.0, -60.0]]) * 1e3
    assert without_cross_pairs(beats, np.array([1e3, 1e3])) == [0, 2]
