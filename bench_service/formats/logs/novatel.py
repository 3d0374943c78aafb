"""Reader of NovAtel SPAN logs, ASCII and binary in one file: RAWIMU, RAWIMUS, RAWIMUX, RAWIMUSX, CORRIMU and its kin.

Layout: NovAtel's OEM7 manual (headers, CRC-32, messages). Raw counts come in the order Z, −Y, X.
"""

import re
from collections.abc import Iterator, Sequence
from typing import BinaryIO
from zlib import crc32

import numpy as np

from bench_service.formats.logs.framing import Counted, count_at_start, frames, require_frames
from bench_service.formats.logs.novatel_messages import IDS, INSCONFIG, Rows, message_table
from bench_service.formats.logs.table import LogTable, Numbers

NAME = "novatel"
TITLE = "NovAtel logs (SPAN), ASCII or binary"
_SYNCS = (b"\xaa\x44\x12", b"\xaa\x44\x13")
_BEGINS = re.compile(rb"[\xaa#%]")
_LONGEST_LINE = 8192
_LONG, _SHORT = 28, 12


class _Logs:
    """Framing of binary logs with long and short headers, and of ASCII logs."""

    def next(self, data: bytes, at: int) -> int:
        """Return the next byte with which a log may begin."""
        found = _BEGINS.search(data, at)  # one search: a mark that the file lacks would be sought to the piece's end
        return -1 if found is None else found.start()

    def length(self, data: bytes, at: int) -> int:
        """Return the length of a log; more than there is where its header or line is not whole."""
        if data[at] != 0xAA:
            end = data.find(b"\n", at, at + _LONGEST_LINE)
            if end < 0:
                return len(data) - at + 1 if len(data) - at < _LONGEST_LINE else 0
            return end + 1 - at if data[at + 1 : at + 2].isalpha() else 0
        start = data[at : at + 10]
        if len(start) < 10:
            return 10
        if start[:3] == _SYNCS[0]:
            return start[3] + (start[8] | start[9] << 8) + 4 if start[3] >= _LONG else 0
        return _SHORT + start[3] + 4 if start[:3] == _SYNCS[1] else 0

    def is_whole(self, frame: bytes) -> bool:
        """Return whether the CRC is right: reflected CRC-32, start 0, nothing at the end."""
        if frame[0] == 0xAA:
            return crc(frame[:-4]) == int.from_bytes(frame[-4:], "little")
        body, star, tail = frame[1:].rstrip(b"\r\n").rpartition(b"*")
        try:
            return bool(star) and len(tail) == 8 and crc(body) == int(tail, 16)
        except ValueError:
            return False


def crc(data: bytes) -> int:
    """Return NovAtel's CRC-32: reflected, start 0, nothing at the end."""
    return crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def begins(start: bytes) -> bool:
    """Return whether logs with a right checksum follow one another at the beginning."""
    if not any(mark in start for mark in (*_SYNCS, b"#", b"%")):
        return False
    return count_at_start(start, _Logs()) >= 2


def opened(stream: BinaryIO, name: str) -> "NovAtel":
    """Return a reader of a file of NovAtel logs. Raises `UnreadableFile`."""
    return NovAtel(stream, name)


class NovAtel:
    """Reader of one file of NovAtel logs, ASCII and binary. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        self._tables: dict[str, LogTable] = {}
        counted = Counted()
        rows = {key: Rows(key, name) for key in set(IDS.values())}
        counts = dict.fromkeys(rows, 0)
        kinds: dict[str, set[int]] = {key: set() for key in rows}
        configured, summed, errors, encrypted = set[int](), set[int](), 0, 0
        for found in frames(stream, _Logs(), counted):
            for key, data in _by_kind(found, rows):
                counts[key] += len(data)
                if key == "CORRIMUS":
                    summed |= set(np.unique(data["count"]).tolist())
                if "type" in (data.dtype.names or ()):
                    kinds[key] |= set(np.unique(data["type"]).tolist())
                    errors += int(np.count_nonzero(data["info"] & 1))
                    encrypted += int(np.count_nonzero(data["info"] & 2))
            configured |= {kind for _, frame in found if (kind := _configured(frame)) is not None}
        require_frames(counted, name, "NovAtel logs", "the file is not a NovAtel log, or its bytes were changed")
        self.warnings += counted.warnings("logs")
        if errors:
            self.warnings.append(f"{errors} raw logs report an error of the inertial unit (bit 0 of its information)")
        if len(summed) > 1:
            self.warnings.append(
                f"the records of CORRIMUS sum over {min(summed)} to {max(summed)} samples: rows are not of one length"
            )
        for key, count in counts.items():
            if count:
                known = kinds[key] or configured
                self._tables[key] = message_table(key, count, known, encrypted)

    def tables(self) -> list[LogTable]:
        """Return the kinds of logs with inertial data as tables."""
        return list(self._tables.values())

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of one kind of log: for each named column its values, (n,). Raises `UnreadableFile`."""
        rows = {table.name: Rows(table.name, self._name)}
        for found in frames(self._stream, _Logs(), Counted()):
            for key, data in _by_kind(found, rows):
                yield [rows[key].column(data, column) for column in columns]


def _by_kind(found: Sequence[tuple[int, bytes]], rows: dict[str, Rows]) -> Iterator[tuple[str, Numbers]]:
    """Yield the logs of each kind as one array of records, in their order."""
    for at, frame in found:
        key, binary = _kind(frame)
        reader = rows.get(key)
        if reader is None:
            continue
        if binary:
            head = frame[3] if frame[2] == 0x12 else _SHORT
            stamp = frame[14:20] if frame[2] == 0x12 else frame[6:12]
            reader.add_binary(stamp, frame[head:-4], at)
        else:
            reader.add_text(frame, at)
    for key, reader in rows.items():
        data = reader.taken()
        if len(data):
            yield key, data


def _kind(frame: bytes) -> tuple[str, bool]:
    if frame[0] == 0xAA:
        number = int.from_bytes(frame[4:6], "little")
        return IDS.get(number, ""), True
    label = frame[1:40].split(b",")[0].decode("ascii", "replace")
    return label.removesuffix("A"), False


def _configured(frame: bytes) -> int | None:
    """Return the type of unit that a log INSCONFIG names."""
    if frame[0] == 0xAA and frame[2] == 0x12 and int.from_bytes(frame[4:6], "little") == INSCONFIG:
        return int.from_bytes(frame[frame[3] : frame[3] + 4], "little")
    return None
