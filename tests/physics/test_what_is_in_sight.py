"""The share of a body that is visible, and the energy of its echo, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.scene.ground_truth import truth
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Converter
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.rng import Streams
from polychirp.scoring.sight import LEAST_SNR
from polychirp.study.body_echoes import body_echoes, echo_powers
from polychirp.study.spec import Study, StudyRadar, scene_of, schedules_of
from polychirp.study.trial import run_trial, trace_frame
from polychirp.synthesis.impairments.front_end import sample_scale
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.traffic.vehicle import vehicle_size
from polychirp.waveform import (
    DiverseTriangular,
    DopplerDivision,
    Noise,
    PhaseCoded,
    Sawtooth,
    TimeDivision,
    Triangular,
)

SHORT = Sawtooth(start_frequency=76.5e9, bandwidth=500e6, ramp_duration=20e-6, idle=5e-6)


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


@pytest.mark.parametrize(
    ("waveform", "coding"),
    [
        (SHORT, DopplerDivision(num_bands=4)),
        (SHORT, PhaseCoded()),
        (SHORT, TimeDivision()),
        (Noise(bandwidth=50e6), None),
    ],
)
def test_the_snr_has_the_energy_that_elements_and_chips_send(waveform, coding):
    """Elements that send together add their energies; chips of noise have their mean power."""
    radar = StudyRadar(
        name="front",
        vehicle="ego",
        mount=Pose(x=2.5, z=0.5),
        waveform=waveform,
        coding=coding,
        array=AntennaArray(num_channels=2, num_transmitters=1 if coding is None else 3),
        converter=Converter(sample_rate=100e6, start=3e-7, margin=0.0),
        if_filter=IfFilter(passband=40e6, stopband=50e6),
    )
    study = street(points=points((12.5, 4.0)))
    study = replace(study, tracer=FreeSpace(), radars=(radar,), num_sweeps=64)
    scene, ramps = scene_of(study), schedules_of(study)
    traced = trace_frame(study.tracer, scene, ramps, refresh_interval=1e-3)
    frame, parts = synthesize(
        Stretch(), scene, ramps, traced, victim=0, interferers=None, streams=Streams(1)
    )
    found = body_echoes(scene, traced[0], victim=0, targets=["p0"], frame=frame)
    noise = sample_scale(scene.radars[0]) * noise_density(scene.radars[0]) * frame.times.rate
    energy = np.sum(np.abs(parts.total("echo")) ** 2)
    assert found[0] == pytest.approx(energy / noise, rel=0.1)  # chips beyond the filter


def test_a_point_that_fades_is_missed_and_not_out_of_sight():
    """Its mean cross section says whether it is in sight; the echo is that of the draw."""
    point = Point(name="p0", x=12.5, y=0.0, z=0.5, rcs=2e-6, fluctuation="swerling-1")
    study = replace(street(points=(point,)), tracer=FreeSpace(), targets=("p0",))
    mean = run_trial(replace(study, street=street(points=points((12.5, 2e-6))).street))
    steady = mean.victims[0].score
    assert steady.is_in_sight.all()
    faded = next(
        seed for seed in range(1000) if point.drawn(Streams(seed)["fluctuation", "p0"]).ratio < 1e-3
    )
    score = run_trial(replace(study, seed=faded)).victims[0].score
    assert score.echo_snr[0] < 2e-3 * steady.echo_snr[0]
    assert score.echo_snr[0] < LEAST_SNR
    assert score.is_in_sight.all()
    assert score.num_missed == 1


@pytest.mark.slow
def test_fluctuating_points_are_detected_as_often_as_swerling_says():
    """Pfa^(1/(1 + S)), with the mean S of the SNRs in the cell, in which windows' losses are."""
    radar = StudyRadar(
        name="front",
        vehicle="ego",
        mount=Pose(x=2.5, z=0.5),
        waveform=SHORT,
        array=AntennaArray(num_channels=1),
        converter=Converter(sample_rate=10e6, start=3e-7, margin=0.0),
        if_filter=IfFilter(passband=4e6, stopband=5e6),
    )
    point = Point(name="p0", x=12.5, y=0.0, z=0.5, rcs=1.0, fluctuation="swerling-1")
    receiver = RangeDoppler(false_alarm_probability=1e-4, greatest_range=22.0)
    study = street(points=(point,))
    study = replace(
        study,
        tracer=FreeSpace(),
        radars=(radar,),
        targets=("p0",),
        num_sweeps=64,
        receiver=receiver,
    )
    level = 10.0**2.6 / run_trial(replace(study, seed=1)).victims[0].score.snr[0]
    drawn = point.drawn(Streams(1)["fluctuation", "p0"]).ratio
    study = replace(study, street=street(points=(replace(point, rcs=level * drawn),)).street)
    scores = [run_trial(replace(study, seed=seed)).victims[0].score for seed in range(2, 402)]
    assert all(score.is_in_sight.all() for score in scores)
    found = np.mean([score.is_detected[0] for score in scores])
    mean = np.mean([score.snr[0] for score in scores])
    expected = 1e-4 ** (1.0 / (1.0 + mean))
    assert found == pytest.approx(expected, abs=3 * math.sqrt(expected * (1 - expected) / 400))


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
