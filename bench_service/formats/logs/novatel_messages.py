"""Messages of NovAtel with inertial data: their records, and what their fields mean.

Source: NovAtel's OEM7 manual; a CORRIMUS says in `count` over how many samples of the unit its values are summed.
"""

from collections.abc import Collection
from typing import Any

import numpy as np

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.novatel_scales import SCALES, SOURCE
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, Numbers, triad
from procedures.core.recording import Quantity

INSCONFIG = 1945
IDS = {
    268: "RAWIMU",
    325: "RAWIMUS",
    1461: "RAWIMUX",
    1462: "RAWIMUSX",
    812: "CORRIMUDATA",
    813: "CORRIMUDATAS",
    2264: "CORRIMUS",
    1362: "IMURATECORRIMUS",
}
_COUNTS = ("acc_z", "acc_minus_y", "acc_x", "gyro_z", "gyro_minus_y", "gyro_x")
_RATES = ("pitch", "roll", "yaw", "lateral", "longitudinal", "vertical")
_RAW = [("week", "<u4"), ("seconds", "<f8"), ("status", "<u4"), *((n, "<i4") for n in _COUNTS)]
_RAWX = [
    ("info", "u1"),
    ("type", "u1"),
    ("week", "<u2"),
    ("seconds", "<f8"),
    ("status", "<u4"),
    *((n, "<i4") for n in _COUNTS),
]
_CORRECTED = [("week", "<u4"), ("seconds", "<f8"), *((n, "<f8") for n in _RATES)]
_SUMMED = [("count", "<u4"), *((n, "<f8") for n in _RATES), ("reserved1", "<f4"), ("reserved2", "<f4")]
_RECORDS: dict[str, list[tuple[str, str]]] = {
    "RAWIMU": _RAW,
    "RAWIMUS": _RAW,
    "RAWIMUX": _RAWX,
    "RAWIMUSX": _RAWX,
    "CORRIMUDATA": _CORRECTED,
    "CORRIMUDATAS": _CORRECTED,
    "IMURATECORRIMUS": _CORRECTED,
    "CORRIMUS": _SUMMED,
}
_HEX = ("info", "status")
_HEAD = [("head_week", "<u2"), ("head_ms", "<u4")]
_WEEK_NS = 604_800_000_000_000
TIME, HEAD_TIME = "gps_time", "header_time"
_GRAVITY = (
    "the receiver has taken gravity, the Earth's rate and its own estimates of the errors off: these are no specific "
    "forces and no rates of a calibration; log RAWIMUSX for that"
)


class Rows:
    """Gathers the logs of one kind as an array of records, until they are taken."""

    def __init__(self, key: str, name: str) -> None:
        self._key, self._name = key, name
        self._body = np.dtype(_RECORDS[key])
        self._dtype = np.dtype([*_HEAD, *_RECORDS[key]])
        self._binary: list[bytes] = []
        self._text: list[tuple[Any, ...]] = []
        self._parts: list[Any] = []

    def add_binary(self, stamp: bytes, body: bytes, at: int) -> None:
        """Add a binary log, by its time (week, ms) and body. Raises `UnreadableFile` for a body of another length."""
        if len(body) != self._body.itemsize:
            raise UnreadableFile(
                self._name,
                f"the {self._key} at byte {at} has a body of {len(body)} bytes, {self._body.itemsize} are known: the "
                "file mixes versions of the log",
            )
        if self._text:
            self._close_text()
        self._binary.append(stamp + body)

    def add_text(self, line: bytes, at: int) -> None:
        """Add an ASCII log. Raises `UnreadableFile` for one with other fields."""
        if self._binary:
            self._close_binary()
        head, _, rest = line.decode("ascii", "replace").partition(";")
        values = rest.rpartition("*")[0].split(",")
        fields = head.split(",")
        week, seconds = fields[5:7] if head.startswith("#") else fields[1:3]
        try:
            found = [
                int(value, 16) if name in _HEX else float(value) if "f" in code else int(value)
                for (name, code), value in zip(_RECORDS[self._key], values, strict=True)
            ]
            self._text.append((int(week), round(float(seconds) * 1000), *found))
        except ValueError as error:
            raise UnreadableFile(
                self._name,
                f"the {self._key}A at byte {at} has {len(values)} fields, {len(_RECORDS[self._key])} are known, or one "
                "of them is not a number",
            ) from error

    def _close_binary(self) -> None:
        self._parts.append(np.frombuffer(b"".join(self._binary), self._dtype))
        self._binary = []

    def _close_text(self) -> None:
        self._parts.append(np.array(self._text, self._dtype))
        self._text = []

    def taken(self) -> Any:
        """Return all records that were gathered, and forget them."""
        if self._binary:
            self._close_binary()
        if self._text:
            self._close_text()
        parts, self._parts = self._parts, []
        return np.concatenate(parts) if parts else np.empty(0, self._dtype)

    def column(self, data: Any, name: str) -> Numbers:
        """Return a column of records; times are nanoseconds of GPS time since 1980."""
        if name == HEAD_TIME or (name == TIME and "seconds" not in data.dtype.names):
            return data["head_week"].astype(np.int64) * _WEEK_NS + data["head_ms"].astype(np.int64) * 1_000_000
        if name == TIME:
            return data["week"].astype(np.int64) * _WEEK_NS + np.rint(data["seconds"] * 1e9).astype(np.int64)
        return np.ascontiguousarray(data[name])


