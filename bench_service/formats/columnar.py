"""Columns of numbers out of Parquet and Arrow files, a block at a time."""

from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from bench_service.formats.blocks import Block
from bench_service.formats.bounds import COLUMNS, MEGABYTE, Bounds, listed, not_one_column, quoted
from bench_service.formats.clock_text import NoClock, nanoseconds
from bench_service.formats.description import SECONDS, Column, ImportDescription
from bench_service.formats.errors import UnreadableFile
from procedures.core.arrays import Array

_BLOCK_ROWS = 65_536
_CUT_OFF = "it is cut off: what stands at its end, or what it announces, is missing; copy it again"
_DESCRIPTION = "it is damaged: its own description of columns and types cannot be read; copy it again"
_PACKED = "it is damaged: a column cannot be unpacked; copy it again"
_UNFIT = "its parts do not fit together; copy it again, or export it anew"
_DAMAGES = (
    ("magic bytes", _CUT_OFF),
    ("file size is", _CUT_OFF),
    ("Not an Arrow file", _CUT_OFF),
    ("File is too small", _CUT_OFF),
    ("xpected to", _CUT_OFF),
    ("end of stream", _CUT_OFF),
    ("thrift", _DESCRIPTION),
    ("latbuffers", _DESCRIPTION),
    ("metadata", _DESCRIPTION),
    ("continuation token", _DESCRIPTION),
    ("ecompress", _PACKED),
    ("Codec failed", _PACKED),
    ("orrupt", _PACKED),
    ("page header", _PACKED),
)
_THRIFT_BYTES = 64 * MEGABYTE
"""Largest description in a Parquet file's footer."""


def is_columnar(stream: BinaryIO) -> bool:
    """Return whether a file is Parquet or Arrow, by its first bytes."""
    stream.seek(0)
    start = stream.read(8)
    return start[:4] in (b"PAR1", b"\xff\xff\xff\xff") or start[:6] == b"ARROW1"


def columnar_columns(
    stream: BinaryIO, name: str, columns: Sequence[Column], description: ImportDescription, bounds: Bounds
) -> Iterator[Block]:
    """Yield the named columns, block by block, the time first where the description has one. Raises
    `UnreadableFile`.
    """
    stream.seek(0)
    row = 0
    try:
        batches, indices, positions = _opened(stream, name, columns, description, bounds)
        for whole in batches:
            first, last = description.rows.first - 1, description.rows.last
            begin = min(max(0, first - row), whole.num_rows)
            end = whole.num_rows if last is None else min(max(0, last - row), whole.num_rows)
            for start in range(begin, max(begin, end), _BLOCK_ROWS):
                batch = whole.slice(start, min(_BLOCK_ROWS, end - start))
                yield _block(batch, name, columns, [positions[i] for i in indices], description, row + start)
            row += whole.num_rows
            if last is not None and row >= last:
                return
    except (pa.ArrowException, OSError, UnicodeDecodeError, OverflowError, KeyError, IndexError) as error:
        if isinstance(error, MemoryError):
            raise
        raise UnreadableFile(name, f"cannot be read as Parquet or Arrow: {_in_words(error)}") from error


def _in_words(error: Exception) -> str:
    """Return the meaning of Arrow's message, as far as it is known, and the message, shortened."""
    said = " ".join(str(error).split())[:120]
    return f"{next((words for sign, words in _DAMAGES if sign in said), _UNFIT)} ({said})"


def _block(
    batch: Any, name: str, columns: Sequence[Column], places: Sequence[int], description: ImportDescription, row: int
) -> Block:
    timed = description.time_column is not None
    stamps, stamp_s = None, None
    if timed:
        stamps, stamp_s = _stamps(batch.column(places[0]), name, columns[0], description, row)
    values = np.empty((batch.num_rows, len(columns) - timed), np.float64)
    for position, place in enumerate(places[timed:]):
        values[:, position] = batch.column(place).cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    bad = np.isinf(values) if description.gaps == "mark" else ~np.isfinite(values)
    if np.any(bad):
        at = np.argwhere(bad)[0]
        column = columns[int(at[1]) + timed]
        hint = "" if np.any(np.isinf(values)) else '; gaps = "mark" takes it as a gap'
        raise UnreadableFile(
            name,
            f"row {row + int(at[0]) + 1}, column {column!r}: empty, NaN or infinite where a finite number was "
            f"expected{hint}",
        )
    return Block(stamps, values, stamp_s)


def _stamps(
    column: Any, name: str, asked: Column, description: ImportDescription, row: int
) -> tuple[NDArray[np.int64] | Array, float | None]:
    """Stamps of a column, and the seconds in one unit of them where their type defines it."""
    kind = column.type
    if column.null_count:
        at = row + int(np.flatnonzero(~column.is_valid().to_numpy(zero_copy_only=False))[0]) + 1
        raise UnreadableFile(name, f"row {at}, column {asked!r}: empty where a time was expected")
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return _clock(column, name, asked, description, row), SECONDS["ns"]
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind):
        counts = column.cast(pa.int32() if kind.bit_width == 32 else pa.int64())
        return counts.cast(pa.int64()).to_numpy(zero_copy_only=False), SECONDS[kind.unit]
    if pa.types.is_integer(kind) and kind != pa.uint64():
        return column.cast(pa.int64()).to_numpy(zero_copy_only=False), None
    stamps = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    if not np.all(np.isfinite(stamps)):
        at = row + int(np.flatnonzero(~np.isfinite(stamps))[0]) + 1
        raise UnreadableFile(name, f"row {at}, column {asked!r}: NaN or infinite where a time was expected")
    return stamps, None


