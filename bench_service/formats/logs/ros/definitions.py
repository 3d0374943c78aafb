"""Definitions of ROS message types, parsed by rosbags; those of a distribution where a file has none."""

from typing import Any

from bench_service.formats.logs.optional import needed
from bench_service.formats.logs.ros.messages import Types

MOST_TEXT = 200_000
"""Largest definition that is parsed [characters]."""


def parsed(text: str, type_name: str, encoding: str, file: str) -> Types | None:
    """Return the types of a message definition with those it includes; None: it cannot be parsed."""
    typesys = needed("rosbags.typesys", file)
    if len(text) > MOST_TEXT:
        return None
    try:
        if encoding == "ros2idl":
            found: dict[str, Any] = dict(typesys.get_types_from_idl(text))
        else:
            found = dict(typesys.get_types_from_msg(text, full_name(type_name)))
    except Exception:  # whatever a foreign text does to the parser: its topic is not read
        return None
    return {**distribution(file), **found} if full_name(type_name) in found else None


def distribution(file: str) -> Types:
    """Return the definitions of ROS 2 Humble, which has the common types unchanged since."""
    typesys = needed("rosbags.typesys", file)
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    return {name: store.fielddefs[name] for name in _COMMON if name in store.fielddefs}


def full_name(type_name: str) -> str:
    """Return a type's name with its part "msg": sensor_msgs/Imu -> sensor_msgs/msg/Imu."""
    parts = type_name.split("/")
    return type_name if len(parts) != 2 else f"{parts[0]}/msg/{parts[1]}"


_COMMON = (
    "builtin_interfaces/msg/Time",
    "builtin_interfaces/msg/Duration",
    "std_msgs/msg/Header",
    "geometry_msgs/msg/Vector3",
    "geometry_msgs/msg/Vector3Stamped",
    "geometry_msgs/msg/Quaternion",
    "geometry_msgs/msg/Accel",
    "geometry_msgs/msg/AccelStamped",
    "geometry_msgs/msg/Twist",
    "geometry_msgs/msg/TwistStamped",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/MagneticField",
    "sensor_msgs/msg/Temperature",
)
