"""Reader of ASCII messages of a VectorNav unit: $VNIMU and $VNYMR with their checksums, captured as text.

Layout: VectorNav's user manuals (registers 54 and 27). Messages have no time: the rate has to be said.
"""

import re
from binascii import crc_hqx
from collections.abc import Iterator, Sequence
from functools import reduce
from operator import xor
from typing import BinaryIO

import numpy as np

from bench_service.formats.logs.framing import Counted, count_at_start, frames, require_frames
from bench_service.formats.logs.table import LogColumn, LogTable, Numbers, triad
from procedures.core.recording import Quantity

NAME = "vectornav"
TITLE = "VectorNav ASCII messages"
_FIELDS = {
    "VNIMU": (
        "mag_x",
        "mag_y",
        "mag_z",
        "acc_x",
        "acc_y",
        "acc_z",
        "gyro_x",
        "gyro_y",
        "gyro_z",
        "temperature",
        "pressure",
    ),
    "VNYMR": (
        "yaw",
        "pitch",
        "roll",
        "mag_x",
        "mag_y",
        "mag_z",
        "acc_x",
        "acc_y",
        "acc_z",
        "gyro_x",
        "gyro_y",
        "gyro_z",
    ),
}
_LONGEST_LINE = 512
_SUM = re.compile(rb"\*([0-9A-Fa-f]{2}|[0-9A-Fa-f]{4})\s*$")
_SOURCE = "VectorNav's manual"
_RATE = "messages have no time: give rate_hz, the unit's asynchronous output rate"


class _Messages:
    """Framing by $VN and the end of the line."""

    def next(self, data: bytes, at: int) -> int:
        """Return the next dollar sign."""
        return data.find(b"$", at)

    def length(self, data: bytes, at: int) -> int:
        """Return the length of the line."""
        end = data.find(b"\n", at, at + _LONGEST_LINE)
        if end < 0:
            return len(data) - at + 1 if len(data) - at < _LONGEST_LINE else 0
        return end + 1 - at if data[at : at + 3] == b"$VN" else 0

    def is_whole(self, frame: bytes) -> bool:
        """Return whether the checksum is right: exclusive or of the bytes between $ and *, or CRC-16."""
        match = _SUM.search(frame)
        if match is None:
            return False
        body = frame[1 : match.start()]
        if len(match[1]) == 2:
            return reduce(xor, body, 0) == int(match[1], 16)
        return crc_hqx(body, 0) == int(match[1], 16)


def begins(start: bytes) -> bool:
    """Return whether messages with a right checksum follow one another at the beginning."""
    return b"$VN" in start[:4096] and count_at_start(start, _Messages()) >= 2


def opened(stream: BinaryIO, name: str) -> "VectorNav":
    """Return a reader of a VectorNav capture. Raises `UnreadableFile`."""
    return VectorNav(stream, name)


class VectorNav:
    """Reader of one capture of VectorNav's ASCII messages. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream = stream
        self.warnings: list[str] = []
        self._counts: dict[str, int] = {}
        counted = Counted()
        for found in frames(stream, _Messages(), counted):
            for _, line in found:
                key = line[1:6].decode("ascii", "replace")
                if key in _FIELDS and _values(line, key) is not None:
                    self._counts[key] = self._counts.get(key, 0) + 1
        require_frames(counted, name, "messages of a VectorNav unit", "messages $VNIMU and $VNYMR are read")
        self.warnings += counted.warnings("messages")

    def tables(self) -> list[LogTable]:
        """Return the kinds of messages as tables."""
        columns = triad([f"gyro_{a}" for a in "xyz"], "gyro", Quantity.ANGULAR_RATE, "rad/s", source=_SOURCE) + triad(
            [f"acc_{a}" for a in "xyz"], "accelerometer", Quantity.SPECIFIC_FORCE, "m/s^2", source=_SOURCE
        )
        temperature = LogColumn("temperature", Quantity.TEMPERATURE, "degC", channel="temperature", source=_SOURCE)
        return [
            LogTable(key, columns + ((temperature,) if key == "VNIMU" else ()), (), None, count, (), (_RATE,))
            for key, count in self._counts.items()
        ]

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of one kind of message: for each named column its values, (n,)."""
        places = [_FIELDS[table.name].index(name) for name in columns]
        start = f"${table.name}".encode()
        for found in frames(self._stream, _Messages(), Counted()):
            rows = [v for _, line in found if line.startswith(start) and (v := _values(line, table.name)) is not None]
            if rows:
                data = np.array(rows)
                yield [np.ascontiguousarray(data[:, place]) for place in places]


def _values(line: bytes, key: str) -> list[float] | None:
    cells = line[1 : line.rfind(b"*")].split(b",")[1:]
    if len(cells) != len(_FIELDS[key]):
        return None
    try:
        return [float(cell) for cell in cells]
    except ValueError:
        return None
