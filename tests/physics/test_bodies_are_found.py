"""Extended bodies from their echoes to the score: found at any visible part, but not by a ghost."""

from dataclasses import fields, replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray, ElementPattern
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Converter, Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.rng import Streams
from polychirp.study.spec import Study, StudyRadar
from polychirp.study.trial import receive_and_score, run_trial, trace_frame
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.shapes import box, mesh_of
from polychirp.traffic.fittings import Fittings
from polychirp.traffic.street import Street, Vehicle
from polychirp.units import from_db
from polychirp.waveform import Sawtooth

WAVEFORM = Sawtooth(start_frequency=76.5e9, bandwidth=500e6, ramp_duration=25e-6, idle=10e-6)
SIZE = (4.5, 1.8, 1.4)


def radar(name: str) -> Radar:
    return Radar(
        name=name,
        transmit_power=10e-3,
        noise_figure=from_db(13.0),
        array=AntennaArray(
            spacing=0.5 * SPEED_OF_LIGHT / 76.75e9,
            pattern=ElementPattern(peak_gain=from_db(13.0), azimuth_beamwidth=np.radians(90)),
        ),
        if_filter=IfFilter(passband=6e6, stopband=7e6),
        converter=Converter(sample_rate=14e6, start=2e-6, margin=1e-6),
    )


def car(draw: np.random.Generator, *points: tuple[float, float]) -> Actor:
    """A metal box to the left of the axis, 10 to 18 m ahead, with points of 5 dBsm on its surface.

    It is turned as the radar is, and moves along the road.
    """
    return Actor(
        name="car",
        kind="vehicle",
        mesh=mesh_of(box(SIZE, 2.0)),
        pose=Pose(x=draw.uniform(12.5, 18.0), y=draw.uniform(3.5, 5.0)),
        velocity=(draw.uniform(-6.0, 6.0), 0.0, 0.0),
        points=tuple(PointScatterer(position=(x, y, 0.0), rcs=from_db(5.0)) for x, y in points),
    )


def scored(
    seed: int, *actors: Actor, interferer: Actor | None = None, waveform: Sawtooth = WAVEFORM
):
    """Score of a radar at the origin, with the interferer's radar, if there is one."""
    carrier = Actor(name="ego", kind="vehicle")
    others = () if interferer is None else (interferer,)
    names = ("front", "other")[: 1 + len(others)]
    scene = Scene(
        time=0.0,
        actors=(carrier, *others, *actors),
        radars=tuple(radar(name) for name in names),
        carriers=tuple(range(len(names))),
    )
    schedules = [waveform.schedule(num_sweeps=96, streams=Streams(seed).of(n)) for n in names]
    paths = trace_frame(FreeSpace(), scene, schedules, refresh_interval=1e-3)
    frame, parts = synthesize(
        Stretch(),
        scene,
        schedules,
        paths,
        victim=0,
        interferers=list(range(1, len(names))),
        streams=Streams(seed),
    )
    return receive_and_score(
        RangeDoppler(greatest_range=40.0),
        scene,
        paths,
        victim=0,
        frame=frame,
        parts=parts,
        targets=("car",),
        has_occlusion=False,
    )


def test_a_car_that_reflects_far_behind_its_nearest_point_is_found():
    """16 drawn cars, each with one point on its side, 2 to 4.4 m behind its rear.

    The nearest point is a corner of the rear; the range error is the distance to it.
    """
    for seed in range(16):
        draw = np.random.default_rng([23, seed])
        behind = draw.uniform(2.0, 4.4)
        result = scored(seed, car(draw, (behind - SIZE[0] / 2, -SIZE[1] / 2)))
        assert result.score.is_detected.tolist() == [True]
        assert result.score.nature == ("target",)
        assert 0.8 * behind < result.score.range_error[0] < behind


