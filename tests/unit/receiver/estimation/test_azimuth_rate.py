"""Azimuths that change within a frame."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.estimation.azimuth_rate import (
    ramp_weights,
    sine_basis,
    sines_and_rates,
    snapshots_at_start,
)
from polychirp.receiver.signal_model.point_signal import path_of, path_slopes
from polychirp.rng import Streams
from polychirp.waveform import Triangular
from tests.support.points import HandPoint, frame_of, true_motions

CHANNEL_Y = 0.5 * SPEED_OF_LIGHT / 79e9 * (np.arange(4) - 1.5)
ELAPSED = 1.5e-3 * np.arange(32)
FREQUENCY = 79e9 + 1e8 * np.sin(np.arange(32.0))


def straight(place, velocity):
    """Range, its rate, the lateral sine and its rate, of x, y after ``ELAPSED``: by geometry."""
    x, y = place[0] + velocity[0] * ELAPSED, place[1] + velocity[1] * ELAPSED
    distance = np.hypot(x, y)
    rate = (x * velocity[0] + y * velocity[1]) / distance
    return distance, rate, y / distance


PLACE, VELOCITY = (4.0, 3.0), (-14.0, 6.0)


def motion_of(place, velocity):
    distance, rate, _ = straight(place, velocity)
    square = velocity[0] ** 2 + velocity[1] ** 2
    return np.array([[distance[0], rate[0], (square - rate[0] ** 2) / distance[0]]])


def snapshots_of(sine, amplitude=1.0):
    cycles = FREQUENCY / SPEED_OF_LIGHT * sine * CHANNEL_Y[:, None]
    return amplitude * np.exp(-2j * np.pi * cycles)[None]


def found_of(snapshots):
    return sines_and_rates(
        snapshots,
        motion=motion_of(PLACE, VELOCITY),
        channel_y=CHANNEL_Y,
        frequency=FREQUENCY,
        elapsed=ELAPSED,
    )[0]


def test_the_range_to_what_moves_straight_is_that_of_geometry():
    distance, rate, _ = straight(PLACE, VELOCITY)
    way, speed, acceleration = path_of(motion_of(PLACE, VELOCITY), ELAPSED)[:, 0]
    assert way == pytest.approx(distance, rel=1e-12)
    assert speed == pytest.approx(rate, rel=1e-12)
    assert acceleration[:-1] == pytest.approx(np.diff(speed) / np.diff(ELAPSED), rel=0.05)


def test_slopes_of_a_path_are_its_differences():
    motion = motion_of(PLACE, VELOCITY)
    for i in range(3):
        change = np.zeros(3)
        change[i] = 1e-4
        difference = path_of(motion + change, ELAPSED)[0] - path_of(motion - change, ELAPSED)[0]
        assert path_slopes(motion, ELAPSED)[..., i] == pytest.approx(
            difference / 2e-4, rel=1e-6, abs=1e-9
        )


def test_the_sine_of_a_straight_path_is_that_of_geometry():
    sine = straight(PLACE, VELOCITY)[2]
    steady, turned = sine_basis(motion_of(PLACE, VELOCITY), ELAPSED)[:, 0]
    rate = (VELOCITY[1] - sine[0] * motion_of(PLACE, VELOCITY)[0, 1]) / 5.0
    assert sine[0] * steady + rate * turned == pytest.approx(sine, abs=1e-12)


def test_an_azimuth_and_its_rate_are_found_at_the_start():
    """Nothing but the prior's pull is left, which vanishes with the noise."""
    sine = straight(PLACE, VELOCITY)[2]
    rate = (VELOCITY[1] - sine[0] * motion_of(PLACE, VELOCITY)[0, 1]) / 5.0
    assert found_of(snapshots_of(sine)) == pytest.approx([sine[0], rate], abs=1e-6)


def test_snapshots_at_the_start_are_equal_on_all_ramps():
    sine = straight(PLACE, VELOCITY)[2]
    still = snapshots_at_start(
        snapshots_of(sine),
        motion=motion_of(PLACE, VELOCITY),
        channel_y=CHANNEL_Y,
        frequency=FREQUENCY,
        elapsed=ELAPSED,
    )
    phase = -2.0 * np.pi * np.mean(FREQUENCY) / SPEED_OF_LIGHT * sine[0] * CHANNEL_Y
    assert still[0] == pytest.approx(np.tile(np.exp(1j * phase)[:, None], 32), abs=1e-5)


def test_ramps_with_another_wave_count_little():
    """A third of the ramps have a second wave, of ten times the amplitude, from the other side."""
    sine = straight(PLACE, VELOCITY)[2]
    draw = np.random.default_rng(1)
    noise = draw.normal(size=(2, 4, 32))
    snapshots = snapshots_of(sine) + 1e-3 * (noise[0] + 1j * noise[1])
    snapshots[..., ::3] += snapshots_of(np.full(32, -0.5), 10.0)[..., ::3]
    assert found_of(snapshots)[0] == pytest.approx(sine[0], abs=0.02)


def test_ramps_of_even_noise_have_full_weight():
    draw = np.random.default_rng(2)
    left = draw.gamma(3.0, size=(2000, 32))  # of four channels: three complex ones
    assert np.mean(ramp_weights(left) < 1.0) < 0.01
    left[:, 5] = 1e6
    assert np.all(ramp_weights(left)[:, 5] < 1e-4)


@pytest.mark.parametrize("angle", ["root-music", "bartlett", "capon"])
def test_the_receiver_gives_the_azimuth_in_the_middle_of_the_frame(angle):
    """A car passes at 5 m: 1.9 degrees in half a frame, of which 0.01 are left."""
    ramps = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(
        num_sweeps=16, streams=Streams(2)
    )
    point = HandPoint(
        range=7.0, range_rate=-14.0, acceleration=28.0, azimuth=0.7, sine_rate=1.5, power=1e4
    )
    found = CoherentReceiver(angle=angle).detect(frame_of(ramps, [point], seed=3))
    assert found.num_detections == 1
    error = found.azimuth[0] - true_motions(ramps, [point])[0, 3]
    assert np.degrees(error) == pytest.approx(0.0, abs=0.01)
