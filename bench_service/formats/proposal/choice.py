"""Choice of the table and the columns for a proposed description."""

from collections.abc import Sequence

from bench_service.formats.bounds import listed, quoted
from bench_service.formats.logs.table import LogColumn, LogTable
from procedures.core.recording import ACCELEROMETER, GYRO

ORDER = (*GYRO, *ACCELEROMETER)
MOST_CHANNELS = 16


def chosen_table(tables: Sequence[LogTable]) -> LogTable:
    """Return the table with the most axes; of equal ones by doubts, clock, rank, length."""
    return max(tables, key=lambda t: (_axes(t), -_doubts(t), bool(t.clocks), t.rank, t.rows or 0))


def other_tables(chosen: LogTable, tables: Sequence[LogTable]) -> list[str]:
    """Say which other tables hold a triad: another unit's, another instance's, or that which the chosen one lacks."""
    others = [t.name for t in tables if t.name != chosen.name and _axes(t) >= len(GYRO)]
    if not others:
        return []
    return [f"this is table {quoted(chosen.name)}; gyros or accelerometers are also in {listed(others)}: give table"]


def _axes(table: LogTable) -> int:
    return len({column.channel for column in table.columns} & set(ORDER))


def _doubts(table: LogTable) -> int:
    return len({column.channel for column in table.columns if column.doubt} & set(ORDER))


def chosen_columns(table: LogTable) -> tuple[list[LogColumn], list[str]]:
    """Return one column for each channel, gyros before accelerometers before the rest; and sentences on those
    left out.
    """
    first: dict[str, LogColumn] = {}
    others: list[str] = []
    for column in table.columns:
        if not column.channel or column.quantity is None:
            continue
        known = first.get(column.channel)
        if known is None:
            first[column.channel] = column
        elif _is_better(column, known):
            others.append(known.name)
            first[column.channel] = column
        else:
            others.append(column.name)
    for kind in (GYRO, ACCELEROMETER):
        _require_one_quantity(first, kind)
    order = [name for name in ORDER if name in first] + [name for name in first if name not in ORDER]
    notes = [f"columns of the same meaning that are not in the proposal: {', '.join(others[:12])}"] if others else []
    return [first[name] for name in order[:MOST_CHANNELS]], notes


def _is_better(new: LogColumn, known: LogColumn) -> bool:
    """Return whether a column is closer to the sensor: one without a doubt before one with."""
    return bool(known.doubt) and not new.doubt


def _require_one_quantity(first: dict[str, LogColumn], kind: Sequence[str]) -> None:
    """Leave out axes whose quantity is not that of the others: a rate with two increments is a wrong guess."""
    found = [first[name].quantity for name in kind if name in first]
    if len(set(found)) > 1:
        most = max(set(found), key=found.count)
        for name in kind:
            if name in first and first[name].quantity is not most:
                del first[name]


def missing_axes(columns: Sequence[LogColumn]) -> list[str]:
    """Return the names of missing axes of triads of which some axes are there."""
    have = {column.channel for column in columns}
    found: list[str] = []
    for kind in (GYRO, ACCELEROMETER):
        part = have & set(kind)
        if part and len(part) < len(kind):
            found += [name for name in kind if name not in part]
    return found
