"""Runs made by hand, as `study.store` stores them."""

import numpy as np

from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS, IfFrame, IfParts, sample_times
from polychirp.model.placement import placement
from polychirp.model.radar import Converter, Radar
from polychirp.model.scene import Actor, Scene
from polychirp.model.score import Score
from polychirp.model.truth import Truth
from polychirp.rng import Streams
from polychirp.study.provenance import provenance
from polychirp.study.spec import Study, StudyRadar
from polychirp.study.trial import Trial, VictimResult
from polychirp.testing.paths import HandPath, paths_of
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import DiverseTriangular

ARRAY = AntennaArray(num_channels=2, pattern=ISOTROPIC)

PLACED = placement(
    Street(
        vehicles=(
            Vehicle(name="ego", x=5.0, y=-2.0, heading=np.pi / 2, speed=7.0, coarseness=4.0),
            Vehicle(name="car", x=5.0, y=20.0, heading=np.pi, coarseness=4.0),
            Vehicle(name="van", body="van", x=40.0, y=0.0, coarseness=4.0),
        )
    ).scene([(Radar(name="front", mount=Pose(x=2.0, y=0.3, z=0.6, yaw=0.2, pitch=0.1)), "ego")]),
    0,
    ("car", "van"),
)


def trial(*victims: VictimResult) -> Trial:
    scene = Scene(
        time=0.0,
        actors=(Actor(name="car", kind="vehicle"), Actor(name="van", kind="vehicle")),
        radars=(Radar(name="front"),),
        carriers=(0,),
    )
    return Trial(scene=scene, snapshots=(), victims=victims)


def victim(name: str, *, num_detections: int = 3) -> VictimResult:
    schedule = DiverseTriangular(ramp_duration=(1e-4, 2e-4)).schedule(
        num_sweeps=2, streams=Streams(1).of(name)
    )
    times = sample_times(schedule, Converter())
    rng = np.random.default_rng(1)
    shape = (len(PARTS), 2, schedule.num_ramps, times.most_samples)
    parts = IfParts(samples=rng.normal(size=shape) + 1j * rng.normal(size=shape))
    column = rng.normal(size=num_detections)
    return VictimResult(
        name=name,
        frame=IfFrame(samples=parts.total(), times=times, schedule=schedule, array=ARRAY),
        parts=parts,
        paths=paths_of(HandPath(delay=1e-7), HandPath(delay=2e-7, delay_rate=1e-8)),
        detections=Detections(
            time=0.5, range=column, range_rate=column, azimuth=column, power=column, snr=column
        ),
        truth=Truth(
            time=0.25,
            name=("car", "van"),
            range=[1.0, 2.0],
            range_rate=[0.0, 1.0],
            azimuth=[0.1, 0.2],
            elevation=[0.0, 0.1],
            point=np.zeros((2, 3)),
            is_visible=[True, False],
        ),
        score=Score(
            is_detected=[True, False],
            range_error=[0.1, 0.0],
            range_rate_error=[0.2, 0.0],
            azimuth_error=[0.3, 0.0],
            elevation_error=[0.4, 0.0],
            detection_sinr=[1e3, 0.0],
            echo_snr=[5e3, 0.0],
            is_in_sight=[True, False],
            snr=[2e3, 0.0],
            inr=[3.0, 0.0],
            mitigated_sinr=[9e2, 0.0],
            num_points=[2.0, 0.0],
            length=[1.5, 0.0],
            width=[0.5, 0.0],
            range_rate_span=[0.1, 0.0],
            nature=("direct",) * num_detections,
            body=(None,) * num_detections,
            power=column,
            target_detection=(0,),
            num_missed=1,
            floor_rise=2.5,
        ),
        placement=PLACED,
    )


STUDY = Study(
    name="alone",
    seed=7,
    street=Street(vehicles=(Vehicle(name="car", x=0.0, y=0.0),)),
    radars=(StudyRadar(name="front", vehicle="car", waveform=DiverseTriangular()),),
)
ORIGIN = provenance(STUDY)
BOTH = trial(victim("front"), victim("rear", num_detections=0))
