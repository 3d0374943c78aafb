"""Delimited text, Parquet and Arrow as tables of the shape that logs have, with the meaning that known dialects
give.
"""

from dataclasses import dataclass, field
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from bench_service.formats.columnar import is_columnar
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.dialects import Understood, guessed, in_dialect
from bench_service.formats.logs.names import is_time, time_unit
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable
from bench_service.formats.text_look import TextLook, look


@dataclass(frozen=True)
class Table(Understood):
    """A table that is understood, with the fields that its description needs."""

    fields: dict[str, Any] = field(default_factory=dict[str, Any])


def table_of(stream: BinaryIO, name: str) -> Table:
    """Return a table of text or of columns, after a look at its beginning. Raises `UnreadableFile`."""
    return _columnar(stream, name) if is_columnar(stream) else _text(look(stream, name), name)


def _columnar(stream: BinaryIO, name: str) -> Table:
    stream.seek(0)
    parquet = stream.read(4) == b"PAR1"
    stream.seek(0)
    source = pa.PythonFile(stream, mode="r")
    try:
        if parquet:
            schema, rows = pq.read_schema(source), None
        else:
            stream.seek(0)
            packed = stream.read(6) == b"ARROW1"
            stream.seek(0)
            schema, rows = (pa.ipc.open_file if packed else pa.ipc.open_stream)(source).schema, None
    except (pa.ArrowException, OSError) as error:
        raise UnreadableFile(name, f"cannot be read as Parquet or Arrow ({str(error)[:120]})") from error
    columns: list[LogColumn] = []
    clocks: list[LogClock] = []
    units: dict[str, str] = {}
    for item in schema:
        typed = pa.types.is_timestamp(item.type) or pa.types.is_duration(item.type)
        if typed or is_time(item.name):
            clocks.append(LogClock(item.name, None, f"column {item.name!r}"))
            units[item.name] = item.type.unit if typed else (time_unit(item.name) or "")
        columns.append(guessed(item.name))
    title = "Parquet" if parquet else "Arrow"
    return Table(title.lower(), title, LogTable("", tuple(columns), tuple(clocks), None, rows), units)


def _text(found: TextLook, name: str) -> Table:
    fields: dict[str, Any] = {}
    if found.delimiter != ",":
        fields["delimiter"] = found.delimiter
    if found.decimal != ".":
        fields["decimal"] = found.decimal
    if found.header_lines:
        fields["header_lines"] = found.header_lines
    if found.names is None or found.units is not None:
        fields["header"] = False
    return Table(**vars(in_dialect(found, name)), fields=fields)
