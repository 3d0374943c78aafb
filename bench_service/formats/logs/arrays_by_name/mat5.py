"""Reader of MATLAB files of version 5 to 7, numeric matrices and scalar structs of them, a block of rows at a time.

Layout: the published MAT-file format (level 5): a header of 128 bytes, then elements of a type, a size and data. A
matrix is stored column by column; each column is read, and unpacked, at a place of its own, so that a block takes
memory for its rows alone.
"""

import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from bench_service.formats.bounds import quoted
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.arrays_by_name.mat5_source import Packed, Plain, Source
from bench_service.formats.logs.arrays_by_name.tables import (
    FACT_BYTES,
    MOST_ARRAYS,
    NamedArray,
    StatedFacts,
    StatedRates,
    lies,
    tables_by_length,
)
from bench_service.formats.logs.bytes_at import exactly, size_of
from bench_service.formats.logs.table import BLOCK_ROWS, LogTable, Numbers

NAME = "mat5"
TITLE = "MATLAB .mat, version 5 to 7"
_MATRIX, _COMPRESSED = 14, 15
_CODES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_STRUCT, _TEXT, _OPAQUE = 2, 4, 17
_ENCODINGS = {1: "latin-1", 2: "latin-1", 4: "", 16: "utf-8", 17: ""}
"""Encoding of text by the type of its element; empty: UTF-16 in the file's order."""
_NUMERIC = range(6, 16)
_CLASSES = {
    1: "a cell array",
    3: "an object",
    4: "text",
    5: "a sparse matrix",
    16: "a function",
    17: "an opaque object",
}
_TABLES = (
    "tables, timetables, datetimes and strings are objects whose numbers cannot be read here: in MATLAB save "
    "T{:,:} or T.Variables, and seconds(T.Time), as plain matrices"
)
DEEPEST = 6


def begins(start: bytes) -> bool:
    """Return whether a file that begins so is a MATLAB file of level 5."""
    return len(start) >= 128 and start[126:128] in (b"IM", b"MI") and start[124:126] in (b"\x00\x01", b"\x01\x00")


def opened(stream: BinaryIO, name: str) -> "Mat5":
    """Return a reader of a MATLAB file. Raises `UnreadableFile`."""
    return Mat5(stream, name)


@dataclass(frozen=True)
class _Place:
    """A numeric array and the place of its numbers. `code`: numpy's type; `lying`: samples are its columns."""

    array: NamedArray
    source: Source
    at: int
    code: str
    lying: bool = False


