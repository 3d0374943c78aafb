"""Reader of delimited text, plain or gzipped: columns of numbers, a block at a time.

Arrow reads the numbers fast; where it stumbles, the piece is read again slowly to say which line is wrong and why.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv

from bench_service.formats.blocks import Block
from bench_service.formats.bounds import LINE_BYTES, Bounds
from bench_service.formats.clock_text import NoClock, nanoseconds
from bench_service.formats.description import DELIMITERS, Column, ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.text_cells import first_fault
from bench_service.formats.text_source import too_long
from bench_service.formats.text_table import TextTable
from procedures.core.arrays import Array

_BLOCK_BYTES = 4 * 1024 * 1024
_BLANKS = re.compile(rb"[ \t]+")
_MARGINS = re.compile(rb"(?m)^\t|\t(?=\r?$)")
"""Tabs at the ends of lines, in a text with single tabs: on spaces this pattern would take quadratic time."""


class _NotANumber(Exception):
    """A cell is empty, NaN or infinite where it may not be."""


def text_columns(
    stream: BinaryIO, name: str, columns: Sequence[Column], description: ImportDescription, bounds: Bounds
) -> Iterator[Block]:
    """Yield the named columns, block by block, the time first where the description has one. Raises
    `UnreadableFile`.
    """
    table = TextTable(stream, name, description, bounds)
    reader = _Reader(table, name, columns, description)
    for number, text in _pieces(table, description):
        if not text.strip():
            continue
        try:
            yield reader.block(text)
        except (pa.ArrowInvalid, _NotANumber, NoClock) as error:
            problem = first_fault(table, text, number, columns, reader.indices, description)
            raise UnreadableFile(name, problem or f"cannot be read as a table of numbers: {_short(error)}") from error


class _Reader:
    """Converts whole lines of a table to blocks."""

    def __init__(self, table: TextTable, name: str, columns: Sequence[Column], description: ImportDescription) -> None:
        self._description = description
        self.indices = table.indices(columns)
        self._names = [f"c{index}" for index in range(table.width)]
        wanted = [self._names[index] for index in self.indices]
        self._time = wanted.pop(0) if description.time_column is not None else None
        self._values = wanted
        self._blanks = description.delimiter == "whitespace"
        self._delimiter = "\t" if self._blanks else DELIMITERS[description.delimiter].decode()
        self._stamps = pa.string() if description.time_unit == "clock" else pa.int64()
        self._missing = description.gaps == "mark"

    def block(self, text: bytes) -> Block:
        """Convert some whole lines to a block. Raises `ArrowInvalid`, `_NotANumber`, `NoClock`."""
        if self._blanks:
            text = _MARGINS.sub(b"", _BLANKS.sub(b"\t", text))
        parsed = self._parsed(text)
        values = np.empty((parsed.num_rows, len(self._values)))
        for position, column in enumerate(self._values):
            values[:, position] = parsed.column(column).to_numpy()
        if np.any(np.isinf(values)) or (not self._missing and np.any(np.isnan(values))):
            raise _NotANumber("a cell is empty or not a finite number")
        return Block(None if self._time is None else self._times(parsed.column(self._time)), values)

    def _parsed(self, text: bytes) -> Any:
        """Parse text into Arrow's table; a time column of integers stays so until a piece has another number in it."""
        try:
            return self._read(text)
        except pa.ArrowInvalid:
            if self._time is None or self._stamps != pa.int64():
                raise
            self._stamps = pa.float64()
            return self._read(text)

    def _read(self, text: bytes) -> Any:
        types = dict.fromkeys(self._values, pa.float64())
        if self._time is not None:
            types[self._time] = self._stamps
        return csv.read_csv(
            pa.BufferReader(text),
            csv.ReadOptions(use_threads=False, column_names=self._names),
            csv.ParseOptions(delimiter=self._delimiter),
            csv.ConvertOptions(
                column_types=types,
                include_columns=list(types),
                null_values=["", "NaN", "nan"] if self._missing else [""],
                decimal_point=self._description.decimal,
            ),
        )

    def _times(self, column: Any) -> NDArray[np.int64] | Array:
        if self._stamps == pa.string():
            return nanoseconds(column.combine_chunks(), self._description.clock_fraction)
        if column.null_count:
            raise _NotANumber("a stamp is missing")
        stamps = column.to_numpy()
        if not np.all(np.isfinite(stamps)):
            raise _NotANumber("a stamp is not a finite number")
        return stamps


def _pieces(table: TextTable, description: ImportDescription) -> Iterator[tuple[int, bytes]]:
    """Yield whole lines of the wanted rows, with the number of the first. Raises `UnreadableFile`."""
    number, row = table.first_line, 1
    first, last = description.rows.first, description.rows.last
    while piece := table.text.piece(_BLOCK_BYTES):
        if len(piece) > LINE_BYTES and piece.find(b"\n", 0, LINE_BYTES) < 0:
            raise too_long(table.name, number)
        lines = piece.count(b"\n")
        if first == 1 and last is None:
            yield number, piece
        else:
            filled = [line for line in piece.splitlines(keepends=True) if line.strip()]
            part = filled[max(0, first - row) : None if last is None else max(0, last - row + 1)]
            row += len(filled)
            if part:
                yield number, b"".join(part)
            if last is not None and row > last:
                return
        number += lines


def _short(error: Exception) -> str:
    """Shorten Arrow's message to its beginning: it repeats the line."""
    return str(error)[:200]
