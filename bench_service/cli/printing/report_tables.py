"""The tables of a result's report, for a terminal: coefficients with their uncertainties, as on the result's page."""

from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError
from rich.markup import escape
from rich.table import Table as ScreenTable

from bench_service.evidence.catalogue import AnyMethod, AnyProcedure, Catalogue
from bench_service.model.errors import NotFound
from procedures.core.report import Cell, Table

ROWS_MAX = 60
"""Largest number of rows that are printed of a table; the page has them all."""


def report_tables(name: str, document: dict[str, Any]) -> Iterator[ScreenTable]:
    """Yield each table of the report that a method or procedure gives of a result.

    None where this version does not know the name, or where a service of another version wrote the document.
    """
    catalogue = Catalogue()
    try:
        entry = _entry(catalogue, name)
        report = entry.report(entry.result.model_validate(document))
    except (NotFound, ValidationError):
        return
    for section in report.sections:
        if isinstance(section, Table):
            yield _shown(section)


def _entry(catalogue: Catalogue, name: str) -> AnyProcedure | AnyMethod:
    """Look a name up among the procedures, then among the methods. Raises `NotFound`."""
    try:
        return catalogue.procedure(name)
    except NotFound:
        return catalogue.method(name)


def _shown(table: Table) -> ScreenTable:
    more = len(table.rows) - ROWS_MAX
    notes = [table.note] if table.note else []
    notes += [f"{more} more rows on the result's page"] if more > 0 else []
    shown = ScreenTable(title=escape(table.title), caption=escape("; ".join(notes)) or None)
    numbers = [all(not isinstance(row[k], str) for row in table.rows) for k in range(len(table.columns))]
    for name, right in zip(table.columns, numbers, strict=True):
        shown.add_column(escape(name), justify="right" if right else "left")
    for row in table.rows[:ROWS_MAX]:
        shown.add_row(*map(_cell, row))
    return shown


def _cell(value: Cell) -> str:
    """Format a number with six significant digits, an absent one as a dash."""
    if value is None:
        return "–"
    return f"{value:.6g}" if isinstance(value, float) else escape(str(value))
