"""A point fitted with one amplitude for the whole frame."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.estimation.phase_refinement import (
    _is_unambiguous,
    coherent_steps,
    read_points,
)
from polychirp.receiver.signal_model.frame_model import FrameModel
from polychirp.receiver.signal_model.point_signal import beat_phase, beat_sensitivity, replica
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.points import HandPoint, frame_of

RAMPS = DiverseTriangular().schedule(num_sweeps=16, streams=Streams(3))
POINT = HandPoint(range=9.0, range_rate=-17.0, acceleration=2.0, power=4.0)
TRUE = np.array([[9.0, -17.0, 2.0]])


def readings_of(frame, motion, amplitude=None):
    shape = (len(motion), 4, RAMPS.num_ramps)
    return read_points(
        frame.samples,
        frame.times.is_sample,
        frame.times,
        phases=beat_phase(RAMPS, frame.times, motion=motion, time=0.0),
        amplitude=np.zeros(shape) + 0j if amplitude is None else amplitude,
    )


def steps_of(frame, motion, noise=1e-6):
    readings = readings_of(frame, motion)
    return coherent_steps(readings, FrameModel.of(frame), motion=motion, noise=noise)


def test_readings_are_the_means_of_samples_turned_back():
    """By the reference of the kernel: `replica`, sample by sample."""
    frame = frame_of(RAMPS, [POINT], seed=1)
    motion = TRUE * [1.0, 1.0, 0.0]
    found = readings_of(frame, motion)
    turned = frame.samples * replica(RAMPS, frame.times, motion=motion[0], time=0.0).conj()
    for k in (0, 7, 31):
        count = int(frame.times.num_samples[k])
        own = turned[:, k, :count]
        elapsed = (np.arange(count) - 0.5 * (count - 1)) / frame.times.rate
        assert found.value[0, :, k] == pytest.approx(own.mean(axis=1), rel=1e-6)
        assert found.slope[0, :, k] == pytest.approx((own * elapsed).mean(axis=1), abs=1e-10)
        assert found.spread[k] == pytest.approx(np.mean(elapsed**2))


def test_a_motion_is_corrected_to_the_phase():
    """5 mm, 4 cm/s, 2 m/s² wrong: right again to a thousandth of that, without noise."""
    frame = frame_of(RAMPS, [POINT], noise=0.0)
    wrong = np.array([[5e-3, 0.04, -2.0]])
    steps, is_one = steps_of(frame, TRUE + wrong)
    assert is_one.tolist() == [True]
    assert np.all(np.abs(steps[0] + wrong[0]) < 1e-3 * np.abs(wrong[0]))


def test_the_cubic_phase_of_an_acceleration_shifts_no_range():
    """At 20 m/s² it is 7e-5 cycles per ramp, which would look like 10 µm; left are 33 nm."""
    fast = HandPoint(range=9.0, range_rate=-17.0, acceleration=20.0, power=4.0)
    steps, _ = steps_of(frame_of(RAMPS, [fast], noise=0.0), np.array([[9.0, -17.0, 20.0]]))
    assert np.abs(steps[0, 0]) < 4e-8


def test_other_points_are_taken_out_first():
    """Another, 30 dB stronger and a metre away, with the amplitudes that it has."""
    strong = HandPoint(range=10.0, range_rate=-17.0, power=4e3)
    frame = frame_of(RAMPS, [POINT], noise=0.0)
    both = np.array([TRUE[0], [10.0, -17.0, 0.0]])
    amplitude = np.zeros((2, 4, RAMPS.num_ramps), dtype=np.complex128)
    amplitude[1] = np.sqrt(strong.power)
    signal = replica(RAMPS, frame.times, motion=both[1], time=0.0)
    sum_of_both = frame.with_samples(frame.samples + np.sqrt(strong.power) * signal)
    alone = readings_of(frame, TRUE).value[0]
    assert readings_of(sum_of_both, both, amplitude).value[0] == pytest.approx(alone, abs=1e-4)


def test_what_has_no_single_phase_history_is_left_alone():
    frame = frame_of(RAMPS, [POINT], noise=0.0)
    phase = np.exp(2j * np.pi * np.random.default_rng(5).random(RAMPS.num_ramps))
    _, is_one = steps_of(frame.with_samples(frame.samples * phase[:, None]), TRUE)
    assert is_one.tolist() == [False]


def test_beats_separate_a_rate_from_its_alias_down_to_some_noise():
    """The rate's deviation by beats alone, against λ/(2 · interval) of the longest ramps.

    A beat's is √6 f_s/(2π √(SNR M N³)); rates follow by λ/2 and the mean of 32 ramps, of up- and
    down-ramps evenly, so that the range does not matter.
    """
    frame = frame_of(RAMPS, [POINT], noise=0.0)
    readings = readings_of(frame, TRUE)
    beat = 2.0 * np.pi * beat_sensitivity(RAMPS, frame.times, 0.0)
    frequency = RAMPS.centre_frequency
    half_alias = SPEED_OF_LIGHT / (4.0 * frequency.mean() * np.diff(readings.middle).max())
    each = frame.times.rate * np.sqrt(6.0 / (POINT.power * 4.0 * readings.count**3)) / (2.0 * np.pi)
    rate = SPEED_OF_LIGHT / (2.0 * frequency.mean()) / np.sqrt(np.sum(each**-2.0))
    limit = (half_alias / 3.0 / rate) ** 2  # noise at which three deviations fill it
    for noise, expected in ((0.8 * limit, True), (1.25 * limit, False)):
        assert _is_unambiguous(readings, 0, beat, frequency, noise) is expected
