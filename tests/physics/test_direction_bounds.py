"""Azimuths and elevations: phases of the channel, and errors against the Cramér–Rao bound."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose, direction_of
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import IfFrame, sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.receiver.angle.directions import directions
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.rng import Streams
from polychirp.synthesis.links.links import links_between
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.waveform import DopplerDivision, Sawtooth, TimeDivision, coded
from tests.support.directions import (
    ARRAYS,
    direction_bound,
    drawn_directions,
    noisy_waves,
    places,
)

RAISED = AntennaArray(
    num_transmitters=3,
    transmitter_positions=((0, 0), (2, 1), (4, 0)),
    spacing=0.5 * SPEED_OF_LIGHT / 77e9,
    pattern=ISOTROPIC,
)
"""Three transmitting elements, the middle one raised by half a wavelength, and four receiving."""

COUNT = 1000
"""Draws of a rate; the rms of their errors is known to 1/√2000 = 2.2 %."""


# ── the channel ──────────────────────────────────────────────────────────────────────────────────


def scene_with_point(array, point, *, pose):
    """A radar at the origin with this pose, and an isotropic point in the world, m."""
    radar = Radar(
        name="front",
        array=array,
        if_filter=IfFilter(passband=4e6, stopband=5e6),
        converter=Converter(sample_rate=10e6),
    )
    car = Actor(name="car", kind="vehicle", pose=pose)
    target = Actor(
        name="post", kind="object", points=(PointScatterer(position=tuple(point), rcs=1.0),)
    )
    return Scene(time=0.0, actors=(car, target), radars=(radar,), carriers=(0,))


@pytest.mark.parametrize("seed", range(6))
def test_the_channels_delays_are_those_of_the_ways_from_element_to_element(seed):
    """A point at 1000 m in a drawn direction, a radar with drawn yaw, pitch and roll.

    Lengths in the world from every transmitting element to the point and back to every receiving
    one. The wave fronts bend by (12 mm)²/2 km = 7e-8 m, 2e-16 s, each way.
    """
    rng = np.random.default_rng(seed)
    array = replace(
        RAISED,
        channel_positions=tuple(map(tuple, rng.uniform(-3, 3, (4, 2)))),
        transmitter_positions=tuple(map(tuple, rng.uniform(-3, 3, (3, 2)))),
    )
    yaw, pitch, roll = rng.uniform(-1.0, 1.0, 3)
    point = 1000.0 * direction_of(np.array(yaw + 0.3), np.array(rng.uniform(-0.5, 0.5)))
    scene = scene_with_point(array, point, pose=Pose(yaw=yaw, pitch=pitch, roll=roll))
    links = links_between(scene, FreeSpace().trace(scene), victim=0, transmitter=0, num_elements=3)
    turn, origin = scene.radar_rotation[0], scene.radar_position[0]
    out, back = (
        np.linalg.norm(origin + position @ turn.T - point, axis=1)
        for position in (array.transmit_position, array.position)
    )
    expected = (out[:, None] + back) / SPEED_OF_LIGHT
    assert np.ptp(expected) > 1e-12  # half a wavelength is 6e-12 s
    np.testing.assert_allclose(links.delay_at(0.0), expected, rtol=0.0, atol=6e-16)


@pytest.mark.parametrize("coding", [TimeDivision(), DopplerDivision(num_bands=4)], ids=repr)
@pytest.mark.parametrize("speed", [0.0, 7.0, -9.0])
def test_the_receiver_finds_points_above_and_below_the_horizon(coding, speed):
    """From the channel through synthesis, decoding and unfolding, with hardly any noise.

    Turns of three are ambiguous beyond ±5.4 m/s, four Doppler bands beyond ±4.1 m/s. The phases
    agree to a fraction of a degree, as they refer to the middle of the sampling window.
    """
    ramps = Sawtooth(start_frequency=76.5e9, bandwidth=1e9, ramp_duration=50e-6, idle=10e-6)
    schedule = coded(ramps.schedule(num_sweeps=48, streams=Streams(seed=1)), coding, num_elements=3)
    rng = np.random.default_rng(int(10 * speed) + 100)
    for _ in range(3):
        azimuth, elevation = np.radians(rng.uniform([-50, -30], [50, 30]))
        direction = direction_of(azimuth, elevation)
        scene = scene_with_point(RAISED, 15.0 * direction, pose=Pose())
        moving = replace(scene.actors[1], velocity=tuple(speed * direction))
        scene = replace(scene, actors=(scene.actors[0], moving))
        samples = Stretch().contribution(
            scene, [schedule], [FreeSpace().trace(scene)], victim=0, transmitter=0
        )
        times = sample_times(schedule, scene.radars[0].converter)
        frame = IfFrame(samples=samples.sum(axis=0), times=times, schedule=schedule, array=RAISED)
        noise = (
            1e-3
            * np.abs(frame.samples).max()
            * np.random.default_rng(1).normal(size=frame.samples.shape)
        )
        found = RangeDoppler(angle="bartlett").detect(frame.with_samples(frame.samples + noise))
        assert found.range_rate[0] == pytest.approx(speed, abs=0.1)
        assert found.azimuth[0] == pytest.approx(azimuth, abs=2e-3)
        assert found.elevation[0] == pytest.approx(elevation, abs=4e-3)


# ── the bound ────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("snr_db", [15.0, 40.0])
@pytest.mark.parametrize("name", ARRAYS)
def test_errors_of_bartletts_beams_are_those_of_the_bound(name, snr_db, compare):
    """Drawn directions; errors over the bound of each, from the numerical Fisher information.

    Maximum likelihood reaches the bound from some 10 dB on; 3 σ are 7 %.
    """
    place, snr = places(name), 10 ** (snr_db / 10)
    rng = np.random.default_rng([int(snr_db), len(place)])
    azimuth, elevation = drawn_directions(place, COUNT, rng)
    snapshots = noisy_waves(place, azimuth, elevation, snr=snr, rng=rng)
    found = directions(snapshots, Elements(place=place), estimator="bartlett")
    bound = np.array(
        [direction_bound(place, *true, snr=snr) for true in zip(azimuth, elevation, strict=True)]
    )
    for what, angle, true, least in zip(
        ("azimuth", "elevation"), found, (azimuth, elevation), bound.T, strict=True
    ):
        if np.all(np.isnan(least)):
            assert np.all(np.isnan(angle))
            continue
        compare(
            page="arrays",
            case=f"Bartlett's beams, {name}, {what}, {snr_db:g} dB per channel",
            quantity="rms error of a direction over the Cramér–Rao bound",
            expected=1.0,
            measured=np.sqrt(np.mean(((angle - true) / least) ** 2)),
            tolerance=0.08,
            source="numerical Fisher information",
        )


def test_errors_of_bartletts_beams_on_drawn_arrays_are_those_of_the_bound():
    """Ten elements anywhere in 4 by 3 wavelengths, 40 arrays of 50 directions at 20 dB."""
    squares, rng = [], np.random.default_rng(9)
    for _ in range(40):
        place = rng.uniform(-1.0, 1.0, (10, 2)) * [2.0, 1.5]
        true = np.stack(drawn_directions(place, 50, rng))
        snapshots = noisy_waves(place, *true, snr=100.0, rng=rng)
        found = np.stack(directions(snapshots, Elements(place=place), estimator="bartlett"))
        bound = np.array([direction_bound(place, *one, snr=100.0) for one in true.T]).T
        squares.append(np.mean(((found - true) / bound) ** 2, axis=1))
    assert np.sqrt(np.mean(squares, axis=0)) == pytest.approx([1.0, 1.0], abs=0.08)


@pytest.mark.parametrize("estimator", ["capon", "root-music"])
@pytest.mark.parametrize("name", ["row", "column", "sparse row", "overlapping row"])
def test_on_lines_all_estimators_of_maximum_likelihood_reach_the_bound(name, estimator):
    place, snr = places(name), 100.0
    rng = np.random.default_rng(10)
    azimuth, elevation = drawn_directions(place, COUNT, rng)
    snapshots = noisy_waves(place, azimuth, elevation, snr=snr, rng=rng)
    found = np.stack(directions(snapshots, Elements(place=place), estimator=estimator))
    axis = int(np.ptp(place[:, 1]) > 0)
    true = (azimuth, elevation)[axis]
    bound = np.array(
        [
            direction_bound(place, *one, snr=snr)[axis]
            for one in zip(azimuth, elevation, strict=True)
        ]
    )
    assert np.sqrt(np.mean(((found[axis] - true) / bound) ** 2)) == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize("count", [4, 8, 12])
def test_esprit_exceeds_the_bound_by_the_factor_of_its_equal_weights(count, compare):
    r"""The phase of Σ x*ₙ xₙ₊₁ telescopes: var = 1/((N−1)² SNR), against 6/(N(N²−1) SNR).

    The ratio is N(N+1)/6(N−1). At 40 dB per channel, second order is 1 %; 3 σ are 7 %.
    """
    place = np.stack([0.5 * np.arange(count), np.zeros(count)], axis=-1)
    rng = np.random.default_rng(11)
    azimuth, elevation = drawn_directions(place, COUNT, rng)
    snapshots = noisy_waves(place, azimuth, elevation, snr=1e4, rng=rng)
    found = directions(snapshots, Elements(place=place), estimator="esprit")
    bound = np.array([direction_bound(place, angle, 0.0, snr=1e4)[0] for angle in azimuth])
    compare(
        page="arrays",
        case=f"ESPRIT, row of {count}, azimuth, 40 dB per channel",
        quantity="rms error of a direction over the Cramér–Rao bound",
        expected=np.sqrt(count * (count + 1) / (6 * (count - 1))),
        measured=np.sqrt(np.mean(((found.azimuth - azimuth) / bound) ** 2)),
        tolerance=0.12,  # 8 % of 1.54
        source="√(N(N + 1)/6(N − 1))",
    )
