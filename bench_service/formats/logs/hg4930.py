"""Reader of dumps of a Honeywell HG4930: control messages of 20 bytes, inertial messages of 44 bytes, with a sum.

Layout and scales: Honeywell HG4930 Performance and Installation Manual. Times are not sent; messages come at 600 Hz, of
which each sixth is inertial, at 100 Hz.
"""

from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np

from bench_service.formats.logs.framing import Counted, count_at_start, frames, require_frames
from bench_service.formats.logs.table import LogTable, Numbers, triad
from procedures.core.recording import Quantity
from procedures.core.units import FOOT

NAME = "hg4930"
TITLE = "HG4930 messages"

_SIZES = {1: 20, 2: 44}
_CONTROL = [("head", "u1", 2), ("rate", "<i2", 3), ("force", "<i2", 3), ("status", "<u2", 2)]
_INERTIAL = np.dtype([*_CONTROL, ("angle", "<i4", 3), ("velocity", "<i4", 3), ("sum", "<u2")])
_BOTH = np.dtype(_CONTROL)
_FAILED = 0x0070
"""Bits of status 1 that are 1 where the unit, a gyro or an accelerometer has failed."""
_SOURCE = "Honeywell's manual of the HG4930"
_START = b"\x55\x55" * 6


class _Messages:
    """Framing by address, identifier and sum of 16-bit words."""

    def next(self, data: bytes, at: int) -> int:
        """Return the next address byte."""
        return data.find(b"\x0e", at)

    def length(self, data: bytes, at: int) -> int:
        """Return the length that the identifier gives."""
        return _SIZES.get(data[at + 1], 0) if at + 1 < len(data) else 44

    def is_whole(self, frame: bytes) -> bool:
        """Return whether the sum of all words before the last equals it."""
        words = np.frombuffer(frame, "<u2")
        return int(words[:-1].sum(dtype=np.uint32)) & 0xFFFF == int(words[-1])


def begins(start: bytes) -> bool:
    """Return whether messages with a right sum follow one another at the beginning."""
    return b"\x0e" in start[:4096] and count_at_start(start, _Messages()) >= 6


def opened(stream: BinaryIO, name: str) -> "Hg4930":
    """Return a reader of an HG4930 dump. Raises `UnreadableFile`."""
    return Hg4930(stream, name)


class Hg4930:
    """Reader of one dump of HG4930 messages. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        self._counts = {1: 0, 2: 0}
        counted = Counted()
        starting = failed = lost = 0
        last = -1
        for found in frames(stream, _Messages(), counted):
            for _, message in found:
                if message[2:14] == _START:
                    starting += 1
                    continue
                self._counts[message[1]] += 1
                failed += bool(message[14] & _FAILED)
                counter = message[14] & 3
                lost += last >= 0 and (counter - last) % 4 != 1
                last = counter
        require_frames(counted, name, "messages of an HG4930", "address 0x0E with identifiers 1 and 2 is read")
        self.warnings += counted.warnings("messages")
        if starting:
            self.warnings.append(f"{starting} messages are the pattern that is sent after power-up, and were left out")
        if failed:
            self.warnings.append(f"{failed} messages report that the unit, a gyro or an accelerometer has failed")
        if lost:
            self.warnings.append(
                f"the two-bit counter jumps in {lost} places: messages are missing there; they have no time, so rows "
                "follow one another as if nothing were missing"
            )

    def tables(self) -> list[LogTable]:
        """Return two tables: the inertial messages, and all messages with their instantaneous rates."""
        found: list[LogTable] = []
        note = "messages have no time: the rate is the manual's, and a lost message is seen by the counter alone"
        if self._counts[2]:
            columns = triad(
                [f"angle_{a}" for a in "xyz"], "gyro", Quantity.ANGLE_INCREMENT, "rad", 2.0**-33, _SOURCE
            ) + triad(
                [f"velocity_{a}" for a in "xyz"],
                "accelerometer",
                Quantity.VELOCITY_INCREMENT,
                "m/s",
                2.0**-27 * FOOT,
                _SOURCE,
            )
            found.append(LogTable("inertial", columns, (), 100.0, self._counts[2], (note,), rank=1))
        columns = triad(
            [f"rate_{a}" for a in "xyz"], "gyro", Quantity.ANGULAR_RATE, "rad/s", 600.0 * 2.0**-20, _SOURCE
        ) + triad(
            [f"force_{a}" for a in "xyz"],
            "accelerometer",
            Quantity.SPECIFIC_FORCE,
            "m/s^2",
            600.0 * 2.0**-14 * FOOT,
            _SOURCE,
        )
        coarse = "rates and forces of control are coarse (0.03 deg/s a count): the increments are the measurement"
        found.append(LogTable("control", columns, (), 600.0, sum(self._counts.values()), (note, coarse)))
        return found

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of the inertial messages, or of all: for each named column its values, (n,)."""
        inertial = table.name == "inertial"
        dtype = _INERTIAL if inertial else _BOTH
        for found in frames(self._stream, _Messages(), Counted()):
            kept = (m for _, m in found if m[2:14] != _START and (not inertial or m[1] == 2))
            data = np.frombuffer(b"".join(m[: dtype.itemsize] for m in kept), dtype)
            if len(data):
                yield [data[name[:-2]][:, "xyz".index(name[-1])] for name in columns]
