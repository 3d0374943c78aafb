"""Reader of dumps of a KVH 1750 (format A): frames of 36 bytes, big-endian, with a CRC-32.

Layout after the published driver ros_kvh1750; not confirmed on a device of ours.
"""

from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from bench_service.formats.logs.framing import Counted, count_at_start, crc32_mpeg2, frames, require_frames
from bench_service.formats.logs.table import LogColumn, LogTable, Numbers, triad
from procedures.core.recording import Quantity

NAME = "kvh1750"
TITLE = "KVH 1750 frames, format A"
SYNC = b"\xfe\x81\xff\x55"
_FRAME = np.dtype(
    [
        ("sync", "S4"),
        ("rotation", ">f4", 3),
        ("acceleration", ">f4", 3),
        ("status", "u1"),
        ("sequence", "u1"),
        ("temperature", ">i2"),
        ("crc", ">u4"),
    ]
)
SEQUENCE = 128
_ALL_VALID = 0x77
_ASKS = (
    "a frame does not say the rate of the frames: give rate_hz (the unit's DR)",
    "a frame does not say what the rotation is: taken as rad/s (ROTFMT=RATE, ROTUNITS=RAD); ROTFMT=DELTA needs the "
    "quantity angle_increment, ROTUNITS=DEG the unit deg/s or deg",
    "a frame does not say the unit of its temperature: taken as degC (TEMPUNITS=C)",
)
_SOURCE = "a published driver; not confirmed on a device of ours"


class _Frames:
    """Framing by the sync of format A."""

    def next(self, data: bytes, at: int) -> int:
        """Return the next sync, or a piece of one at the end."""
        found = data.find(SYNC, at)
        if found >= 0:
            return found
        tail = next((k for k in (3, 2, 1) if data.endswith(SYNC[:k]) and len(data) - k >= at), 0)
        return len(data) - tail if tail else -1

    def length(self, data: bytes, at: int) -> int:
        """Return the length of a frame."""
        return _FRAME.itemsize

    def is_whole(self, frame: bytes) -> bool:
        """Return whether the CRC is right."""
        return frame.startswith(SYNC) and crc32_mpeg2(frame[:-4]) == int.from_bytes(frame[-4:], "big")


def begins(start: bytes) -> bool:
    """Return whether frames with a right checksum follow one another at the beginning."""
    return SYNC in start[:4096] and count_at_start(start, _Frames()) >= 2


def opened(stream: BinaryIO, name: str) -> "Kvh1750":
    """Return a reader of a KVH 1750 dump. Raises `UnreadableFile`."""
    return Kvh1750(stream, name)


class Kvh1750:
    """Reader of one dump of KVH 1750 frames. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        counted = Counted()
        lost = invalid = 0
        first_lost, last, row = -1, -1, 0
        for found in frames(stream, _Frames(), counted):
            data = np.frombuffer(b"".join(frame for _, frame in found), _FRAME)
            sequence = data["sequence"].astype(np.int64)
            steps = (np.diff(sequence, prepend=sequence[:1] - 1 if last < 0 else last) - 1) % SEQUENCE
            if first_lost < 0 and np.any(steps):
                first_lost = row + int(np.flatnonzero(steps)[0])
            lost += int(steps.sum())
            invalid += int(np.count_nonzero((data["status"] & _ALL_VALID) != _ALL_VALID))
            last, row = int(sequence[-1]), row + len(data)
        self._count = row
        require_frames(counted, name, "frames of a KVH 1750", "format A is read; formats B and C have other lengths")
        self.warnings += counted.warnings("frames")
        if lost:
            self.warnings.append(
                f"{lost} frames are missing by their sequence number, first before row {first_lost + 1}; frames have "
                "no time, so rows follow one another as if nothing were missing"
            )
        if invalid:
            self.warnings.append(f"{invalid} frames mark a gyro or an accelerometer as not valid")

    def tables(self) -> list[LogTable]:
        """Return the frames, all of one kind, as one table."""
        columns = (
            *triad([f"rotation_{a}" for a in "xyz"], "gyro", Quantity.ANGULAR_RATE, "rad/s", source=_SOURCE),
            *triad([f"acceleration_{a}" for a in "xyz"], "accelerometer", Quantity.SPECIFIC_FORCE, "g", source=_SOURCE),
            LogColumn("temperature", Quantity.TEMPERATURE, "degC", channel="temperature", source=_SOURCE),
            LogColumn("status"),
            LogColumn("sequence"),
        )
        return [LogTable("format A", columns, (), None, self._count, (), _ASKS)]

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of frames: for each named column its values, (n,)."""
        for found in frames(self._stream, _Frames(), Counted()):
            data = np.frombuffer(b"".join(frame for _, frame in found), _FRAME)
            yield [_column(data, name) for name in columns]


def _column(data: Numbers, name: str) -> Numbers:
    field, _, axis = name.rpartition("_")
    column = data[field][:, "xyz".index(axis)] if field else data[name]
    return column.astype(column.dtype.newbyteorder("="))
