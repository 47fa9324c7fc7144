"""What figures, scores and studies ask of a frame of steps."""

from dataclasses import dataclass

import numpy as np
import pytest

from polychirp.model.if_frame import IfParts
from polychirp.model.radar import Converter
from polychirp.model.truth import Truth
from polychirp.receiver.attribution import floor_rise, target_levels
from polychirp.receiver.mitigation.base import with_weights
from polychirp.receiver.overview.range_azimuth import range_azimuth_map
from polychirp.receiver.overview.range_rate import range_rate_map
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.staircase import Staircase
from polychirp.receiver.stepped.steps import middle_time
from polychirp.rng import Streams
from polychirp.scoring.association import Gate
from polychirp.study.roc.yardsticks import (
    error_limits,
    num_cells,
    num_looks,
    resolution,
    window_share,
)
from polychirp.waveform import Mfsk
from tests.support.points import HandPoint, frame_of

STEPS = Mfsk(num_steps=128).schedule(num_sweeps=1, streams=Streams(1))
CONVERTER = Converter(sample_rate=2e6, start=3e-6, margin=0.0)
RECEIVER = MfskReceiver(greatest_range=14.0, greatest_speed=20.0)


@dataclass(frozen=True)
class _LeavesOneSample:
    """A mitigation that leaves one sample of every step whose number is a multiple of 3."""

    def mitigate(self, frame):
        weight = frame.times.is_sample.astype(np.float64)
        weight[::3, 1:] = 0.0
        return with_weights(frame, weight)


def test_the_map_is_greatest_at_the_motion_of_a_point():
    point = HandPoint(range=9.0, range_rate=-6.0, azimuth=0.5, spreading=0.0)
    frame = frame_of(STEPS, [point], noise=1e-6, converter=CONVERTER)
    map_ = range_rate_map(RECEIVER, frame)
    row, column = np.unravel_index(np.argmax(map_.power), map_.power.shape)
    stairs = Staircase.of(STEPS)
    assert map_.range[column] == pytest.approx(9.0, abs=4 * stairs.range_cell)
    beat = map_.range[column] / stairs.range_cell + map_.range_rate[row] / stairs.rate_cell
    assert beat == pytest.approx(9.0 / stairs.range_cell - 6.0 / stairs.rate_cell, abs=1.0)
    # the nearest cell is up to a quarter of a beat's cell away: 0.16 dB
    assert map_.power.max() == pytest.approx(1.0, rel=0.04)
    beams = range_azimuth_map(RECEIVER, frame)
    beam, _ = np.unravel_index(np.argmax(beams.power), beams.power.shape)
    assert beams.sine[beam] == pytest.approx(np.sin(0.5), abs=0.05)


def test_the_floor_rises_by_the_power_of_interference_over_noise():
    """A part of twice the noise of another draw: the floor is three times as high."""
    noise, other = (
        frame_of(STEPS, [], seed=seed, noise=power, converter=CONVERTER).samples
        for seed, power in ((1, 1.0), (2, 2.0))
    )
    parts = IfParts(samples=np.stack([other, noise]), names=("direct", "noise"))
    frame = frame_of(STEPS, [], converter=CONVERTER).with_samples(noise + other)
    assert floor_rise(RECEIVER, frame, parts) == pytest.approx(3.0, rel=0.15)