def _clock(column: Any, name: str, asked: Column, description: ImportDescription, row: int) -> NDArray[np.int64]:
    if description.time_unit != "clock":
        raise UnreadableFile(name, f'column {asked!r} is text: time_unit = "clock" reads the text of a clock')
    try:
        return nanoseconds(column, description.clock_fraction)
    except NoClock as error:
        where = f"row {row + error.row + 1}, column {asked!r}"
        raise UnreadableFile(name, f"{where}: {quoted(error.text)} is not the text of a clock") from error


def _opened(
    stream: BinaryIO, name: str, columns: Sequence[Column], description: ImportDescription, bounds: Bounds
) -> tuple[Iterator[Any], list[int], dict[int, int]]:
    """Batches of the columns that are wanted, where each stands in the file, and where in a batch."""
    timed = description.time_column is not None
    start = stream.read(4)
    stream.seek(0)
    source = pa.PythonFile(stream, mode="r")
    if start == b"PAR1":
        file = pq.ParquetFile(
            source, thrift_string_size_limit=_THRIFT_BYTES, thrift_container_size_limit=1_000_000, buffer_size=MEGABYTE
        )
        indices = _indices(file.schema_arrow, columns, name, timed)
        wanted = sorted(set(indices))
        _require_bounded(file.metadata, file.schema_arrow, wanted, name, bounds)
        names = [file.schema_arrow.names[i] for i in wanted]
        if any(file.schema_arrow.names.count(n) > 1 for n in names):  # they can be picked by name alone
            return file.iter_batches(batch_size=_BLOCK_ROWS, use_threads=False), indices, {i: i for i in wanted}
        batches = file.iter_batches(batch_size=_BLOCK_ROWS, columns=names, use_threads=False)
        return batches, indices, {index: position for position, index in enumerate(wanted)}
    schema = (pa.ipc.open_file if start == b"ARRO" else pa.ipc.open_stream)(source).schema
    indices = _indices(schema, columns, name, timed)
    wanted = sorted(set(indices))
    options = pa.ipc.IpcReadOptions(included_fields=wanted, use_threads=False)
    stream.seek(0)
    source = pa.PythonFile(stream, mode="r")
    positions = {index: position for position, index in enumerate(wanted)}
    if start == b"ARRO":
        reader = pa.ipc.open_file(source, options=options)
        return (reader.get_batch(index) for index in range(reader.num_record_batches)), indices, positions
    return iter(pa.ipc.open_stream(source, options=options)), indices, positions


def _require_bounded(metadata: Any, schema: Any, wanted: Sequence[int], name: str, bounds: Bounds) -> None:
    """Check the size of the columns before one is unpacked. Raises `UnreadableFile` where they are too long."""
    cells = metadata.num_rows * len(wanted)
    if cells > bounds.cells:
        raise UnreadableFile(
            name,
            f"{metadata.num_rows} rows of {len(wanted)} columns are {cells} numbers, at most {bounds.cells} are read",
        )
    if metadata.num_columns != len(schema.names):  # nested columns: the wanted ones cannot be identified here
        return
    unpacked = sum(
        metadata.row_group(group).column(index).total_uncompressed_size
        for group in range(metadata.num_row_groups)
        for index in wanted
    )
    if unpacked > bounds.unpacked_bytes:
        raise UnreadableFile(
            name, f"unpacks to {unpacked // MEGABYTE} MB, at most {bounds.unpacked_bytes // MEGABYTE} MB are read"
        )


def _indices(schema: Any, columns: Sequence[Column], name: str, timed: bool) -> list[int]:
    names: list[str] = schema.names
    if len(names) > COLUMNS:
        raise UnreadableFile(name, f"has {len(names)} columns, at most {COLUMNS} are read")
    return [_index(schema, names, column, name, timed and place == 0) for place, column in enumerate(columns)]


def _index(schema: Any, names: list[str], column: Column, name: str, is_time: bool) -> int:
    if isinstance(column, str) and names.count(column) != 1:
        raise UnreadableFile(name, not_one_column(column, names.count(column), listed(names)))
    index = names.index(column) if isinstance(column, str) else column
    if not 0 <= index < len(names):
        raise UnreadableFile(name, f"has no column {index}; it has {len(names)} columns, numbered from 0")
    kind = schema.field(index).type
    if not (_is_number(kind) or (is_time and _is_time(kind))):
        expected = "numbers or times" if is_time else "numbers"
        raise UnreadableFile(
            name, f"column {quoted(names[index])} is of type {str(kind)[:80]}, {expected} were expected"
        )
    return index


def _is_number(kind: Any) -> bool:
    return pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)


def _is_time(kind: Any) -> bool:
    text = pa.types.is_string(kind) or pa.types.is_large_string(kind)
    return text or pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind)
