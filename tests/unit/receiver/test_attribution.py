"""Attribution of a receiver's detections to parts of the signal."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.model.if_frame import PARTS, IfParts
from polychirp.model.truth import Truth
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.attribution import detected, floor_rise, part_amplitudes, target_levels
from polychirp.receiver.clustering import Body
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.mitigation import Autoregression, Blanking, Burg, Imat, StftExcision
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.signal_model.point_signal import (
    beat_phase,
    hann_weights,
    matched_amplitudes,
)
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=4, streams=Streams(2))

METHODS = [Blanking(), Autoregression(), Imat(), StftExcision()]


def dissected(burst=0.0, ghost_power=4e4):
    """A frame of an echo, a steady ghost and bursts, in noise, with its parts."""
    echo = frame_of(RAMPS, [HandPoint(range=9.0, azimuth=0.3, power=1e4)], noise=0.0).samples
    ghost = frame_of(RAMPS, [HandPoint(range=6.0, power=ghost_power)], noise=0.0).samples
    noise = frame_of(RAMPS, [], seed=2)
    bursts = np.zeros_like(echo)
    bursts[:, :, 300:320] = burst
    samples = np.zeros((len(PARTS), *echo.shape), dtype=np.complex128)
    samples[PARTS.index("echo")] = echo
    samples[PARTS.index("direct")] = ghost
    samples[PARTS.index("indirect")] = bursts
    samples[PARTS.index("noise")] = noise.samples
    parts = IfParts(samples=samples)
    return noise.with_samples(parts.total()), parts


@pytest.mark.parametrize("receiver", [CoherentReceiver(), PaperReceiver(greatest_range=12.0)])
def test_every_detection_is_traced_to_the_part_it_comes_from(receiver):
    frame, parts = dissected()
    found, powers = detected(receiver, frame, parts)
    for place, part in ((6.0, "direct"), (9.0, "echo")):
        n = np.argmin(np.abs(found.range - place))
        assert found.range[n] == pytest.approx(place, abs=0.1)
        assert PARTS[np.argmax(powers[n])] == part


def test_a_part_has_the_power_of_all_channels():
    frame, parts = dissected()
    found, powers = detected(CoherentReceiver(), frame, parts)
    assert found.num_detections == 2
    assert powers[0, PARTS.index("direct")] == pytest.approx(4 * 4e4, rel=0.02)
    assert powers[1, PARTS.index("echo")] == pytest.approx(4 * 1e4, rel=0.02)


def test_a_part_is_told_from_a_stronger_one_beside_it():
    """Half a cell apart and 20 dB weaker: all points are fitted to each part at once."""
    cell = 0.17
    strong = frame_of(RAMPS, [HandPoint(range=9.0, azimuth=0.3, power=1e4)], noise=0.0)
    weak = frame_of(RAMPS, [HandPoint(range=9.0 + 1.5 * cell, power=1e2)], noise=0.0)
    noise = frame_of(RAMPS, [], seed=2)
    samples = np.stack([strong.samples, weak.samples, noise.samples])
    parts = IfParts(samples=samples, names=("echo", "direct", "noise"))
    found, powers = detected(CoherentReceiver(), noise.with_samples(samples.sum(axis=0)), parts)
    assert found.num_detections == 2
    assert [PARTS[n] for n in np.argmax(powers, axis=1)] == ["echo", "direct"]
    assert powers[1, PARTS.index("echo")] < 0.1 * powers[1, PARTS.index("direct")]


def test_interference_that_the_receiver_takes_out_is_no_cause():
    """An interferer of one direction is 20 dB above the echo in its cell, in each channel."""
    frame, parts = dissected(ghost_power=0.0)
    draw = np.random.default_rng(6)
    wave = np.exp(-1j * np.pi * np.arange(4) * np.sin(-0.6))
    burst = draw.normal(size=(2, *frame.samples.shape[1:]))
    burst = 30.0 * wave[:, None, None] * (burst[0] + 1j * burst[1]) * frame.times.is_sample
    samples = parts.samples.copy()
    samples[PARTS.index("direct")] = burst
    hit = frame.with_samples(frame.samples + burst)
    found, powers = detected(CoherentReceiver(), hit, IfParts(samples=samples))
    assert found.range[0] == pytest.approx(9.0, abs=0.02)
    assert PARTS[int(np.argmax(powers[0]))] == "echo"


@pytest.mark.parametrize("is_up", [True, False])
def test_the_floor_is_read_where_targets_beat(is_up):
    """Targets beat above zero on up-ramps and below zero on down-ramps; the other side is free.

    Disturbance on the free side of the ramps of one kind leaves the floor as it is, on the side of
    the targets it lifts it.
    """
    frame, parts = dissected(ghost_power=0.0)
    draw = np.random.default_rng(5)
    spectrum = np.fft.fft(draw.normal(size=frame.samples.shape), axis=-1)
    is_above = np.fft.fftfreq(frame.samples.shape[-1]) > 0
    chosen = (RAMPS.slope > 0) == is_up
    for is_on_their_side in (False, True):
        half = np.where(is_above == (is_up == is_on_their_side), spectrum, 0.0)
        samples = np.zeros_like(parts.samples)
        samples[PARTS.index("noise")] = parts.noise
        samples[PARTS.index("direct")] = 100.0 * np.fft.ifft(half) * chosen[:, None]
        rise = floor_rise(CoherentReceiver(), frame, IfParts(samples=samples))
        assert (rise > 100.0) is is_on_their_side
        assert is_on_their_side or rise < 1.5


def test_a_frame_without_detections_has_no_powers():
    _, parts = dissected()
    found, powers = detected(CoherentReceiver(), frame_of(RAMPS, [], seed=3), parts)
    assert found.num_detections == 0
    assert powers.shape == (0, len(PARTS))


def test_an_object_has_the_powers_of_the_point_at_its_place():
    frame, parts = dissected()
    grouped = CoherentReceiver(grouping=Body(gap=5.0, range_rate=5.0))
    found, powers = detected(grouped, frame, parts)
    assert found.num_detections == 1
    assert found.num_points[0] == 2
    assert PARTS[int(np.argmax(powers[0]))] == ("direct" if found.range[0] < 7.0 else "echo")


def test_parts_that_a_frame_does_not_have_put_in_nothing():
    frame, parts = dissected()
    few = IfParts(samples=parts.samples[:5], names=PARTS[:5])
    _, powers = detected(CoherentReceiver(), frame, few)
    _, whole = detected(CoherentReceiver(), frame, parts)
    assert powers[:, :5] == pytest.approx(whole[:, :5])
    assert not powers[:, 5:].any()


@pytest.mark.parametrize("mitigation", METHODS)
def test_bursts_lift_the_floor_and_mitigation_takes_that_away(mitigation):
    # without the ghost: the hole that blanking cuts into it would show as floor too
    frame, parts = dissected(burst=1e4, ghost_power=0.0)
    assert floor_rise(CoherentReceiver(), frame, parts) > 1e3
    assert floor_rise(CoherentReceiver(mitigation=mitigation), frame, parts) < 1.5


@pytest.mark.parametrize(
    "receiver", [CoherentReceiver(), RangeDoppler(greatest_range=30.0)], ids=["coherent", "fft"]
)
def test_a_frame_of_which_nothing_is_left_has_no_detections_and_no_floor(receiver):
    equal = Sawtooth(bandwidth=1e9).schedule(num_sweeps=16, streams=Streams(1))
    frame = frame_of(equal, [HandPoint(range=9.0, power=1e4)])
    samples = np.stack([frame.samples, frame_of(equal, []).samples])
    parts = IfParts(samples=samples, names=("echo", "noise"))
    blanked = replace(receiver, mitigation=Blanking(guard=1.0, factor=1.1))
    assert blanked.detect(frame).num_detections == 0
    assert np.isnan(floor_rise(blanked, frame, parts))


@pytest.mark.parametrize("mitigation", METHODS)
def test_parts_add_up_to_the_receivers_amplitude_after_mitigation(mitigation):
    frame, parts = dissected(burst=1e4)
    receiver = CoherentReceiver(mitigation=mitigation)
    found = CoherentReceiver().detect(frame.with_samples(parts["echo"] + parts["noise"]))
    cleaned = mitigated(mitigation, frame)
    motion = np.array([[found.range[0], found.range_rate[0], 0.0]])
    phases = beat_phase(RAMPS, frame.times, motion=motion, time=found.time)
    whole = matched_amplitudes(
        cleaned.samples, hann_weights(cleaned.weight), phases, frame.times.rate
    )[0]
    by_part = part_amplitudes(receiver, frame, parts.samples, found)[0].sum(axis=0)
    steered = np.linalg.norm(whole, axis=0)  # a single echo: all channels in phase after steering
    assert np.abs(by_part) == pytest.approx(steered, rel=0.05)


def test_a_steady_ghost_does_not_count_as_floor():
    frame, parts = dissected()
    assert floor_rise(CoherentReceiver(), frame, parts) == pytest.approx(1.0, abs=0.5)


@pytest.mark.parametrize("is_real", [False, True])
@pytest.mark.parametrize(
    "mitigation", [Blanking(guard=0.0), Burg(guard=0.0), Autoregression(guard=0.0, longest_gap=8.0)]
)
def test_the_snr_after_filling_counts_the_noise_that_filling_repeats(mitigation, is_real):
    """The loss of SNR is that of drawn noise in the echo's beats, through the same repair."""
    clean = frame_of(RAMPS, [HandPoint(range=9.0, power=1e3)], noise=0.0)
    scale, kept = (2.0, np.real) if is_real else (1.0, np.asarray)
    echo = (scale * kept(clean.samples)).astype(complex)
    noise = scale * kept(frame_of(RAMPS, [], seed=2).samples)
    burst = np.zeros_like(echo)
    burst[:, :, 400:800] = 3e3
    samples = np.stack([echo, burst, noise]).astype(np.complex128)
    frame = clean.with_samples(samples.sum(axis=0))
    parts = IfParts(samples=samples, names=("echo", "direct", "noise"))
    nil = np.zeros(1)
    there = Truth(
        time=0.5 * (RAMPS.start_time[0] + RAMPS.end_time[-1]),
        name=("point",),
        range=nil + 9.0,
        range_rate=nil,
        azimuth=nil,
        elevation=nil,
        point=np.array([[9.0, 0.0, 0.0]]),
        is_visible=np.array([True]),
    )
    repaired = mitigated(mitigation, frame)
    tone = clean.samples / np.maximum(np.abs(clean.samples), 1e-300)
    taper = np.zeros(frame.times.is_sample.shape)
    for row, length in zip(taper, frame.times.num_samples, strict=True):
        row[:length] = np.hanning(length + 2)[1:-1]

    def matched(samples, weight):  # a ramp counts by the samples that are left of it
        return np.sum(tone.conj() * taper * weight * samples, axis=-1) / taper.sum(axis=-1)

    whole = np.ones_like(repaired.weight)
    several = [frame_of(RAMPS, [], seed=seed).samples for seed in range(10, 60)]
    draws = [(scale * kept(draw)).astype(complex) for draw in several]
    before, after = (
        np.abs(matched(one_of(echo), weight).sum()) ** 2
        / np.mean([np.sum(np.abs(matched(one_of(draw), weight)) ** 2) for draw in draws])
        for one_of, weight in ((np.asarray, whole), (repaired.repair, repaired.weight))
    )
    bare, cleaned = (
        target_levels(CoherentReceiver(mitigation=method), frame, parts, there).snr[0]
        for method in (None, mitigation)
    )
    assert 10 * np.log10(cleaned / bare) == pytest.approx(10 * np.log10(after / before), abs=1.0)
