"""Reader of PX4 ULog files: topics with their instances apart, FIFO topics unrolled.

Layout: the published ULog file format of PX4 (header of 16 bytes, then messages of uint16 size, uint8 type). Units
follow PX4's message definitions; the file does not hold them.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np

from bench_service.formats.bounds import quoted
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.bytes_at import exactly, size_of
from bench_service.formats.logs.table import PIECE_BYTES, LogTable, Numbers
from bench_service.formats.logs.ulog_topics import is_fifo, topic_table, unrolled

NAME = "ulog"
TITLE = "PX4 ULog"
MAGIC = b"ULog\x01\x12\x35"
_TYPES = {
    "int8_t": "i1",
    "uint8_t": "u1",
    "bool": "u1",
    "char": "S1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
}
_FIELD = re.compile(r"^\s*([A-Za-z0-9_/]+)(?:\[(\d+)\])?\s+([A-Za-z0-9_]+)\s*$")
_KNOWN = "BFIMPQALRSOCD"
_DATA = ord("D")


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is a ULog."""
    return start.startswith(MAGIC)


def opened(stream: BinaryIO, name: str) -> "ULog":
    """Return a reader of a ULog. Raises `UnreadableFile`."""
    return ULog(stream, name)


class ULog:
    """Reader of one ULog, message by message in pieces. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        stream.seek(0)
        head = exactly(stream, 16, name, "the header of a ULog")
        if head[7] > 1:
            raise UnreadableFile(name, f"is a ULog of version {head[7]}; versions 0 and 1 are read")
        self._formats: dict[str, str] = {}
        self._topics: dict[int, tuple[str, int]] = {}
        self._counts: dict[int, int] = {}
        self._fields: dict[str, list[tuple[str, str, int]]] = {}
        self._dropouts = 0
        self._ends = self._sections()
        self._scan()

    def _scan(self) -> None:
        """Read all definitions and count the rows of each topic. Raises `UnreadableFile`."""
        counts: dict[int, int] = {}
        for kind, body in self._messages(None):
            if kind == "D":
                key = body[0] | body[1] << 8
                counts[key] = counts.get(key, 0) + 1
            else:
                self._define(kind, body)
        self._counts = counts
        if self._dropouts:
            self.warnings.append(
                f"{self._dropouts} dropouts of the logger are noted in the file: rows are missing there"
            )

    def _define(self, kind: str, body: bytes) -> None:
        if kind == "F":
            text = body.decode("ascii", errors="replace")
            topic, _, fields = text.partition(":")
            self._formats[topic] = fields
        elif kind == "A" and len(body) > 3:
            topic = body[3:].decode("ascii", errors="replace")
            self._topics[body[1] | body[2] << 8] = (topic, body[0])
        elif kind == "O":
            self._dropouts += 1

    def _sections(self) -> list[int]:
        """Return where each part of the file ends: data may have been appended after a crash."""
        size = size_of(self._stream)
        head = self._stream.read(43)
        if len(head) < 43 or head[2] != ord("B"):
            return [size]
        flags = head[3:]
        if flags[8] & ~1 or any(flags[9:16]):
            raise UnreadableFile(self._name, "uses a newer feature of ULog that is not known here (its flag bits)")
        appended = sorted({int(v) for v in np.frombuffer(flags[16:40], "<u8") if v})
        if appended and appended[-1] > size:
            raise UnreadableFile(
                self._name, f"is cut off at byte {size}: its header says that data were appended at byte {appended[-1]}"
            )
        return [*appended, size]

    def _messages(self, only: bytes | None) -> Iterator[tuple[str, bytes]]:
        """Yield messages in order: all of them, or the data of one topic (`only`: its id as two bytes)."""
        start = 16
        for stop in self._ends:
            yield from self._section(start, stop, only)
            start = stop  # a message that was being written when data were appended is dropped

    def _section(self, start: int, stop: int, only: bytes | None) -> Iterator[tuple[str, bytes]]:
        at, rest = start, b""
        while at < stop:
            self._stream.seek(at)
            piece = self._stream.read(min(PIECE_BYTES, stop - at))
            if not piece:
                break
            data, base = rest + piece, at - len(rest)
            place, size = 0, len(rest) + len(piece)
            while place + 3 <= size:
                end = place + 3 + (data[place] | data[place + 1] << 8)
                if end > size:
                    break
                kind = data[place + 2]
                if kind == _DATA:
                    if only is None:
                        yield "D", data[place + 3 : place + 5]
                    elif data[place + 3 : place + 5] == only:
                        yield "D", data[place + 5 : end]
                elif only is None:
                    if chr(kind) not in _KNOWN:
                        raise UnreadableFile(
                            self._name,
                            f"byte {base + place} is not the start of a message of a ULog (type {kind}): "
                            "the file is damaged there",
                        )
                    yield chr(kind), data[place + 3 : end]
                place = end
            at += len(piece)
            rest = data[place:]
        if rest and stop == self._ends[-1] and only is None:
            self.warnings.append(
                f"the file ends at byte {stop} in the middle of a message, as after a loss of power: its last "
                f"{len(rest)} bytes were left out"
            )

    def _layout(self, topic: str, depth: int = 0) -> list[tuple[str, str, int]]:
        """Flatten a topic's fields: name, numpy type, offset; the type of padding is empty. Raises `UnreadableFile`."""
        if topic in self._fields:
            return self._fields[topic]
        if topic not in self._formats or depth > 8:
            raise UnreadableFile(self._name, f"has no definition of the type {quoted(topic)}")
        found: list[tuple[str, str, int]] = []
        offset = 0
        for text in filter(None, (part.strip() for part in self._formats[topic].split(";"))):
            match = _FIELD.match(text)
            if match is None:
                raise UnreadableFile(self._name, f"the definition of {quoted(topic)} has a field {quoted(text)}")
            kind, count, field = match[1], int(match[2] or 1), match[3]
            inner = [("", _TYPES[kind], 0)] if kind in _TYPES else self._layout(kind, depth + 1)
            width = self._width(inner)
            if count * width > 65_535:
                raise UnreadableFile(self._name, f"the definition of {quoted(topic)} is longer than a message")
            for position in range(count):
                label = f"{field}[{position}]" if match[2] else field
                for below, code, shift in inner:
                    full = f"{label}.{below}" if below else label
                    found.append((full, "" if field.startswith("_padding") else code, offset + shift))
                offset += width
        self._fields[topic] = found
        return found

    @staticmethod
    def _width(layout: Sequence[tuple[str, str, int]]) -> int:
        return max((shift + (np.dtype(code).itemsize if code else 1) for _, code, shift in layout), default=0)

    def tables(self) -> list[LogTable]:
        """Return the topics that have rows as tables, each instance apart."""
        found: list[LogTable] = []
        for key, (topic, instance) in self._topics.items():
            if self._counts.get(key):
                names = [field for field, code, _ in self._layout(topic) if code and code != "S1"]
                types = {field: code for field, code, _ in self._layout(topic)}
                found.append(topic_table(f"{topic}[{instance}]", topic, names, types, self._counts[key]))
        return found

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of a topic's rows: for each named column its values, (n,). Raises `UnreadableFile`."""
        topic, _, rest = table.name.rpartition("[")
        instance = int(rest[:-1])
        keys = [key for key, known in self._topics.items() if known == (topic, instance)]
        layout = {name: (code, shift) for name, code, shift in self._layout(topic) if code}
        fifo = is_fifo(layout)
        wanted = sorted(layout) if fifo else list(dict.fromkeys(columns))
        width = self._width([(n, c, s) for n, c, s in self._layout(topic) if c])
        dtype = np.dtype(
            {
                "names": wanted,
                "formats": [layout[name][0] for name in wanted],
                "offsets": [layout[name][1] for name in wanted],
                "itemsize": width,
            }
        )
        for key in keys:
            for rows in self._records(key.to_bytes(2, "little"), dtype, topic):
                yield unrolled(rows, columns) if fifo else [rows[name] for name in columns]

    def _records(self, only: bytes, dtype: np.dtype[Any], topic: str) -> Iterator[Any]:
        width, kept, have = dtype.itemsize, list[bytes](), 0
        for _, body in self._messages(only):
            if len(body) < width:
                raise UnreadableFile(
                    self._name,
                    f"a row of {topic} has {len(body)} bytes where its definition has {width}: the file is damaged",
                )
            kept.append(body[:width])
            have += width
            if have > PIECE_BYTES:
                yield np.frombuffer(b"".join(kept), dtype)
                kept, have = [], 0
        if kept:
            yield np.frombuffer(b"".join(kept), dtype)
