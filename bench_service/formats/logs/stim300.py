"""Reader of dumps of a Sensonor STIM300: datagrams of 24-bit samples with a counter and a CRC-32.

Layout after the published drivers of rock-drivers and others; not confirmed on a device of ours. The identifier says
which groups a datagram has; where sources disagree about an identifier, the checksum decides its length.
"""

from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np

from bench_service.formats.logs.framing import Counted, count_at_start, crc32_mpeg2, frames, require_frames
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable, Numbers, triad
from procedures.core.recording import Quantity

NAME = "stim300"
TITLE = "STIM300 datagrams"
_GROUP = {"rate": 10, "acc": 10, "incl": 10, "rate_temp": 7, "acc_temp": 7, "incl_temp": 7, "aux": 4}
_RATE, _ACC, _INCL, _AUX = ("rate",), ("acc",), ("incl",), ("aux",)
LAYOUTS: dict[int, tuple[tuple[str, ...], ...]] = {
    0x90: (_RATE,),
    0x91: (_RATE + _ACC,),
    0x92: (_RATE + _INCL, _RATE + _ACC + _INCL),
    0x93: (_RATE + _ACC + _INCL,),
    0x94: ((*_RATE, "rate_temp"),),
    0xA5: (_RATE + _ACC + ("rate_temp", "acc_temp"),),
    0xA6: (_RATE + _INCL + ("rate_temp", "incl_temp"),),
    0x97: (_RATE + _ACC + _INCL + ("rate_temp", "acc_temp", "incl_temp"),),
    0xA7: (_RATE + _ACC + _INCL + ("rate_temp", "acc_temp", "incl_temp"),),
    0x98: (_RATE + _AUX,),
    0x99: (_RATE + _ACC + _AUX,),
    0x9A: (_RATE + _INCL + _AUX,),
    0x9B: (_RATE + _ACC + _INCL + _AUX,),
    0x9F: (_RATE + _ACC + _INCL + ("rate_temp", "acc_temp", "incl_temp") + _AUX,),
}
"""Identifier -> the groups that it may have, in their order."""
COUNTER_S = 1.0 / 2000.0
"""The counter counts samples of 2000 Hz."""
GYRO_DEG_S = 2.0**-14
ACC_G = 2.0**-19
_NEXT = bytes(sorted(LAYOUTS))
_ASKS = (
    "the datagram does not say what the gyros put out: taken as angular rate, 2^-14 deg/s a count; a unit that is set "
    "to incremental angle needs the quantity angle_increment, unit deg and its own scale (2^-21 by NovAtel's table)",
    "the datagram does not say the accelerometers' range: taken as 10 g, 2^-19 g a count; 5 g has 2^-20, 30 g 2^-18",
)
_SOURCE = "published drivers (rock-drivers and others); not confirmed on a device of ours"
_HINT = (
    "the length of a datagram follows from its identifier, so that a wrong checksum everywhere usually means another "
    "datagram than those known here, or another unit"
)


def size_of_datagram(groups: Sequence[str]) -> int:
    """Return the length of a datagram: identifier, groups, counter, latency and CRC."""
    return 1 + sum(_GROUP[g] for g in groups) + 1 + 2 + 4


class _Datagrams:
    """Framing by identifier; a datagram may be followed by CR LF."""

    def __init__(self) -> None:
        self.groups: dict[int, tuple[str, ...]] = {}
        """Groups of each identifier, as the checksum has decided."""

    def next(self, data: bytes, at: int) -> int:
        """Return the next identifier; line ends between datagrams belong to them."""
        while at < len(data) and data[at] not in LAYOUTS:
            at += 1
        return at if at < len(data) else -1

    def length(self, data: bytes, at: int) -> int:
        """Return the length of the datagram, with the line end that follows it."""
        known = self.groups.get(data[at])
        options = (known,) if known is not None else LAYOUTS[data[at]]
        longest = 0
        for groups in options:
            size = size_of_datagram(groups)
            longest = max(longest, size)
            if at + size <= len(data) and _right(data[at : at + size]):
                self.groups[data[at]] = groups
                return size + (2 if data[at + size : at + size + 2] == b"\r\n" else 0)
        return longest

    def is_whole(self, frame: bytes) -> bool:
        """Return whether the checksum is right."""
        groups = self.groups.get(frame[0])
        return groups is not None and _right(frame[: size_of_datagram(groups)])


