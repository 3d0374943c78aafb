"""Reader of ArduPilot DataFlash logs (.bin): messages by their own definitions, instances apart, bursts apart.

Layout after ArduPilot's published logger structures: each message begins with A3 95 and its type; messages FMT define
the others. Not confirmed against a log of a vehicle of ours.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.bytes_at import size_of
from bench_service.formats.logs.dataflash_tables import Burst, burst_rows, burst_table, message_table
from bench_service.formats.logs.table import PIECE_BYTES, LogTable, Numbers

NAME = "dataflash"
TITLE = "ArduPilot DataFlash"
HEAD = b"\xa3\x95"
FMT = 0x80
_FMT_BYTES = 89
CODES = {
    "a": ("<i2", 32),
    "b": ("i1", 1),
    "B": ("u1", 1),
    "h": ("<i2", 1),
    "H": ("<u2", 1),
    "i": ("<i4", 1),
    "I": ("<u4", 1),
    "f": ("<f4", 1),
    "d": ("<f8", 1),
    "g": ("<f2", 1),
    "n": ("S4", 1),
    "N": ("S16", 1),
    "Z": ("S64", 1),
    "c": ("<i2", 1),
    "C": ("<u2", 1),
    "e": ("<i4", 1),
    "E": ("<u4", 1),
    "L": ("<i4", 1),
    "M": ("u1", 1),
    "q": ("<i8", 1),
    "Q": ("<u8", 1),
}


@dataclass(frozen=True)
class MessageType:
    """A message type as FMT defines it. `dtype`: numpy's type of the whole message, its head included."""

    name: str
    size: int
    format: str
    fields: tuple[str, ...]
    dtype: np.dtype[Any]


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is a DataFlash log."""
    return start.startswith(HEAD + bytes([FMT]))


def opened(stream: BinaryIO, name: str) -> "DataFlash":
    """Return a reader of a DataFlash log. Raises `UnreadableFile`."""
    return DataFlash(stream, name)


class DataFlash:
    """Reader of one DataFlash log, message by message in pieces. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        self._size = size_of(stream)
        self._types: dict[int, MessageType] = {}
        self._sizes = [0] * 256
        self._counts: dict[tuple[str, int], int] = {}
        self._skipped, self._first_skipped = 0, -1
        self._scan()

    def _scan(self) -> None:
        """Find the definitions, the instances of each type and the bursts."""
        self._bursts: list[Burst] = []
        for kind, rows in self._gathered(None):
            message = self._types[kind]
            if message.name == "ISBH":
                self._bursts += [Burst.of(row) for row in rows]
            instances = rows["I"] if "I" in message.fields else np.zeros(len(rows), np.uint8)
            for instance, count in zip(*np.unique(instances, return_counts=True), strict=True):
                key = (message.name, int(instance))
                self._counts[key] = self._counts.get(key, 0) + int(count)
        if self._skipped:
            self.warnings.append(
                f"{self._skipped} bytes belong to no message and were skipped, the first at byte {self._first_skipped}"
            )
        if not self._types:
            raise UnreadableFile(self._name, "has no definition of a message (FMT) at its beginning")

    def _gathered(self, only: str | None) -> Iterator[tuple[int, Any]]:
        """Yield messages of each type together, piece by piece; `only`: of the type of this name."""
        for found in self._pieces(only):
            for kind, parts in found.items():
                yield kind, np.frombuffer(b"".join(parts), self._types[kind].dtype)

    def _pieces(self, only: str | None) -> Iterator[dict[int, list[bytes]]]:
        self._stream.seek(0)
        base, data = 0, b""
        while True:
            piece = self._stream.read(PIECE_BYTES)
            data += piece
            found: dict[int, list[bytes]] = {}
            at = self._walk(data, base, only, found, last=not piece)
            if found:
                yield found
            base += at
            data = data[at:]
            if not piece:
                return

    def _walk(self, data: bytes, base: int, only: str | None, found: dict[int, list[bytes]], last: bool) -> int:
        """Walk the messages of a piece; return the place of the first that is not whole."""
        sizes, at, end = self._sizes, 0, len(data)
        wanted = [only is None or ((t := self._types.get(k)) is not None and t.name == only) for k in range(256)]
        while at + 3 <= end:
            kind = data[at + 2]
            if data[at] != 0xA3 or data[at + 1] != 0x95 or not (sizes[kind] or kind == FMT):
                following = data.find(HEAD, at + 1)
                stop = following if following >= 0 else max(at + 1, end - 1)
                self._skip(base + at, stop - at, only)
                at = stop
                continue
            stop = at + (sizes[kind] or _FMT_BYTES)
            if stop > end:
                break
            if kind == FMT:
                if only is None:
                    self._define(data[at + 3 : stop])
                    wanted = [True] * 256
            elif wanted[kind]:
                found.setdefault(kind, []).append(data[at:stop])
            at = stop
        if last and at < end and only is None:
            self.warnings.append(
                f"the log is cut off in the message at byte {base + at}, as by a loss of power: what is before was read"
            )
        return at

    def _skip(self, at: int, count: int, only: str | None) -> None:
        if only is None:
            self._skipped += count
            self._first_skipped = at if self._first_skipped < 0 else self._first_skipped

    def _define(self, body: bytes) -> None:
        kind, size = body[0], body[1]
        name, form, labels = (_text(body[a:b]) for a, b in ((2, 6), (6, 22), (22, 86)))
        fields = tuple(labels.split(",")) if labels else ()
        if kind in self._types:
            return
        codes = [CODES.get(letter) for letter in form]
        if len(fields) != len(form) or None in codes:
            self._sizes[kind] = size
            self._types[kind] = MessageType(name, size, form, (), np.dtype((np.void, max(size, 1))))
            return
        layout = [("head", "u1", (3,))] + [
            (label, code[0], (code[1],)) if code[1] > 1 else (label, code[0])
            for label, code in zip(fields, codes, strict=True)
            if code is not None
        ]
        dtype = np.dtype(layout) if len(set(fields)) == len(fields) else np.dtype((np.void, max(size, 1)))
        if dtype.itemsize != size:
            raise UnreadableFile(
                self._name,
                f"its definition of {name} gives {size} bytes, its fields have {dtype.itemsize}: it is damaged",
            )
        self._sizes[kind] = size
        self._types[kind] = MessageType(name, size, form, fields if dtype.names else (), dtype)

    def tables(self) -> list[LogTable]:
        """Return the message types with samples as tables, each instance apart, and each burst."""
        found: list[LogTable] = []
        by_name = {t.name: t for t in self._types.values()}
        for (name, instance), rows in self._counts.items():
            message = by_name[name]
            if message.fields and name not in ("ISBH", "ISBD", "FMT"):
                table = message_table(name, instance, message.fields, message.format, rows)
                if table is not None:
                    found.append(table)
        return found + [burst_table(burst) for burst in self._bursts]

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of rows of one instance, or of one burst: for each named column its values, (n,). Raises
        `UnreadableFile`.
        """
        burst = next((b for b in self._bursts if b.title == table.name), None)
        if burst is not None:
            batches = (rows for _, rows in self._gathered("ISBD"))
            yield from burst_rows(burst, batches, columns, self._name)
            return
        name, _, rest = table.name.rpartition("[")
        for _, rows in self._gathered(name):
            part = rows[rows["I"] == int(rest[:-1])] if "I" in rows.dtype.names else rows
            if len(part):
                yield [part[column] for column in columns]


def _text(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("ascii", "replace").strip()
