"""Makes a proposed description of a file: format, table, columns, units, clocks, and what a person has to decide."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bench_service.formats.bounds import listed
from bench_service.formats.description import ImportDescription
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.import_request import ImportFile
from bench_service.formats.joined_files import Opened
from bench_service.formats.logs.registry import TABLES, format_of
from bench_service.formats.logs.table import LogColumn, LogTable, find_table
from bench_service.formats.own_exports.model import OwnExport
from bench_service.formats.own_exports.recognition import is_named_simulated, own_export
from bench_service.formats.proposal.choice import chosen_columns, chosen_table, missing_axes, other_tables
from bench_service.formats.proposal.inspection import Values, inspected, values_of
from bench_service.formats.proposal.model import InspectedClock, Proposal, ProposedColumn, ProposedTable
from bench_service.formats.proposal.of_tables import Table, table_of
from bench_service.formats.proposal.units_seen import suspicions, with_units

SHOWN_COLUMNS = 64
MOST_TABLES = 200
RATE_TOLERANCE = 0.01
"""Largest relative difference of a stated rate and that of the stamps that is not reported."""
NAMED_BY_PEOPLE = ("text", "phone", "xsens", "ros", "parquet", "arrow", "mat5", "hdf5", "tdms")
"""Formats whose columns people may name as they like."""


def propose(file: ImportFile, unit: str | None, form: str | None, table: str | None) -> Proposal:
    """Return a proposed description of one file; reads all rows. Raises `UnreadableFile`, `UnfitRecording`,
    `BadParameter`.
    """
    found = format_of(file.stream, form)
    opened = Opened(file, None if found is None else found.opened(file.stream, file.name))
    own = own_export(opened)
    if own is not None and own.channels:
        return _of_own(opened, own, unit, form).model_copy(update={"format": TABLES if found is None else found.NAME})
    if unit is None and own is not None:
        unit = own.facts["unit"]
    if found is None or opened.log is None:
        looked = table_of(file.stream, file.name)
        return _marked(_proposed([opened], looked, [looked.table], unit, form), opened, own)
    log = opened.log
    tables = log.tables()
    if not tables:
        raise UnreadableFile(file.name, "; ".join(["holds no table of samples", *log.warnings]))
    chosen = chosen_table(tables) if table is None else find_table(log, file.name, table, [])
    fields = {"table": chosen.name} if len(tables) > 1 else {}
    looked = Table(found.NAME, found.TITLE, chosen, fields=fields)
    proposal = _marked(_proposed([opened], looked, tables, unit, form), opened, own)
    return proposal.model_copy(update={"suspicious": [*log.warnings, *proposal.suspicious]})


def _marked(proposal: Proposal, opened: Opened, own: OwnExport | None) -> Proposal:
    """Keep what a file says of its origin, where the rest of its description is read off as of any file."""
    simulated = is_named_simulated(opened) or (own is not None and own.simulated)
    notes, description = list(proposal.notes), dict(proposal.description)
    if own is not None:
        notes = [f"an export of our recording {own.facts['recording']}", *notes]
    if simulated:
        description["simulated"] = True
        notes = ["it says that it is simulated: what comes of it stays marked as simulated", *notes]
    cautions = [] if own is None else own.cautions()
    return proposal.model_copy(
        update={"notes": notes, "description": description, "suspicious": [*cautions, *proposal.suspicious]}
    )


def _of_own(opened: Opened, own: OwnExport, unit: str | None, form: str | None) -> Proposal:
    """Propose what an export of ours says of itself. Raises `UnreadableFile`."""
    try:
        fields = own.description()
        if unit is not None:
            fields["unit"] = unit
        if form is not None:
            fields["format"] = form
        ImportDescription.model_validate(fields)
    except ValueError as error:
        words = f"its own description cannot be used: {' '.join(str(error).split())[:300]}"
        raise UnreadableFile(opened.file.name, words) from error
    values = values_of([opened], {} if form is None else {"format": form}, fields["channels"])
    if np.any(values.finite < values.rows):
        fields["gaps"] = "mark"
    return Proposal(
        format=TABLES,
        title="our own export" + (", of a simulated recording" if own.simulated else ""),
        file=opened.file.name,
        table=None,
        rows=values.rows,
        rate_hz=fields["rate_hz"],
        description=fields,
        columns=[],
        clocks=[],
        tables=[],
        unknown=[],
        suspicious=own.cautions(),
        notes=own.notes(values.rows),
    )


def _proposed(
    opened: Sequence[Opened], looked: Table, tables: Sequence[LogTable], unit: str | None, form: str | None
) -> Proposal:
    table = looked.table
    columns, notes = chosen_columns(table)
    unknown = [] if unit is not None else ["unit: the serial of the unit"]
    unknown += table.asks
    fields = dict(looked.fields)
    if form is not None:
        fields["format"] = form
    suspicious: list[str] = []
    if not columns:
        unknown.append(f"which column is which channel: no name of {looked.title} tells it")
        return _result(
            opened, looked, tables, fields, unit, [], None, [], (unknown, suspicious, [*notes, *table.notes])
        )
    values = values_of(opened, fields, [_channel(column, "count") for column in columns])
    clocks, timed, asks = _clocks(opened, fields, columns[0], looked)
    rate_hz = _rate(clocks, timed, table)
    if "time_column" not in timed and rate_hz is None:
        asks.append("rate_hz: neither a clock nor the file's head gives the rate")
    columns, more, said = with_units(columns, values, rate_hz)
    if missing := missing_axes(columns):
        suspicious.append(f"no column is recognised for {', '.join(missing)}")
    unknown += [*more, *asks, *(f"{c.channel} is column {c.name!r}: {c.doubt}" for c in columns if c.doubt)]
    suspicious += suspicions(columns, values, rate_hz)
    suspicious += [
        f"{c.column!r}: {words}" for c in clocks for words in (c.warnings if c.problem is None else [c.problem])
    ]
    suspicious += _other_rate(table, rate_hz)
    notes += [*_left_out(looked, columns), *other_tables(table, tables)]
    if np.any(values.finite < values.rows):
        timed["gaps"] = "mark"
    if "time_column" not in timed and rate_hz is not None:
        timed["rate_hz"] = rate_hz
    fields = {**fields, "channels": [_channel(column, column.unit or "count") for column in columns], **timed}
    return _result(
        opened,
        looked,
        tables,
        fields,
        unit,
        columns,
        values,
        clocks,
        (unknown, suspicious, [*notes, *said, *table.notes]),
    )


def _clocks(
    opened: Sequence[Opened], fields: dict[str, Any], column: LogColumn, looked: Table
) -> tuple[list[InspectedClock], dict[str, Any], list[str]]:
    """Inspect all clocks; take the first that holds as the time, and the next of a log as the second."""
    found: list[InspectedClock] = []
    timed: dict[str, Any] = {}
    asks: list[str] = []
    for clock in looked.table.clocks:
        unit = looked.time_units.get(clock.column, "")
        view, needed, unsure = inspected(opened, fields, _channel(column, "count"), clock, unit)
        found.append(view)
        if view.problem is not None:
            continue
        if not timed:
            timed, asks = needed, unsure
        elif "second_time_column" not in timed and clock.unit_s is not None:
            timed["second_time_column"] = clock.column
    return found, timed, asks


def _other_rate(table: LogTable, rate_hz: float | None) -> list[str]:
    """Say that a file states another rate than that of its stamps."""
    if table.rate_hz is None or rate_hz is None or abs(rate_hz / table.rate_hz - 1.0) <= RATE_TOLERANCE:
        return []
    return [
        f"the file states a rate of {table.rate_hz:g} Hz, its stamps have {rate_hz:.6g} Hz: is the unit of time right?"
    ]


def _left_out(looked: Table, columns: Sequence[LogColumn]) -> list[str]:
    """Name the columns of a file of any names that are neither channel nor time."""
    if looked.format not in NAMED_BY_PEOPLE:
        return []
    table = looked.table
    used = {c.name for c in columns} | {c.column for c in table.clocks} | {c.name for c in table.columns if c.channel}
    others = [c.name for c in table.columns if c.name and c.name not in used]
    return [f"columns left out, whose names tell no channel: {listed(others)}"] if others else []


def _rate(clocks: Sequence[InspectedClock], timed: dict[str, Any], table: LogTable) -> float | None:
    if "time_column" in timed:
        return next(c.rate_hz for c in clocks if c.column == timed["time_column"])
    return table.rate_hz


def _channel(column: LogColumn, unit: str) -> dict[str, Any]:
    found: dict[str, Any] = {"name": column.channel, "quantity": str(column.quantity), "unit": unit}
    if column.name != column.channel:
        found["column"] = int(column.name) if column.name.isdecimal() else column.name
    if unit != "count" or column.scale != 1.0:
        found |= {"scale": column.scale} if column.scale != 1.0 else {}
        found |= {"offset": column.offset} if column.offset else {}
    return found


def _result(
    opened: Sequence[Opened],
    looked: Table,
    tables: Sequence[LogTable],
    fields: dict[str, Any],
    unit: str | None,
    columns: Sequence[LogColumn],
    values: Values | None,
    clocks: Sequence[InspectedClock],
    sentences: tuple[list[str], list[str], list[str]],
) -> Proposal:
    unknown, suspicious, notes = sentences
    rate = next((c.rate_hz for c in clocks if c.column == fields.get("time_column")), fields.get("rate_hz"))
    if columns:
        ImportDescription.model_validate(
            {**fields, "unit": unit or "U", "rate_hz": fields.get("rate_hz") or rate or 1.0}
        )
    return Proposal(
        format=looked.format,
        title=looked.title,
        file=opened[0].file.name,
        table=looked.table.name if len(tables) > 1 else None,
        rows=values.rows if values is not None else looked.table.rows,
        rate_hz=rate,
        description={"unit": unit, **fields},
        columns=[] if values is None else [_column(c, i, values) for i, c in enumerate(columns)],
        clocks=list(clocks),
        tables=[_table(t) for t in tables[:MOST_TABLES]] if opened[0].log is not None else [],
        unknown=unknown,
        suspicious=suspicious,
        notes=notes,
    )


def _column(column: LogColumn, place: int, values: Values) -> ProposedColumn:
    mean, deviation = float(values.means[place]), float(values.deviations[place])
    return ProposedColumn(
        channel=column.channel,
        column=column.name,
        quantity=str(column.quantity),
        unit=column.unit or "count",
        scale=column.scale,
        source=column.source,
        mean=column.scale * (mean - column.offset) if np.isfinite(mean) else None,
        deviation=abs(column.scale) * deviation if np.isfinite(deviation) else None,
        unit_doubt=column.unit_doubt or None,
    )


def _table(table: LogTable) -> ProposedTable:
    clocks = [c.column for c in table.clocks if table.column(c.column) is None]
    names = [*clocks, *(c.name for c in table.columns)]
    return ProposedTable(
        name=table.name, rows=table.rows, columns=names[:SHOWN_COLUMNS], notes=[*table.notes, *table.asks]
    )