def test_the_snr_of_a_target_is_that_of_its_own_echo():
    """A step has all echoes at once: only the sum over steps knows the weak one, 30 dB below.

    A tone of amplitude a in noise of σ² on each of C channels has, of two sequences with the taper
    w, the SNR 2 C a²/(σ² Σw²); the noise of the mean of a step's samples is that of one of them
    over their number. The receiver's own map has the same SNR.
    """
    points = [
        HandPoint(range=9.0, range_rate=-6.0, spreading=0.0),
        HandPoint(range=4.0, range_rate=-8.0, power=1e-3, spreading=0.0),
    ]
    clean = frame_of(STEPS, points, noise=0.0, converter=CONVERTER)
    noise = frame_of(STEPS, [], seed=3, noise=1e-4, converter=CONVERTER)
    parts = IfParts(samples=np.stack([clean.samples, noise.samples]), names=("echo", "noise"))
    frame = clean.with_samples(clean.samples + noise.samples)
    middle, rate = middle_time(frame.times), np.array([-6.0, -8.0])
    true = Truth(
        time=middle,
        name=("strong", "weak"),
        range=np.array([9.0, 4.0]) + rate * middle,
        range_rate=rate,
        azimuth=np.zeros(2),
        elevation=np.zeros(2),
        point=np.zeros((2, 3)),
        is_visible=np.ones(2, dtype=np.bool_),
    )
    snr = target_levels(RECEIVER, frame, parts, true).snr
    mean_noise = 1e-4 / int(frame.times.num_samples[0]) * np.sum(taper(128) ** 2)
    ideal = 2.0 * frame.array.num_channels / mean_noise
    assert snr == pytest.approx([ideal, 1e-3 * ideal], rel=0.1)
    drawn = [
        RECEIVER.steps(frame_of(STEPS, [], seed=n, noise=1e-4, converter=CONVERTER)).power
        for n in range(1, 41)
    ]
    steps = RECEIVER.steps(clean)
    beat = steps.peaks(steps.beat[[steps.power.argmax()]])
    peak = np.mean(np.abs(steps.amplitude(beat)) ** 2)
    looks = 2 * frame.array.num_channels
    assert snr[0] == pytest.approx(looks * peak / np.mean(drawn), rel=0.15)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_steps_of_which_one_sample_is_left_count_by_what_is_left(seed):
    """A tone's SNR is 2 C a² (Σwm)²/(σ² Σw²m) with m samples left on each of the steps."""
    point = HandPoint(range=9.0, spreading=0.0)
    clean = frame_of(STEPS, [point], noise=0.0, converter=CONVERTER)
    noise = frame_of(STEPS, [], seed=seed, noise=1e-4, converter=CONVERTER)
    parts = IfParts(samples=np.stack([clean.samples, noise.samples]), names=("echo", "noise"))
    frame = clean.with_samples(clean.samples + noise.samples)
    receiver = MfskReceiver(greatest_range=14.0, greatest_speed=20.0, mitigation=_LeavesOneSample())
    true = Truth(
        time=middle_time(frame.times),
        name=("point",),
        range=[9.0],
        range_rate=[0.0],
        azimuth=[0.0],
        elevation=[0.0],
        point=np.zeros((1, 3)),
        is_visible=[True],
    )
    left = _LeavesOneSample().mitigate(frame).weight.sum(axis=1)[::2]
    window = taper(128)
    expected = np.sum(window * left) ** 2 / np.sum(window**2 * left)
    expected *= 2.0 * frame.array.num_channels / 1e-4
    # the noise is a mean over 256 steps of four channels
    assert target_levels(receiver, frame, parts, true).snr[0] == pytest.approx(expected, rel=0.1)


def test_ranges_are_resolved_by_the_band_of_all_steps():
    band = float(np.ptp(STEPS.start_frequency))
    cell = 299792458.0 / (2.0 * band)
    frame = frame_of(STEPS, [], converter=CONVERTER)
    assert resolution(RECEIVER, STEPS, frame.times).range == pytest.approx(cell)
    assert Gate.of(STEPS, frame.array).range == pytest.approx(max(0.4, cell))


def test_the_measures_of_a_receiver_are_known():
    """The limits hold 13.5/0.25 by 40/0.77 cells of the 128² that all beats and phases have."""
    frame = frame_of(STEPS, [], converter=CONVERTER)
    stairs = Staircase.of(STEPS)
    share = 13.5 / stairs.range_cell * 40.0 / stairs.rate_cell / 128**2
    assert num_cells(RECEIVER, frame) == pytest.approx(128 * share, rel=1e-6)
    assert num_looks(RECEIVER, frame) == 2 * frame.array.num_channels
    assert window_share(RECEIVER, frame) == pytest.approx(1.0 / 1.58, rel=0.01)
    wrong = error_limits(RECEIVER, STEPS, frame.times)
    cell = resolution(RECEIVER, STEPS, frame.times)
    assert wrong.range == pytest.approx(cell.range + 12.8 * stairs.range_cell)


def test_the_ideal_detector_beside_steps_has_the_looks_and_the_snr_of_a_cell():
    """The mean of M looks of noise has the variance 1/M; a point in the middle of a cell is S/M."""
    noise = [
        RECEIVER.steps(frame_of(STEPS, [], seed=n, noise=1.0, converter=CONVERTER)).power
        for n in range(1, 101)
    ]
    floor = float(np.mean(noise))
    frame = frame_of(STEPS, [], converter=CONVERTER)
    looks = num_looks(RECEIVER, frame)
    assert floor**2 / np.var(noise) == pytest.approx(looks, rel=0.1)
    point = HandPoint(range=36 * Staircase.of(STEPS).range_cell, range_rate=0.0, spreading=0.0)
    alone = frame_of(STEPS, [point], noise=1e-12, converter=CONVERTER)
    coherent = len(alone.samples) * int(alone.times.num_samples.sum())  # over noise of 1 W
    in_a_cell = looks * RECEIVER.steps(alone).power.max() / floor
    assert in_a_cell / coherent == pytest.approx(window_share(RECEIVER, frame), rel=0.03)