def message_table(key: str, rows: int, types: Collection[int], encrypted: int) -> LogTable:
    """Return the table of one kind of log. `types`: types of unit that the file names."""
    head = LogClock(HEAD_TIME, 1e-9, "GPS time in the log's header, whole milliseconds")
    if "week" not in {name for name, _ in _RECORDS[key]}:
        return _corrected(key, rows, (head,))
    clocks = (LogClock(TIME, 1e-9, "GPS time of the measurement, in the log's body"), head)
    return _raw(key, rows, clocks, types, encrypted) if key.startswith("RAW") else _corrected(key, rows, clocks)


def _raw(key: str, rows: int, clocks: tuple[LogClock, ...], types: Collection[int], encrypted: int) -> LogTable:
    asks: list[str] = []
    scales = SCALES.get(next(iter(types))) if len(types) == 1 else None
    if encrypted:
        asks.append(f"{encrypted} logs are encrypted (bit 1 of the information): their counts mean nothing here")
    if scales is None:
        named = ", ".join(str(t) for t in sorted(types)) or "none"
        asks.append(f"types of unit that the file names: {named}; without one known type the scale is left as counts")
        gyro, force = (Quantity.ANGLE_INCREMENT, "count", 1.0), (Quantity.VELOCITY_INCREMENT, "count", 1.0)
        source, notes = "no scale is known", ()
    else:
        gyro, force = (
            (scales.gyro, scales.angle_unit, scales.angle),
            (scales.force, scales.velocity_unit, scales.velocity),
        )
        source, notes = SOURCE, (f"unit {scales.title} (type {next(iter(types))})",)
    columns: list[LogColumn] = []
    for kind, prefix, (quantity, unit, scale) in (("gyro", "gyro", gyro), ("accelerometer", "acc", force)):
        for column in triad([f"{prefix}_x", f"{prefix}_minus_y", f"{prefix}_z"], kind, quantity, unit, scale, source):
            minus = column.name.endswith("minus_y")
            columns.append(
                LogColumn(column.name, quantity, unit, -scale if minus else scale, 0.0, column.channel, source)
            )
    columns.append(LogColumn("status"))
    return LogTable(key, tuple(columns), clocks, None, rows, notes, tuple(asks))


def _corrected(key: str, rows: int, clocks: tuple[LogClock, ...]) -> LogTable:
    source = "NovAtel's manual: rad and m/s a sample"
    columns = triad(_RATES[:3], "gyro", Quantity.ANGLE_INCREMENT, "rad", source=source) + triad(
        _RATES[3:], "accelerometer", Quantity.VELOCITY_INCREMENT, "m/s", source=source
    )
    notes: tuple[str, ...] = ("x is lateral (right), y longitudinal (forward), z vertical (up)",)
    if key == "CORRIMUS":
        columns += (LogColumn("count"),)
        notes += ("each record sums over `count` samples of the unit: its increments are those of the whole interval",)
    else:
        notes += ("an increment is that of one sample of the unit, also where the log is slower than the unit",)
    return LogTable(key, columns, clocks, None, rows, notes, (_GRAVITY,))
