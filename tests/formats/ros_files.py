"""ROS bags with the known motion, written by rosbags."""

from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from tests.formats.reading import FORCES, RATES, ROWS, TIMES_NS

IMU = "sensor_msgs/msg/Imu"
ROS2 = get_typestore(Stores.ROS2_HUMBLE)
ROS1 = get_typestore(Stores.ROS1_NOETIC)
LATE_NS = 700_000
"""Delay of the recorder's stamps against the sender's."""


def message(store: Any, row: int, frame: str = "imu_link") -> Any:
    """Build the message of one row of the known motion."""
    types = store.types
    time = types["builtin_interfaces/msg/Time"](int(TIMES_NS[row] // 10**9), int(TIMES_NS[row] % 10**9))
    header = types["std_msgs/msg/Header"]
    stamped = header(row, time, frame) if store is ROS1 else header(time, frame)
    vector, zeros = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    attitude = types["geometry_msgs/msg/Quaternion"](0.1, 0.2, 0.3, 0.4)
    return types[IMU](stamped, attitude, zeros, vector(*RATES[row]), zeros + 5, vector(*FORCES[row]), zeros + 7)


def bag2(folder: Path, plugin: StoragePlugin, frames: Any = None, packed: CompressionMode | None = None) -> bytes:
    """Write a ROS 2 bag; `frames`: row -> frame_id; `packed`: by zstd, each message or the storage."""
    writer = Writer2(folder, version=9, storage_plugin=plugin)
    if packed is not None:
        writer.set_compression(packed, CompressionFormat.ZSTD)
    with writer:
        other = writer.add_connection("/temperature", "sensor_msgs/msg/Temperature", typestore=ROS2)
        imu = writer.add_connection("/imu/data", IMU, typestore=ROS2)
        for row in range(ROWS):
            frame = "imu_link" if frames is None else frames(row)
            writer.write(imu, int(TIMES_NS[row]) + LATE_NS, ROS2.serialize_cdr(message(ROS2, row, frame), IMU))
            if row % 100 == 0:
                degrees = ROS2.types["sensor_msgs/msg/Temperature"](message(ROS2, row).header, 25.0 + row, 0.0)
                data = ROS2.serialize_cdr(degrees, "sensor_msgs/msg/Temperature")
                writer.write(other, int(TIMES_NS[row]) + LATE_NS + 1, data)
    return next(folder.glob("*.db3" if plugin is StoragePlugin.SQLITE3 else "*.mcap")).read_bytes()


def bag1(path: Path, compression: Writer1.CompressionFormat | None, chunk_bytes: int | None = None) -> bytes:
    """Write a ROS 1 bag."""
    writer = Writer1(path)
    if chunk_bytes is not None:
        writer.chunk_threshold = chunk_bytes
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        imu = writer.add_connection("/imu/data", IMU, typestore=ROS1)
        for row in range(ROWS):
            writer.write(imu, int(TIMES_NS[row]) + LATE_NS, ROS1.serialize_ros1(message(ROS1, row), IMU))
    return path.read_bytes()
