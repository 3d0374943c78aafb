"""Columns of numbers out of Parquet and Arrow files, a block at a time."""

from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from bench_service.formats.description import Column
from bench_service.formats.errors import UnreadableFile
from procedures.core.arrays import Array

_BLOCK_ROWS = 65_536


def is_columnar(stream: BinaryIO) -> bool:
    """Whether a file is Parquet or Arrow, by its first bytes."""
    stream.seek(0)
    start = stream.read(8)
    return start[:4] in (b"PAR1", b"\xff\xff\xff\xff") or start[:6] == b"ARROW1"


def columnar_columns(stream: BinaryIO, name: str, columns: Sequence[Column]) -> Iterator[Array]:
    """The named columns, block by block, each (n, len(columns)). Raises `UnreadableFile`."""
    stream.seek(0)
    row = 0
    try:
        schema, batches = _opened(stream)
        indices = [_index(schema, column, name) for column in columns]
        for batch in batches:
            block = np.empty((batch.num_rows, len(indices)), np.float64)
            for position, index in enumerate(indices):
                block[:, position] = batch.column(index).cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
            bad = np.argwhere(~np.isfinite(block))
            if len(bad):
                where = f"row {row + int(bad[0, 0]) + 1}, column {columns[int(bad[0, 1])]!r}"
                raise UnreadableFile(name, f"{where}: empty, NaN or infinite where a finite number was expected")
            row += batch.num_rows
            if len(block):
                yield block
    except (pa.ArrowException, OSError) as error:
        raise UnreadableFile(name, f"cannot be read as Parquet or Arrow: {error}") from error


def _opened(stream: BinaryIO) -> tuple[Any, Iterator[Any]]:
    start = stream.read(4)
    stream.seek(0)
    source = pa.PythonFile(stream, mode="r")
    if start == b"PAR1":
        file = pq.ParquetFile(source)
        return file.schema_arrow, file.iter_batches(batch_size=_BLOCK_ROWS)
    if start == b"ARRO":
        reader = pa.ipc.open_file(source)
        return reader.schema, (reader.get_batch(index) for index in range(reader.num_record_batches))
    incoming = pa.ipc.open_stream(source)
    return incoming.schema, iter(incoming)


def _index(schema: Any, column: Column, name: str) -> int:
    if isinstance(column, str) and schema.names.count(column) != 1:
        raise UnreadableFile(name, f"there is not one column {column!r}; it has {', '.join(schema.names)}")
    index = int(schema.get_field_index(column)) if isinstance(column, str) else column
    if not 0 <= index < len(schema.names):
        raise UnreadableFile(name, f"there is no column {index}; there are {len(schema.names)}")
    kind = schema.field(index).type
    if not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
        raise UnreadableFile(name, f"column {schema.names[index]!r} is of type {kind}, numbers were expected")
    return index
