"""Topics of PX4: the meaning of their fields, and FIFO topics as plain rows.

Units follow PX4's message definitions (``msg/*.msg`` of PX4-Autopilot); a ULog holds names and types, no units.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, Numbers, triad
from procedures.core.recording import Quantity

_PX4 = "PX4's message definition; a ULog names no units"
_CLOCKS = (
    ("timestamp_sample", "the flight controller's clock at the measurement"),
    ("timestamp", "the flight controller's clock at the publication of the message"),
)
_THINNED = (
    "the logger may thin this topic by leaving rows out, without a filter: its rate is then not the sensor's, and the "
    "noise that is found is that of unfiltered samples"
)
_FIFO = (
    "FIFO batches are unrolled: the newest sample of a batch is taken to be at timestamp_sample, those before it each "
    "dt earlier, and raw values are multiplied by the batch's own scale"
)
FIFO_FIELDS = ("timestamp_sample", "dt", "scale", "samples", "x[0]", "y[0]", "z[0]")
_AXES = ("x", "y", "z")


def is_fifo(names: Iterable[str]) -> bool:
    """Return whether a topic holds batches of a FIFO."""
    have = set(names)
    return all(field in have for field in FIFO_FIELDS)


def topic_table(title: str, topic: str, names: Sequence[str], types: Mapping[str, str], rows: int) -> LogTable:
    """Return the table of a topic. `types`: numpy's code of each field."""
    if is_fifo(names):
        return _fifo_table(title, topic, sum(n.startswith("x[") for n in names))
    clocks = tuple(LogClock(field, 1e-6, words) for field, words in _CLOCKS if field in names)
    known, notes = _meaning(topic, names, types)
    return LogTable(title, tuple(known.get(n, LogColumn(n)) for n in names), clocks, None, rows, tuple(notes))


def _meaning(topic: str, names: Sequence[str], types: Mapping[str, str]) -> tuple[dict[str, LogColumn], list[str]]:
    notes: list[str] = []
    columns: tuple[LogColumn, ...] = ()
    if topic == "sensor_combined":
        columns = _vector("gyro_rad", "gyro", Quantity.ANGULAR_RATE, "rad/s") + _vector(
            "accelerometer_m_s2", "accelerometer", Quantity.SPECIFIC_FORCE, "m/s^2"
        )
        notes = ["values are means over gyro_integral_dt and accelerometer_integral_dt, the bias estimate taken off"]
        if types.get("gyro_integral_dt", "").endswith("f4"):
            notes.append("gyro_integral_dt is float32: seconds, as old firmware wrote it, not microseconds")
    elif topic in ("sensor_gyro", "sensor_accel"):
        gyro = topic == "sensor_gyro"
        kind, quantity = ("gyro", Quantity.ANGULAR_RATE) if gyro else ("accelerometer", Quantity.SPECIFIC_FORCE)
        columns = triad(_AXES, kind, quantity, "rad/s" if gyro else "m/s^2", source=_PX4)
        notes = [_THINNED]
    elif topic == "vehicle_imu":
        columns = _vector("delta_angle", "gyro", Quantity.ANGLE_INCREMENT, "rad") + _vector(
            "delta_velocity", "accelerometer", Quantity.VELOCITY_INCREMENT, "m/s"
        )
        notes = ["increments over delta_angle_dt and delta_velocity_dt [µs], which may vary from row to row", _THINNED]
    elif topic in ("vehicle_acceleration", "vehicle_angular_velocity"):
        gyro = topic == "vehicle_angular_velocity"
        kind, quantity = ("gyro", Quantity.ANGULAR_RATE) if gyro else ("accelerometer", Quantity.SPECIFIC_FORCE)
        columns = _vector("xyz", kind, quantity, "rad/s" if gyro else "m/s^2")
        notes = ["values are filtered and corrected by the flight controller, not the sensor's own"]
    known = {column.name: column for column in columns if column.name in names}
    if "temperature" in names and known:
        known["temperature"] = LogColumn(
            "temperature", Quantity.TEMPERATURE, "degC", channel="temperature", source=_PX4
        )
    if any(n.startswith("clip_counter") or n.endswith("_clipping") for n in names):
        notes.append("the topic counts clipped samples (clip_counter, …_clipping): look whether they are 0")
    return known, notes


def _vector(field: str, kind: str, quantity: Quantity, unit: str) -> tuple[LogColumn, ...]:
    return triad([f"{field}[{i}]" for i in range(3)], kind, quantity, unit, source=_PX4)


def _fifo_table(title: str, topic: str, most: int) -> LogTable:
    gyro = "gyro" in topic
    kind, quantity = ("gyro", Quantity.ANGULAR_RATE) if gyro else ("accelerometer", Quantity.SPECIFIC_FORCE)
    columns = triad(_AXES, kind, quantity, "rad/s" if gyro else "m/s^2", source=_PX4)
    clock = LogClock("sample_time", 1e-6, "the flight controller's clock: timestamp_sample less whole dt")
    return LogTable(title, columns, (clock,), notes=(f"{_FIFO} (at most {most} samples in a batch)",))


def unrolled(rows: Any, columns: Sequence[str]) -> list[Numbers]:
    """Return batches of a FIFO unrolled: the samples of each row in order, in physical units, with their own times
    [µs].
    """
    most = sum(name.startswith("x[") for name in rows.dtype.names)
    count = np.minimum(rows["samples"].astype(np.int64), most)
    taken = np.arange(most) < count[:, None]
    found: list[Numbers] = []
    for name in columns:
        if name == "sample_time":
            back = (count[:, None] - 1 - np.arange(most)) * rows["dt"].astype(np.float64)[:, None]
            late = rows["timestamp_sample"].astype(np.int64)[:, None] - np.rint(back).astype(np.int64)
            found.append(late[taken])
        else:
            raw = np.stack([rows[f"{name}[{i}]"] for i in range(most)], axis=1)
            found.append((raw * rows["scale"].astype(np.float64)[:, None])[taken])
    return found
