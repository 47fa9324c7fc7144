"""Detections and targets of a run as messages of the ASAM Open Simulation Interface, in MCAP."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polychirp.axes import FloatArray
from polychirp.exchange.stamps import since_start
from polychirp.model.placement import Placement
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
    targets and the radar's vehicle, the host: the boxes around them, in the world's frame. As OSI
    asks, radial velocities are positive towards the sensor, which is the opposite of range rates.
    An azimuth or elevation that the array does not measure is left out.

    ``mounting_position`` is the pose of the radar in the host's coordinates of OSI: along the axes
    of its box, from the middle of the rear axle, to which ``bbcenter_to_rear`` of the host leads
    from the centre of its box. Angles of pitch have the sign of the right-hand rule, as OSI asks:
    positive with the nose down.
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
        measurement_time=time,
        mounting_position=_mount(victim.placement),
        number_of_valid_detections=count,
        sensor_id=sensor,
    )
    radar = betterosi.RadarDetectionData(
        header=header, detection=[_detection(victim, n) for n in range(count)]
    )
    return betterosi.SensorData(
        version=_version(),
        timestamp=time,
        sensor_id=sensor,
        mounting_position=_mount(victim.placement),
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


def _mount(placed: Placement) -> betterosi.MountingPosition:
    import betterosi

    return betterosi.MountingPosition(
        position=_vector(placed.mount_position), orientation=_orientation(placed.mount_orientation)
    )


def _ground_truth(victim: StoredVictim) -> betterosi.GroundTruth:
    import betterosi

    placed = victim.placement
    return betterosi.GroundTruth(
        version=_version(),
        timestamp=_timestamp(placed.time),
        host_vehicle_id=_identifier(placed.carrier),
        moving_object=[_moving_object(victim, n) for n in range(len(placed.name))],
    )


def _moving_object(victim: StoredVictim, n: int) -> betterosi.MovingObject:
    import betterosi

    placed = victim.placement
    length, width, height = placed.box_size[n].tolist()
    kind = "target" if placed.name[n] in victim.truth.name else "vehicle"
    fields: dict[str, Any] = {}
    if n == placed.carrier:
        fields["vehicle_attributes"] = betterosi.MovingObject.VehicleAttributes(
            bbcenter_to_rear=_vector(placed.centre_to_rear_axle)
        )
    return betterosi.MovingObject(
        id=_identifier(n),
        base=betterosi.BaseMoving(
            dimension=betterosi.Dimension3d(length=length, width=width, height=height),
            position=_vector(placed.box_centre[n]),
            orientation=_orientation(placed.box_orientation[n]),
            velocity=_vector(placed.velocity[n]),
        ),
        source_reference=[
            betterosi.ExternalReference(
                reference="polychirp", type=kind, identifier=[placed.name[n]]
            )
        ],
        **fields,
    )


def _vector(values: FloatArray) -> betterosi.Vector3d:
    import betterosi

    x, y, z = values.tolist()
    return betterosi.Vector3d(x=x, y=y, z=z)


def _orientation(angles: FloatArray) -> betterosi.Orientation3d:
    """Orientation of OSI, by the right-hand rule, of yaw, pitch (nose up) and roll, rad."""
    import betterosi

    yaw, pitch, roll = angles.tolist()
    return betterosi.Orientation3d(roll=roll, pitch=-pitch, yaw=yaw)


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