def test_a_car_with_points_along_its_side_has_their_extent():
    """8 drawn cars with points 4.4 m apart along the side: within a cell of 0.3 m."""
    for seed in range(8):
        draw = np.random.default_rng([29, seed])
        body = car(draw, *[(x, -SIZE[1] / 2) for x in (-2.2, -0.7, 0.8, 2.2)])
        result = scored(seed, body)
        place = np.array([[body.pose.x + p.position[0], body.pose.y - 0.9] for p in body.points])
        expected = np.ptp(np.linalg.norm(place, axis=1))
        assert result.score.num_points[0] >= 4
        assert result.score.length[0] == pytest.approx(expected, abs=0.3)
        assert result.score.length[0] <= result.truth.extent(0).length + 0.3
        assert result.score.other_echoes == ()


def test_a_ghost_on_a_car_that_reflects_nothing_does_not_find_it():
    """12 drawn cars; an interferer at twice the range and rate of a point on the side.

    It starts together with the victim, so that its ghost has the range d/2 and the range rate v/2
    of the point.
    """
    for seed in range(12):
        draw = np.random.default_rng([31, seed])
        body = car(draw)
        point = np.array([body.pose.x + draw.uniform(-2.0, 2.0), body.pose.y - 0.9])
        other = Actor(
            name="oncoming",
            kind="vehicle",
            pose=Pose(x=2 * point[0], y=2 * point[1], yaw=np.pi),
            velocity=tuple(2.0 * v for v in body.velocity),
        )
        result = scored(seed, body, interferer=other)
        assert "direct" in result.score.nature
        ghost = result.score.numbers("direct")[0]
        assert result.detections.range[ghost] == pytest.approx(np.linalg.norm(point), abs=0.3)
        assert not result.score.is_detected.any()
        assert "target" not in result.score.nature


@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("bandwidth", [500e6, 150e6])
def test_an_echo_with_a_folded_range_rate_is_known(bandwidth, direction):
    """8 drawn cars, one to three spans faster than the chirps tell apart; one span is 56 m/s.

    With 150 MHz each span moves the range by 0.7 m, and the margin is 1 m: two spans are told from
    an echo that is not folded by their range alone.
    """
    waveform = replace(WAVEFORM, bandwidth=bandwidth, direction=direction)
    span = SPEED_OF_LIGHT / (76.5e9 + 0.5 * bandwidth) / (2.0 * 35e-6)
    for seed in range(8):
        draw = np.random.default_rng([31, seed])
        folds = (-3, -2, -1, 1, 2, 3)[seed % 6]
        speed = float(folds + draw.uniform(-0.4, 0.4)) * span
        body = replace(car(draw, (-SIZE[0] / 2, -SIZE[1] / 2)), velocity=(speed, 0.0, 0.0))
        result = scored(seed, body, waveform=waveform)
        assert result.score.nature == ("folded",)
        assert result.score.body == ("car",)
        assert not result.score.is_detected[0]
        assert result.score.ghosts == ()
        assert result.score.other_echoes == (0,)


def test_waves_that_a_car_reflects_between_its_own_parts_are_echoes_of_it():
    """10 drawn cars, ray-traced without a road: whatever is detected is the car.

    Double and triple reflections in its lamps and rims are its brightest echoes. Noise makes a
    detection that nothing explains now and then.
    """
    front = {field.name: getattr(radar("front"), field.name) for field in fields(Radar)}
    front |= {"mount": Pose(x=2.4, z=0.6), "vehicle": "ego", "waveform": WAVEFORM}
    for seed in range(10):
        draw = np.random.default_rng([41, seed])
        vehicle = Vehicle(
            name="car",
            x=draw.uniform(10.0, 20.0),
            y=draw.uniform(-3.0, 3.0),
            heading=draw.uniform(-np.pi, np.pi),
            fittings=Fittings(),
        )
        study = Study(
            name="lamps",
            seed=seed + 1,
            num_sweeps=128,
            street=Street(vehicles=(Vehicle(name="ego", x=0.0, y=0.0), vehicle)),
            radars=(StudyRadar(**front),),
        )
        score = run_trial(study).victims[0].score
        assert score.is_detected.tolist() == [True]
        assert "target" in score.nature
        assert set(score.nature) <= {"target", "body", "unexplained"}
