"""Rows of a log as the importer takes them: the columns that a description names, checked, of the rows wanted."""

from collections.abc import Iterator, Sequence

import numpy as np

from bench_service.formats.blocks import Block
from bench_service.formats.bounds import COLUMNS, Bounds, listed, not_one_column, quoted
from bench_service.formats.description import Column, ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.table import Log, LogTable, Numbers, as_numbers, find_table


def log_columns(
    log: Log, name: str, columns: Sequence[Column], description: ImportDescription, bounds: Bounds
) -> Iterator[Block]:
    """Yield the named columns, block by block, the time first where there is one. Raises `UnreadableFile`."""
    asked = [c for c in columns if isinstance(c, str)]
    table = find_table(log, name, description.table, asked)
    names = [_name(table, column, name) for column in columns]
    timed = description.time_column is not None
    stamp_s = None
    if timed and (clock := table.clock(names[0])) is not None:
        stamp_s = clock.unit_s
    row = 0
    first, last = description.rows.first - 1, description.rows.last
    for block in log.rows(table, names):
        count = len(block[0]) if block else 0
        begin = min(max(0, first - row), count)
        end = count if last is None else min(max(0, last - row), count)
        if end > begin:
            part = [column[begin:end] for column in block]
            yield _block(part, names, name, description, row + begin, stamp_s)
        row += count
        if row * len(names) > bounds.cells and last is None:
            raise UnreadableFile(
                name, f"has more than {bounds.cells} numbers, the most for a file of its size: give a part of it (rows)"
            )
        if last is not None and row >= last:
            return


def _name(table: LogTable, column: Column, name: str) -> str:
    have = [c.name for c in table.columns]
    if len(have) > COLUMNS:
        raise UnreadableFile(name, f"table {quoted(table.name)} has {len(have)} columns, at most {COLUMNS} are read")
    if isinstance(column, int):
        if not 0 <= column < len(have):
            raise UnreadableFile(
                name, f"table {quoted(table.name)} has no column {column}; it has {len(have)} columns, numbered from 0"
            )
        return have[column]
    if column not in have and table.clock(column) is None:
        times = [c.column for c in table.clocks if c.column not in have]
        problem = not_one_column(column, 0, listed([*times, *have]))
        raise UnreadableFile(name, f"table {quoted(table.name)} {problem}")
    return column


def _block(
    part: Sequence[Numbers],
    names: Sequence[str],
    name: str,
    description: ImportDescription,
    row: int,
    stamp_s: float | None,
) -> Block:
    timed = description.time_column is not None
    stamps = as_numbers(part[0]) if timed else None
    if stamps is not None and not np.all(np.isfinite(stamps)):
        at = row + int(np.flatnonzero(~np.isfinite(stamps))[0]) + 1
        raise UnreadableFile(name, f"row {at}, column {names[0]!r}: NaN or infinite where a time was expected")
    values = np.empty((len(part[0]), len(part) - timed), np.float64)
    for position, column in enumerate(part[timed:]):
        values[:, position] = column
    bad = np.isinf(values) if description.gaps == "mark" else ~np.isfinite(values)
    if np.any(bad):
        at = np.argwhere(bad)[0]
        hint = "" if np.any(np.isinf(values)) else '; gaps = "mark" takes it as a gap'
        raise UnreadableFile(
            name,
            f"row {row + int(at[0]) + 1}, column {names[int(at[1]) + timed]!r}: NaN or infinite where a finite number "
            f"was expected{hint}",
        )
    return Block(stamps, values, stamp_s)