def _right(datagram: bytes) -> bool:
    body = datagram[:-4]
    return crc32_mpeg2(body + bytes(-len(body) % 4)) == int.from_bytes(datagram[-4:], "big")


def begins(start: bytes) -> bool:
    """Return whether datagrams with a right checksum follow one another at the beginning."""
    return any(byte in LAYOUTS for byte in start[:256]) and count_at_start(start, _Datagrams()) >= 3


def opened(stream: BinaryIO, name: str) -> "Stim300":
    """Return a reader of a STIM300 dump. Raises `UnreadableFile`."""
    return Stim300(stream, name)


class Stim300:
    """Reader of one dump of STIM300 datagrams. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        self._rows: dict[int, int] = {}
        self._framing = _Datagrams()
        counted, flagged, first = Counted(), 0, -1
        for found in frames(stream, self._framing, counted):
            for at, datagram in found:
                self._rows[datagram[0]] = self._rows.get(datagram[0], 0) + 1
                if datagram[10]:
                    flagged += 1
                    first = at if first < 0 else first
        require_frames(counted, name, "datagrams of a STIM300", _HINT)
        self.warnings += counted.warnings("datagrams")
        if flagged:
            self.warnings.append(f"{flagged} datagrams have a status of the gyros that is not 0, first at byte {first}")

    def tables(self) -> list[LogTable]:
        """Return the kinds of datagrams as tables."""
        return [self._table(identifier, rows) for identifier, rows in self._rows.items()]

    def _table(self, identifier: int, rows: int) -> LogTable:
        groups = self._framing.groups[identifier]
        columns = triad([f"gyro_{a}" for a in "xyz"], "gyro", Quantity.ANGULAR_RATE, "deg/s", GYRO_DEG_S, _SOURCE)
        if "acc" in groups:
            columns += triad([f"acc_{a}" for a in "xyz"], "accelerometer", Quantity.SPECIFIC_FORCE, "g", ACC_G, _SOURCE)
        if "incl" in groups:
            columns += tuple(LogColumn(f"incl_{a}") for a in "xyz")
        for group, kind in (("rate_temp", "gyro"), ("acc_temp", "acc")):
            if group in groups:
                columns += tuple(
                    LogColumn(
                        f"{kind}_temp_{a}",
                        Quantity.TEMPERATURE,
                        "degC",
                        2.0**-8,
                        0.0,
                        f"temperature_{'gyro' if kind == 'gyro' else 'accelerometer'}_{a}",
                        _SOURCE,
                    )
                    for a in "xyz"
                )
        clock = LogClock("counter_time", 1e-9, "the datagrams' counter of 2000 Hz samples, its wraps carried on")
        asks = _ASKS if "acc" in groups else _ASKS[:1]
        return LogTable(f"datagram 0x{identifier:02X}", columns, (clock,), None, rows, (), asks)

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of one kind of datagram: for each named column its values, (n,)."""
        identifier = int(table.name.rpartition("0x")[2], 16)
        groups = self._framing.groups[identifier]
        size = size_of_datagram(groups)
        last, ticks = -1, 0
        for found in frames(self._stream, self._framing, Counted()):
            part = b"".join(datagram[:size] for _, datagram in found if datagram[0] == identifier)
            data = np.frombuffer(part, np.uint8).reshape(-1, size)
            if not len(data):
                continue
            counter = data[:, size - 7].astype(np.int64)
            steps = np.diff(counter, prepend=counter[:1] if last < 0 else last) % 256
            elapsed = ticks + np.cumsum(steps)
            last, ticks = int(counter[-1]), int(elapsed[-1])
            time_ns = elapsed * round(COUNTER_S * 1e9)
            yield [time_ns if name == "counter_time" else _column(data, groups, name) for name in columns]


def _column(data: Any, groups: Sequence[str], name: str) -> Numbers:
    kind, _, axis = name.rpartition("_")
    at = 1
    for group in groups:
        width = 2 if group.endswith("temp") else 3
        if kind == {"rate": "gyro", "rate_temp": "gyro_temp"}.get(group, group):
            place = at + width * "xyz".index(axis)
            return big_endian(data[:, place : place + width])
        at += _GROUP[group]
    raise KeyError(name)


def big_endian(data: Any) -> Numbers:
    """Return signed big-endian integers of 2 or 3 bytes, (n, 2 or 3), as int64, (n,)."""
    value = data[:, 0].astype(np.int8).astype(np.int64)
    for place in range(1, data.shape[1]):
        value = value << 8 | data[:, place]
    return value
