"""Messages `sensor_msgs/msg/Imu` of ROS 2 in CDR, for whole blocks of samples at once.

Layout, little endian, behind four bytes of encapsulation: header (seconds, nanoseconds, frame), orientation with its
covariance, angular velocity with its covariance, linear acceleration with its covariance; doubles are aligned to eight
bytes. A covariance of zeros is one that is not known; −1 as its first element says that the datum is not there.
"""

from collections.abc import Sequence

import numpy as np

from procedures.core.arrays import Array

TYPE = "sensor_msgs/msg/Imu"
FRAME = "imu"
_LINE = "=" * 80
DEFINITION = f"""std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
{_LINE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
{_LINE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
"""Definition of the message with those it rests on, as bags carry it."""
MESSAGE = np.dtype(
    [
        ("encapsulation", "S4"),
        ("sec", "<i4"),
        ("nanosec", "<u4"),
        ("frame_length", "<u4"),
        ("frame", "S4"),
        ("orientation", "<f8", 4),
        ("orientation_covariance", "<f8", 9),
        ("angular_velocity", "<f8", 3),
        ("angular_velocity_covariance", "<f8", 9),
        ("linear_acceleration", "<f8", 3),
        ("linear_acceleration_covariance", "<f8", 9),
    ]
)
"""Message with the frame "imu": three letters and their end fill the place up to the doubles."""
ABSENT = -1.0


def imu_messages(stamps_ns: np.ndarray, rates: Array | None, forces: Array | None) -> np.ndarray:
    """Return the messages of samples in CDR, (n, bytes): `stamps_ns` (n,) from the epoch, rates (n, 3) in rad/s,
    specific forces (n, 3) in m/s². None: a triad that the recording does not have.
    """
    made = np.zeros(len(stamps_ns), MESSAGE)
    made["encapsulation"] = b"\x00\x01\x00\x00"
    made["sec"], made["nanosec"] = np.divmod(stamps_ns, 1_000_000_000)
    made["frame_length"] = len(FRAME) + 1
    made["frame"] = FRAME.encode()
    made["orientation"][:, 3] = 1.0
    made["orientation_covariance"][:, 0] = ABSENT
    for name, values in (("angular_velocity", rates), ("linear_acceleration", forces)):
        if values is None:
            made[f"{name}_covariance"][:, 0] = ABSENT
        else:
            made[name] = values
    return made


def columns_of(names: Sequence[str], triad: str, unit: str) -> list[int] | None:
    """Return the places of a triad's columns x, y, z in SI among the names of a sheet; None where one is missing."""
    wanted = [f"{triad}_{axis}_{unit}" for axis in "xyz"]
    return [names.index(name) for name in wanted] if set(wanted) <= set(names) else None
