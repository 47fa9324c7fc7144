"""Detections of a run as point clouds in a ROS 2 bag, which needs no ROS to be written or read."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from polychirp.exchange.stamps import NANOSECONDS, since_start
from polychirp.frames import direction_of, quaternion
from polychirp.study.store.load import StoredRun, StoredVictim
from polychirp.units import to_db

FIELDS: Final = (
    "x",
    "y",
    "z",
    "range",
    "range_rate",
    "azimuth",
    "elevation",
    "power",
    "snr",
    "is_ghost",
)
"""Fields of each point: m in the radar's frame, m, m/s, rad, rad, dBW, dB, and 1 for a ghost."""

TRANSFORMS: Final = "tf2_msgs/msg/TFMessage"
"""Type of the messages with the poses of the radars."""

_FLOAT32: Final = 7
"""Number of the data type of 32-bit floats in ``sensor_msgs/PointField``."""


def write_rosbag(run: StoredRun, folder: Path) -> list[Path]:
    """Write the bag ``run-rosbag``, a folder, and return its path.

    Its topics ``/victim_0/detections`` and so on have one ``sensor_msgs/PointCloud2`` each, with
    `FIELDS` as 32-bit floats, in the radar's frame: x ahead, y left, z up. An angle that the array
    does not measure counts as zero in x, y, z, and is NaN in its own field. The topic ``/tf`` has
    the transforms from the frame ``world`` to those of the radars, which have their names.
    """
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    path = folder / "run-rosbag"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for number, victim in enumerate(run.victims):
            message = _point_cloud(store, victim)
            connection = writer.add_connection(
                f"/victim_{number}/detections", message.__msgtype__, typestore=store
            )
            seconds, nanoseconds = since_start(victim.detections.time)
            stamp = seconds * NANOSECONDS + nanoseconds
            writer.write(connection, stamp, store.serialize_cdr(message, message.__msgtype__))
        connection = writer.add_connection("/tf", TRANSFORMS, typestore=store)
        for victim in run.victims:
            message = store.types[TRANSFORMS](transforms=[_transform(store, victim)])
            seconds, nanoseconds = since_start(victim.placement.time)
            stamp = seconds * NANOSECONDS + nanoseconds
            writer.write(connection, stamp, store.serialize_cdr(message, TRANSFORMS))
    return [path]


def _transform(store: Any, victim: StoredVictim) -> Any:
    """Pose of the radar's frame in the world, at the instant of the detections."""
    types, placed = store.types, victim.placement
    seconds, nanoseconds = since_start(placed.time)
    x, y, z = placed.radar_position.tolist()
    stamp = types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    qw, qx, qy, qz = quaternion(*placed.radar_orientation.tolist()).tolist()
    return types["geometry_msgs/msg/TransformStamped"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="world"),
        child_frame_id=victim.name,
        transform=types["geometry_msgs/msg/Transform"](
            translation=types["geometry_msgs/msg/Vector3"](x=x, y=y, z=z),
            rotation=types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw),
        ),
    )


def _point_cloud(store: Any, victim: StoredVictim) -> Any:
    types = store.types
    seconds, nanoseconds = since_start(victim.detections.time)
    stamp = types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    points = _points(victim)
    field = types["sensor_msgs/msg/PointField"]
    width = points.dtype.itemsize * len(FIELDS)
    return types["sensor_msgs/msg/PointCloud2"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=victim.name),
        height=1,
        width=len(points),
        fields=[
            field(name=name, offset=4 * n, datatype=_FLOAT32, count=1)
            for n, name in enumerate(FIELDS)
        ],
        is_bigendian=False,
        point_step=width,
        row_step=width * len(points),
        data=np.frombuffer(points.tobytes(), dtype=np.uint8),
        is_dense=not bool(np.any(np.isnan(points))),
    )


def _points(victim: StoredVictim) -> np.ndarray[Any, np.dtype[np.float32]]:
    """`FIELDS` of every detection, ``(detection, field)``."""
    found = victim.detections
    direction = direction_of(np.nan_to_num(found.azimuth), np.nan_to_num(found.elevation))
    place = found.range[:, None] * direction
    ghosts = np.isin(np.arange(found.num_detections), victim.score.ghosts)
    columns = (
        *place.T,
        found.range,
        found.range_rate,
        found.azimuth,
        found.elevation,
        to_db(found.power),
        to_db(found.snr),
        ghosts,
    )
    return np.stack(columns, axis=-1).astype("<f4")
