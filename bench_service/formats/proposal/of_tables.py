"""Delimited text, Parquet and Arrow as tables of the shape that logs have, with the meaning that known dialects
give.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from bench_service.formats.bounds import quoted
from bench_service.formats.columnar import is_columnar
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.arrays_by_name.tables import with_unit
from bench_service.formats.logs.dialects import Understood, guessed, in_dialect
from bench_service.formats.logs.names import is_time, time_unit
from bench_service.formats.logs.table import LogClock, LogColumn, LogTable
from bench_service.formats.text_look import TextLook, look

FACTORS = ("scale", "offset", "scale_factor", "add_offset")
"""Metadata of a column by which its numbers are converted, in more than one convention."""


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
        columns.append(_stated(guessed(item.name), item.metadata or {}))
    title = "Parquet" if parquet else "Arrow"
    return Table(title.lower(), title, LogTable("", tuple(columns), tuple(clocks), None, rows), units)


def _stated(column: LogColumn, metadata: Mapping[bytes, bytes]) -> LogColumn:
    """Give a column the unit of its metadata; a scale or an offset there, in whatever convention, becomes a doubt."""
    if column.quantity is None:
        return column
    said = {key.decode("utf-8", "replace").lower(): value.decode("utf-8", "replace") for key, value in metadata.items()}
    unit = said.get("unit") or said.get("units") or ""
    if unit.strip():
        column = with_unit(column, unit, "column")
    factors = [f"{key} = {quoted(said[key])}" for key in FACTORS if said.get(key)]
    if factors and not column.doubt:
        doubt = f"its metadata say {', '.join(factors)}: give scale and offset, value = scale*(raw - offset)"
        column = replace(column, doubt=doubt)
    return column


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
