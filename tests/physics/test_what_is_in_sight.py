"""The share of a body that is visible, and the energy of its echo, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.scene.ground_truth import truth
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.rng import Streams
from polychirp.study.body_echoes import body_echoes, echo_powers
from polychirp.study.spec import Study, StudyRadar, scene_of, schedules_of
from polychirp.study.trial import trace_frame
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.traffic.vehicle import vehicle_size
from polychirp.waveform import DiverseTriangular, Triangular


def street(**contents):
    ego = Vehicle(name="ego", x=0.0, y=0.0)
    radar = StudyRadar(name="front", vehicle="ego", mount=Pose(x=2.5, z=0.5), waveform=Triangular())
    vehicles = (ego, *contents.pop("vehicles", ()))
    return Study(
        name="s", street=Street(vehicles=vehicles, **contents), radars=(radar,), num_sweeps=2
    )


def points(*place_and_rcs):
    return tuple(
        Point(name=f"p{n}", x=x, y=0.0, z=0.5, rcs=rcs) for n, (x, rcs) in enumerate(place_and_rcs)
    )


def test_the_echo_of_a_point_has_the_power_of_the_radar_equation():
    """P G² λ² σ / (4π)³ R⁴, at the frequency at which its path is computed."""
    study = replace(street(points=points((12.5, 4.0))), tracer=FreeSpace())
    scene = scene_of(study)
    paths = study.tracer.trace(scene)
    power = echo_powers(scene, paths, victim=0, frequency=np.array([79e9]))
    radar = scene.radars[0]
    gain = float(radar.array.pattern.gain(np.array([[1.0, 0.0, 0.0]]))[0])
    expected = radar.transmit_power * radar.transmit_gain * radar.receive_gain * gain**2
    expected *= (SPEED_OF_LIGHT / paths.frequency) ** 2 * 4.0 / ((4 * np.pi) ** 3 * 10.0**4)
    assert power.max() == pytest.approx(expected, rel=1e-3)


def test_points_of_one_body_beat_over_the_band_and_their_powers_add_up():
    """Two echoes 3 m apart turn by many cycles over 1 GHz: the mean has no product of both."""
    study = replace(street(points=points((12.5, 4.0), (15.5, 4.0))), tracer=FreeSpace())
    scene = scene_of(study)
    paths = study.tracer.trace(scene)
    band = np.linspace(79e9, 80e9, 128, endpoint=False)
    each = echo_powers(scene, paths, victim=0, frequency=band)
    both = replace(paths, bounce_actor=np.full_like(paths.bounce_actor, paths.bounce_actor.max()))
    together = echo_powers(scene, both, victim=0, frequency=band)
    assert together.max() == pytest.approx(each.sum(), rel=2e-2)


@pytest.mark.parametrize("rate", [1e6, 8e6])
@pytest.mark.parametrize("waveform", [Triangular(), DiverseTriangular()])
def test_the_snr_is_the_energy_of_the_echo_in_the_samples_over_the_noise(waveform, rate):
    """The noise counts by its density in the pass band, whatever the converter samples besides."""
    study = street(points=points((12.5, 4.0)))
    radar = study.radars[0]
    radar = replace(radar, waveform=waveform, converter=replace(radar.converter, sample_rate=rate))
    study = replace(study, tracer=FreeSpace(), radars=(radar,))
    scene, ramps = scene_of(study), schedules_of(study)
    traced = trace_frame(study.tracer, scene, ramps, refresh_interval=1e-3)
    frame, parts = synthesize(
        Stretch(), scene, ramps, traced, victim=0, interferers=None, streams=Streams(1)
    )
    middle = traced[len(traced) // 2]
    found = body_echoes(scene, middle, victim=0, targets=["p0"], frame=frame)
    count = int(frame.times.num_samples.min())
    spectrum = np.fft.fft(parts.noise[..., :count], axis=-1)
    is_passed = np.abs(np.fft.fftfreq(count, 1 / rate)) < 250e3
    noise = np.mean(np.abs(spectrum[..., is_passed]) ** 2) / count
    energy = np.sum(np.abs(parts.total("echo")) ** 2)
    assert found[0] == pytest.approx(energy / noise, rel=0.05)  # the filter's edges


def test_half_a_car_beside_the_shadow_of_a_van_is_half_visible():
    """The line of sight past the van's near corner meets the middle of the car's rear.

    The van is rounded in plan, so that the share is half of that in the open to about a fifth. A
    car in the open hides little of itself (wheel wells); one right behind the van is hidden.
    """
    length, width, *_ = vehicle_size("van")
    rear = 22.0 - 0.5 * vehicle_size("sedan")[0]
    edge = 0.5 * width * (rear - 2.5) / (9.0 - 0.5 * length - 2.5)
    shares = []
    for y in (30.0, edge, 0.0):
        vehicles = (
            Vehicle(name="van", body="van", x=9.0, y=0.0),
            Vehicle(name="car", body="sedan", x=22.0, y=y),
        )
        scene = scene_of(street(vehicles=vehicles))
        shares.append(float(truth(scene, 0, ["car"]).visible_share[0]))
    in_the_open, half, hidden = shares
    assert in_the_open > 0.7
    assert half == pytest.approx(0.5 * in_the_open, abs=0.2)
    assert hidden == 0.0


def test_without_occlusion_all_metal_is_visible():
    scene = scene_of(street(vehicles=(Vehicle(name="car", x=22.0, y=3.0),)))
    assert truth(scene, 0, ["car"], has_occlusion=False).visible_share.tolist() == [1.0]
