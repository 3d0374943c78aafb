"""Columns of numbers out of delimited text, plain or gzipped, a block at a time.

Arrow reads the numbers fast; where it stumbles, the file is read again slowly to say which line is wrong and why.
"""

import gzip
import io
import math
import re
import zlib
from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO, cast

import numpy as np
import pyarrow as pa
from pyarrow import csv

from bench_service.formats.description import DELIMITERS, Column, ImportDescription
from bench_service.formats.errors import UnreadableFile
from procedures.core.arrays import Array

_BLOCK_BYTES = 4 * 1024 * 1024
_LONGEST_LINE_BYTES = 1024 * 1024
_BLANKS = re.compile(rb"[ \t]+")
_MARGINS = re.compile(rb"(?m)^[ \t]+|[ \t]+\r?$")


def text_columns(
    stream: BinaryIO, name: str, columns: Sequence[Column], description: ImportDescription
) -> Iterator[Array]:
    """The named columns, block by block, each (n, len(columns)). Raises `UnreadableFile`."""
    try:
        yield from _fast(stream, name, columns, description)
    except (pa.ArrowInvalid, _NotANumber) as error:
        _say_which_line(stream, name, columns, description)
        raise UnreadableFile(name, f"cannot be read as a table of numbers: {error}") from error
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise UnreadableFile(name, f"the compressed file is cut off or damaged ({error})") from error


class _NotANumber(Exception):
    """A cell is empty, NaN or infinite."""


class _Table:
    """The text after the lines that are no data, with the names of its columns."""

    def __init__(self, stream: BinaryIO, name: str, description: ImportDescription) -> None:
        self._name = name
        self._delimiter = DELIMITERS[description.delimiter]
        self.text = _opened(stream)
        for _ in range(description.header_lines):
            self.text.readline()
        head = self.text.readline()
        self.first_line = description.header_lines + 1
        self.names: list[str] | None = None
        self.rest = b""
        if description.header:
            self.names = [c.decode("utf-8-sig", errors="replace").strip().strip('"') for c in self.cells(head)]
            self.first_line += 1
        else:
            self.rest = head
        self.width = len(self.cells(head))
        if not head.strip():
            raise UnreadableFile(name, f"line {description.header_lines + 1} is empty; a table was expected there")

    def cells(self, line: bytes) -> list[bytes]:
        """The cells of a line."""
        return line.split() if self._delimiter == b" " else line.rstrip(b"\r\n").split(self._delimiter)

    def indices(self, columns: Sequence[Column]) -> list[int]:
        """Where the columns stand. Raises `UnreadableFile`."""
        present = ", ".join(self.names) if self.names else f"0 … {self.width - 1}"
        found: list[int] = []
        for column in columns:
            if isinstance(column, str):
                if self.names is None or self.names.count(column) != 1:
                    raise UnreadableFile(self._name, f"there is not one column {column!r}; the columns are {present}")
                column = self.names.index(column)
            if not 0 <= column < self.width:
                raise UnreadableFile(self._name, f"there is no column {column}; the columns are {present}")
            found.append(column)
        return found


def _fast(stream: BinaryIO, name: str, columns: Sequence[Column], description: ImportDescription) -> Iterator[Array]:
    table = _Table(stream, name, description)
    indices = table.indices(columns)
    names = [f"c{index}" for index in range(table.width)]
    wanted = [names[index] for index in indices]
    blanks = description.delimiter == "whitespace"
    delimiter = "," if blanks else DELIMITERS[description.delimiter].decode()
    for text in _pieces(table, blanks):
        parsed = csv.read_csv(
            pa.BufferReader(text),
            csv.ReadOptions(use_threads=True, column_names=names),
            csv.ParseOptions(delimiter=delimiter),
            csv.ConvertOptions(
                column_types=dict.fromkeys(wanted, pa.float64()),
                include_columns=list(dict.fromkeys(wanted)),
                null_values=[""],
            ),
        )
        block = np.column_stack([parsed.column(column).to_numpy() for column in wanted])
        if not np.all(np.isfinite(block)):
            raise _NotANumber("a cell is empty or not a finite number")
        yield block


def _pieces(table: _Table, blanks: bool) -> Iterator[bytes]:
    """The text in pieces that end with a line, blanks between cells made commas where they delimit."""
    rest = table.rest
    while True:
        more = table.text.read(_BLOCK_BYTES)
        cut = more.rfind(b"\n") + 1
        if more and not cut:
            rest += more
            if len(rest) > _LONGEST_LINE_BYTES:
                raise pa.ArrowInvalid("a line has no end")
            continue
        piece, rest = (rest + more[:cut], more[cut:]) if more else (rest, b"")
        if piece.strip():
            yield _BLANKS.sub(b",", _MARGINS.sub(b"", piece)) if blanks else piece
        if not more:
            return


def _say_which_line(stream: BinaryIO, name: str, columns: Sequence[Column], description: ImportDescription) -> None:
    """Read again, a line at a time, and raise `UnreadableFile` for the first that is wrong."""
    table = _Table(stream, name, description)
    indices = table.indices(columns)
    lines = iter(lambda: table.text.readline(_LONGEST_LINE_BYTES), b"")
    if table.rest:
        lines = (line for part in ([table.rest], lines) for line in part)
    for number, line in enumerate(lines, table.first_line):
        if not line.strip():
            continue
        cells = table.cells(line)
        if len(cells) != table.width:
            cut = "" if line.endswith(b"\n") else "; the file seems to be cut off"
            raise UnreadableFile(name, f"line {number} has {len(cells)} columns, {table.width} were expected{cut}")
        for column, index in zip(columns, indices, strict=True):
            cell = cells[index].decode(errors="replace").strip().strip('"')
            if not _is_number(cell):
                raise UnreadableFile(
                    name, f"line {number}, column {column!r}: {cell!r} where a finite number was expected"
                )


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def _opened(stream: BinaryIO) -> BinaryIO:
    """The text of a file from its beginning, unpacked where it is gzipped."""
    stream.seek(0)
    packed = stream.read(2) == b"\x1f\x8b"
    stream.seek(0)
    return (
        cast(BinaryIO, gzip.GzipFile(fileobj=stream, mode="rb"))
        if packed
        else cast(BinaryIO, io.BufferedReader(cast(Any, _Kept(stream))))
    )


class _Kept(io.RawIOBase):
    """A stream of somebody else's: read here, closed by its owner."""

    def __init__(self, stream: BinaryIO) -> None:
        super().__init__()
        self._stream = stream

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray) -> int:  # pyright: ignore[reportIncompatibleMethodOverride]
        data = self._stream.read(len(buffer))
        buffer[: len(data)] = data
        return len(data)
