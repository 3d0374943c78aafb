"""Reader of dumps of iXCOM messages (iMAR): IMURAW, IMUCORR, IMUCOMP.

Layout after the maker's own Python client and libixcom: header of 16 bytes with GPS time, payload, status and CRC-16.
"""

from binascii import crc_hqx
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from bench_service.formats.logs.framing import LONGEST, Counted, count_at_start, frames, require_frames
from bench_service.formats.logs.table import LogClock, LogTable, Numbers, triad
from procedures.core.recording import Quantity

NAME = "ixcom"
TITLE = "iXCOM messages (iMAR)"
MESSAGES = {0x00: "IMURAW", 0x01: "IMUCORR", 0x02: "IMUCOMP"}
_NOTES = {
    "IMURAW": "in the sensors' own axes, by the unit's factory calibration",
    "IMUCORR": "corrected by the unit, misalignment and lever arms applied",
    "IMUCOMP": "compensated by the navigator's own estimates: no longer the sensors' values",
}
_WEEK_S = 604_800
_HEAD = 16
_IMU = np.dtype(
    [
        ("head", "u1", 6),
        ("week", "<u2"),
        ("second", "<u4"),
        ("microsecond", "<u4"),
        ("acc", "<f4", 3),
        ("omg", "<f4", 3),
        ("status", "<u2"),
        ("crc", "<u2"),
    ]
)
_SOURCE = "the maker's client: m/s² and rad/s"


class _Messages:
    """Framing by the sync 0x7E and the length in the header."""

    def next(self, data: bytes, at: int) -> int:
        """Return the next sync."""
        return data.find(b"\x7e", at)

    def length(self, data: bytes, at: int) -> int:
        """Return the message's length; more than there is where its header is not whole."""
        if at + _HEAD > len(data):
            return _HEAD + LONGEST
        length = data[at + 4] | data[at + 5] << 8
        return length if length >= _HEAD + 4 else 0

    def is_whole(self, frame: bytes) -> bool:
        """Return whether the CRC is right: polynomial 0x1021, start 0, over all before it."""
        return crc_hqx(frame[:-2], 0) == frame[-2] | frame[-1] << 8


def begins(start: bytes) -> bool:
    """Return whether messages with a right checksum follow one another at the beginning."""
    return b"\x7e" in start[:4096] and count_at_start(start, _Messages()) >= 3


def opened(stream: BinaryIO, name: str) -> "IxcomLog":
    """Return a reader of an iXCOM dump. Raises `UnreadableFile`."""
    return IxcomLog(stream, name)


class IxcomLog:
    """Reader of one dump of iXCOM messages. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        self._rows: dict[int, int] = {}
        counted = Counted()
        others = 0
        for found in frames(stream, _Messages(), counted):
            for _, message in found:
                if message[1] in MESSAGES and len(message) == _IMU.itemsize:
                    self._rows[message[1]] = self._rows.get(message[1], 0) + 1
                else:
                    others += 1
        require_frames(counted, name, "iXCOM messages", "the file is not a dump of iXCOM, or its bytes were changed")
        self.warnings += counted.warnings("messages")
        if others and not self._rows:
            self.warnings.append(f"{others} messages are of other kinds than {', '.join(MESSAGES.values())}")

    def tables(self) -> list[LogTable]:
        """Return the kinds of inertial messages as tables."""
        return [self._table(MESSAGES[kind], rows) for kind, rows in sorted(self._rows.items())]

    def _table(self, title: str, rows: int) -> LogTable:
        columns = triad([f"omg_{a}" for a in "xyz"], "gyro", Quantity.ANGULAR_RATE, "rad/s", source=_SOURCE) + triad(
            [f"acc_{a}" for a in "xyz"], "accelerometer", Quantity.SPECIFIC_FORCE, "m/s^2", source=_SOURCE
        )
        clock = LogClock("gps_time", 1e-9, "the unit's GPS time of the measurement, since 1980")
        return LogTable(title, columns, (clock,), None, rows, (f"values are {_NOTES[title]}",))

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of one kind of message: for each named column its values, (n,)."""
        kind = next(k for k, title in MESSAGES.items() if title == table.name)
        for found in frames(self._stream, _Messages(), Counted()):
            part = b"".join(m for _, m in found if m[1] == kind and len(m) == _IMU.itemsize)
            data = np.frombuffer(part, _IMU)
            if not len(data):
                continue
            seconds = data["week"].astype(np.int64) * _WEEK_S + data["second"]
            time_ns = seconds * 1_000_000_000 + data["microsecond"].astype(np.int64) * 1000
            yield [time_ns if name == "gps_time" else data[name[:3]][:, "xyz".index(name[-1])] for name in columns]
