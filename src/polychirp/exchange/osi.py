"""Detections and targets of a run as messages of the ASAM Open Simulation Interface, in MCAP."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polychirp.exchange.stamps import since_start
from polychirp.study.store.load import StoredRun, StoredVictim
from polychirp.units import to_db

if TYPE_CHECKING:
    import betterosi


def write_osi(run: StoredRun, folder: Path) -> list[Path]:
    """Write ``run-osi.mcap`` and return its path.

    For every victim, the topic ``victim-0/sensor_data`` has a ``SensorData`` with the detections as
    ``RadarDetection``: distance, m, azimuth and elevation, rad, radial velocity, m/s, SNR, dB.
    ``object_id`` is the number of the target's moving object if the cause of a detection is a
    target. The topic ``victim-0/ground_truth`` has a ``GroundTruth`` whose moving objects are the
    targets, at the visible point that is nearest to the radar, in the world's frame. As OSI asks,
    radial velocities are positive towards the sensor, which is the opposite of range rates. An
    azimuth or elevation that the array does not measure is left out.
    """
    import betterosi

    path = folder / "run-osi.mcap"
    with betterosi.Writer(path, topic="ground_truth") as writer:
        for number, victim in enumerate(run.victims):
            for topic, message in (
                ("sensor_data", _sensor_data(number, victim)),
                ("ground_truth", _ground_truth(victim)),
            ):
                writer.add(message, topic=f"victim-{number}/{topic}")
    return [path]


def _sensor_data(number: int, victim: StoredVictim) -> betterosi.SensorData:
    import betterosi

    time, sensor = _timestamp(victim.detections.time), betterosi.Identifier(value=number)
    count = victim.detections.num_detections
    header = betterosi.SensorDetectionHeader(
        measurement_time=time, sensor_id=sensor, number_of_valid_detections=count
    )
    radar = betterosi.RadarDetectionData(
        header=header, detection=[_detection(victim, n) for n in range(count)]
    )
    return betterosi.SensorData(
        version=_version(),
        timestamp=time,
        sensor_id=sensor,
        feature_data=betterosi.FeatureData(version=_version(), radar_sensor=[radar]),
    )


def _detection(victim: StoredVictim, n: int) -> betterosi.RadarDetection:
    import betterosi

    found, score = victim.detections, victim.score
    angles = {"azimuth": float(found.azimuth[n]), "elevation": float(found.elevation[n])}
    known = {name: value for name, value in angles.items() if not math.isnan(value)}
    fields: dict[str, Any] = {}
    if score.nature[n] == "target" and score.body[n] in victim.truth.name:
        fields["object_id"] = _identifier(victim.truth.name.index(str(score.body[n])))
    return betterosi.RadarDetection(
        position=betterosi.Spherical3d(distance=float(found.range[n]), **known),
        radial_velocity=-float(found.range_rate[n]),
        snr=float(to_db(found.snr[n])),
        **fields,
    )


def _ground_truth(victim: StoredVictim) -> betterosi.GroundTruth:
    import betterosi

    truth = victim.truth
    objects = []
    for n, name in enumerate(truth.name):
        x, y, z = (float(value) for value in truth.point[n])
        objects.append(
            betterosi.MovingObject(
                id=_identifier(n),
                base=betterosi.BaseMoving(position=betterosi.Vector3d(x=x, y=y, z=z)),
                source_reference=[
                    betterosi.ExternalReference(
                        reference="polychirp", type="target", identifier=[name]
                    )
                ],
            )
        )
    return betterosi.GroundTruth(
        version=_version(), timestamp=_timestamp(truth.time), moving_object=objects
    )


def _identifier(number: int) -> betterosi.Identifier:
    import betterosi

    return betterosi.Identifier(value=number)


def _timestamp(time: float) -> betterosi.Timestamp:
    import betterosi

    seconds, nanoseconds = since_start(time)
    return betterosi.Timestamp(seconds=seconds, nanos=nanoseconds)


def _version() -> betterosi.InterfaceVersion:
    import betterosi

    return betterosi.InterfaceVersion(version_major=3, version_minor=8, version_patch=0)