class Mat5:
    """Reader of one MATLAB file of level 5. Implements `Log`."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._stream, self._name = stream, name
        self.warnings: list[str] = []
        self._arrays: dict[str, _Place] = {}
        self._notes: list[str] = []
        self._rates = StatedRates()
        self._stated = StatedFacts()
        self.facts, self.column_facts = self._stated.facts, self._stated.column_facts
        stream.seek(0)
        head = exactly(stream, 128, name, "the header of a MATLAB file")
        self._order = "<" if head[126:128] == b"IM" else ">"
        self._scan()

    def _scan(self) -> None:
        at, size = 128, size_of(self._stream)
        while at < size:
            self._stream.seek(at)
            kind, length = struct.unpack(f"{self._order}II", exactly(self._stream, 8, self._name, "a variable"))
            if kind not in (_MATRIX, _COMPRESSED):
                raise UnreadableFile(
                    self._name, f"byte {at} is not the start of a variable (type {kind}): the file is damaged there"
                )
            if at + 8 + length > size:
                raise UnreadableFile(
                    self._name,
                    f"is cut off at byte {size}: the variable at byte {at} needs {length} bytes from byte {at + 8} on",
                )
            try:
                self._variable(kind, at, length)
            except (struct.error, zlib.error, EOFError) as error:
                raise UnreadableFile(
                    self._name, f"the variable at byte {at} is damaged ({str(error)[:80] or 'it ends too early'})"
                ) from error
            at += 8 + length

    def _variable(self, kind: int, at: int, length: int) -> None:
        if kind == _COMPRESSED:
            source: Source = Packed(self._stream, at + 8, length, self._order == ">")
            inner, size = struct.unpack(f"{self._order}II", source.read(0, 8))
            if inner != _MATRIX:
                return
            self._matrix(source, 8, size, "", 0)
        else:
            self._matrix(Plain(self._stream, at + 8, length), 0, length, "", 0)

    def _tag(self, source: Source, at: int) -> tuple[int, int, int, int]:
        """Read an element's tag: its type, its size, the place of its data, and that of the next element."""
        word, size = struct.unpack(f"{self._order}II", source.read(at, 8))
        if word >> 16:  # a small element: size and type share a word, the data follow within it
            return word & 0xFFFF, word >> 16, at + 4, at + 8
        return word, size, at + 8, at + 8 + size + -size % 8

    def _matrix(self, source: Source, at: int, size: int, prefix: str, depth: int, name: str | None = None) -> None:
        end = at + size
        _, _, data, at = self._tag(source, at)
        flags = struct.unpack(f"{self._order}I", source.read(data, 4))[0]
        kind, is_complex = flags & 0xFF, bool(flags & 0x800)
        if kind == _OPAQUE:
            self._note(_TABLES)
            return
        _, count, data, at = self._tag(source, at)
        if count > 4 * 32:
            return
        dims = struct.unpack(f"{self._order}{count // 4}i", source.read(data, count))
        _, length, data, at = self._tag(source, at)
        own = source.read(data, min(length, 255)).decode("latin-1")
        title = prefix + (own if name is None else name)
        if kind == _STRUCT:
            self._struct(source, at, end, dims, title, depth)
        elif kind in _NUMERIC and not is_complex and len(dims) == 2:
            self._numbers(source, at, (dims[0], dims[1]), title)
        elif kind == _TEXT and StatedFacts.is_fact(title):
            self._text(source, at, dims, title)
        elif title and not title.startswith("__"):
            self._note(f"{quoted(title)} is {_CLASSES.get(kind, 'no real matrix of two dimensions')} and is not read")

    def _struct(self, source: Source, at: int, end: int, dims: Sequence[int], title: str, depth: int) -> None:
        if any(d != 1 for d in dims) or depth >= DEEPEST:
            self._note(f"{quoted(title)} is an array of structs and is not read")
            return
        _, _, data, at = self._tag(source, at)
        width = struct.unpack(f"{self._order}i", source.read(data, 4))[0]
        _, length, data, at = self._tag(source, at)
        if not 0 < width <= 1024 or length > width * MOST_ARRAYS:
            return
        names = source.read(data, length)
        fields = [names[k : k + width].split(b"\0")[0].decode("latin-1") for k in range(0, length, width)]
        for field in fields:
            if at >= end:
                return
            kind, size, data, after = self._tag(source, at)
            if kind == _MATRIX and size:
                self._matrix(source, data, size, f"{title}.", depth + 1, field)
            at = after

    def _text(self, source: Source, at: int, dims: Sequence[int], title: str) -> None:
        """Take one line of text as a fact of the file."""
        if len(dims) != 2 or dims[0] > 1:
            return
        kind, length, data, _ = self._tag(source, at)
        if kind in _ENCODINGS and length <= FACT_BYTES:
            encoding = _ENCODINGS[kind] or ("utf-16-le" if self._order == "<" else "utf-16-be")
            self._stated.add(title, source.read(data, length).decode(encoding, "replace"))

    def _numbers(self, source: Source, at: int, dims: tuple[int, int], title: str) -> None:
        if dims[0] == 0 or dims[1] == 0:
            return
        kind, length, data, _ = self._tag(source, at)
        code = _CODES.get(kind)
        if code is None or length != dims[0] * dims[1] * np.dtype(code).itemsize:
            raise struct.error(f"{title[:40]}: {length} bytes for {dims[0]} x {dims[1]} numbers")
        if len(self._arrays) >= MOST_ARRAYS:
            return
        rows, width = dims
        if rows == 1 and width > 1:  # a row vector is a series, too
            rows, width = width, 1
        lying = lies(rows, width)
        if lying:
            self._note(f"{quoted(title)} is {rows} x {width}: its columns are taken as the samples")
            rows, width = width, rows
        order = self._order if code[1] != "1" else "|"
        self._arrays[title] = _Place(NamedArray(title, rows, width), source, data, order + code, lying)
        if rows == width == 1:
            number = np.frombuffer(source.read(data, length), order + code)[0]
            self._rates.add(title, number)
            if StatedFacts.is_fact(title):
                self._stated.add(title, repr(float(number)))

    def _note(self, words: str) -> None:
        if words not in self._notes and len(self._notes) < 20:
            self._notes.append(words)

    def tables(self) -> list[LogTable]:
        """Return the arrays as tables, those of one length as one. Raises `UnreadableFile` where there is none."""
        found = tables_by_length([p.array for p in self._arrays.values()], self._notes, self._rates)
        if not found:
            why = "; ".join(self._notes) or "it holds only single numbers"
            raise UnreadableFile(self._name, f"holds no matrix of samples: {why}")
        return found

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of rows: for each named column its values, (n,). Raises `UnreadableFile`."""
        places = {name: (p, i) for p in self._arrays.values() for i, name in enumerate(p.array.columns)}
        readers = [_Column(*places[name]) for name in columns]
        count = table.rows or 0
        try:
            for start in range(0, count, BLOCK_ROWS):
                size = min(BLOCK_ROWS, count - start)
                yield [reader.take(size) for reader in readers]
        except (zlib.error, EOFError) as error:
            raise UnreadableFile(self._name, f"a variable cannot be unpacked: {str(error)[:80]}") from error


class _Column:
    """One column of a matrix, read from its beginning to its end."""

    def __init__(self, place: _Place, index: int) -> None:
        self._dtype = np.dtype(place.code)
        self._step, self._index = (place.array.width, index) if place.lying else (1, 0)
        begin = 0 if place.lying else index * place.array.rows
        self._walk = place.source.walk(place.at + begin * self._dtype.itemsize)

    def take(self, rows: int) -> Numbers:
        """Return the next rows in the machine's byte order."""
        data = self._walk.take(rows * self._step * self._dtype.itemsize)
        return np.frombuffer(data, self._dtype)[self._index :: self._step].astype(self._dtype.newbyteorder("="))
