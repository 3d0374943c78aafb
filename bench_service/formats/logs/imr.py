"""Reader of Waypoint IMR files: a header of 512 bytes, then records of a time and six integers.

Layout after Waypoint's published description of the format and public readers; not confirmed against a file of the
maker's. The header says byte order, increments or rates, the rate and both scale factors.
"""

import struct
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from bench_service.formats.bounds import quoted
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.bytes_at import exactly, size_of
from bench_service.formats.logs.table import BLOCK_ROWS, LogClock, LogTable, Numbers, triad
from procedures.core.recording import Quantity

NAME = "imr"
TITLE = "Waypoint IMR"
MAGIC = b"$IMURAW"
HEADER_BYTES = 512
_HEAD = "8sbdiidddiid32s4s32s"
_CLOCKS = {
    0: "GPS seconds of the week (the header leaves it open)",
    1: "UTC seconds of the week",
    2: "GPS seconds of the week",
}
_SOURCE = "the header's scale factor"


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is an IMR."""
    return start.startswith(MAGIC) and start[7:8] == b"\0"


def opened(stream: BinaryIO, name: str) -> "Imr":
    """Return a reader of an IMR file. Raises `UnreadableFile`."""
    return Imr(stream, name)


class Imr:
    """Reader of one Waypoint IMR file. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        stream.seek(0)
        head = exactly(stream, HEADER_BYTES, name, "the header of an IMR file")
        if head[8] not in (0, 1):
            raise UnreadableFile(name, f"byte 8 says the byte order {head[8]}; 0 (Intel) and 1 (Motorola) are known")
        self._order = ">" if head[8] else "<"
        (
            _,
            _,
            self._version,
            self._angles,
            self._velocities,
            self._rate_hz,
            self._gyro,
            self._acc,
            self._clock,
            _,
            self._bias_s,
            imu,
            _,
            program,
        ) = struct.unpack(self._order + _HEAD, head[: struct.calcsize(self._order + _HEAD)])
        self._imu, self._program = _text(imu), _text(program)
        self._require_header()
        self._dtype = np.dtype([("time", f"{self._order}f8"), ("counts", f"{self._order}i4", 6)])
        data = size_of(stream) - HEADER_BYTES
        self._rows = data // self._dtype.itemsize
        if data % self._dtype.itemsize:
            at = HEADER_BYTES + self._rows * self._dtype.itemsize
            self.warnings.append(f"the file is cut off in the record at byte {at}: what is before was read")

    def _require_header(self) -> None:
        for label, value in (("gyro scale factor", self._gyro), ("accelerometer scale factor", self._acc)):
            if not (np.isfinite(value) and value != 0.0):
                raise UnreadableFile(
                    self._name, f"its header has the {label} {value!r}: it is damaged, or byte 8 is wrong"
                )
        if not (np.isfinite(self._rate_hz) and 0.1 <= self._rate_hz <= 20_000.0):
            raise UnreadableFile(
                self._name,
                f"its header has the rate {self._rate_hz!r} Hz: it is damaged, or byte 8 (the byte order) is wrong",
            )

    def tables(self) -> list[LogTable]:
        """Return the records as one table. Raises `UnreadableFile` where the file has none."""
        if not self._rows:
            raise UnreadableFile(self._name, "has a header and no records")
        gyro, acc, asks = self._gyro, self._acc, list[str]()
        if abs(gyro) > 1.0 or abs(acc) > 1.0:
            asks.append(
                f"the scale factors {gyro:g} and {acc:g} are above 1: some writers put the reciprocal there; the "
                "proposal has the reciprocals"
            )
            gyro, acc = (1.0 / gyro if abs(gyro) > 1.0 else gyro), (1.0 / acc if abs(acc) > 1.0 else acc)
        asks.append("angles are taken as deg (deg/s), as Waypoint has it; some writers put radians there")
        angle = (Quantity.ANGLE_INCREMENT, "deg") if self._angles else (Quantity.ANGULAR_RATE, "deg/s")
        force = (Quantity.VELOCITY_INCREMENT, "m/s") if self._velocities else (Quantity.SPECIFIC_FORCE, "m/s^2")
        columns = triad([f"gyro_{a}" for a in "xyz"], "gyro", *angle, gyro, _SOURCE) + triad(
            [f"acc_{a}" for a in "xyz"], "accelerometer", *force, acc, _SOURCE
        )
        clock = LogClock("time", 1.0, _CLOCKS.get(self._clock, f"kind of time {self._clock}, which is not known"))
        notes = [
            f"unit {quoted(self._imu)}, written by {quoted(self._program)}, version {self._version:g}; axes as the "
            "file has them"
        ]
        if self._bias_s:
            notes.append(f"the header has a bias of the time tags of {self._bias_s:g} s, which is not applied")
        return [LogTable("records", columns, (clock,), self._rate_hz, self._rows, tuple(notes), tuple(asks))]

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of records: for each named column its values, (n,)."""
        for start in range(0, self._rows, BLOCK_ROWS):
            count = min(BLOCK_ROWS, self._rows - start)
            self._stream.seek(HEADER_BYTES + start * self._dtype.itemsize)
            data = np.frombuffer(self._stream.read(count * self._dtype.itemsize), self._dtype)
            yield [_column(data, name) for name in columns]


def _column(data: Numbers, name: str) -> Numbers:
    if name == "time":
        return data["time"].astype(np.float64)
    place = "xyz".index(name[-1]) + (3 if name.startswith("acc") else 0)
    return data["counts"][:, place].astype(np.int64)


def _text(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("latin-1").strip()
