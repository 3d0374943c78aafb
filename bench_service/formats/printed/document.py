"""A printed report as plain data: blocks in the order in which a reader meets them, and files to attach."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from bench_service.formats.printed.digits import LEAST_DIGITS
from procedures.core.report import Cell, Figure, Report, Table

MOST_ROWS = 300
"""Rows of a table that are printed; the attached document has all of them."""


@dataclass(frozen=True)
class Heading:
    """Block of a report: the heading of a part."""

    text: str


@dataclass(frozen=True)
class Facts:
    """Block of a report: rows of a name and its text."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Paragraph:
    """Block of a report: a text of its own; `warning` sets it off."""

    text: str
    warning: bool = False


@dataclass(frozen=True)
class PrintedTable:
    """Block of a report: a table whose cells are text already; `numeric` lists the columns that are set to the
    right.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[int, ...] = ()
    note: str = ""


Block = Heading | Facts | Paragraph | PrintedTable | Figure


@dataclass(frozen=True)
class Attachment:
    """File inside the PDF, with its relation to the document: "Source", "Data", "Alternative" or "Supplement"."""

    name: str
    media_type: str
    data: bytes
    relation: str
    description: str


@dataclass(frozen=True)
class PrintedDocument:
    """A report that can be typeset. Equal documents give equal bytes: `at` is the only time in the file."""

    title: str
    subject: str
    """Second line of the title: the unit, or the procedure."""
    verdict: str
    """Word of the verdict; empty: there is none to print."""
    identifier: str
    """Identifier that each page repeats."""
    at: datetime
    blocks: tuple[Block, ...]
    attachments: tuple[Attachment, ...] = ()


def printed_table(table: Table) -> PrintedTable:
    """Return a table of a result's report as text; of a long one the first rows, and the note says so."""
    rows = tuple(tuple(_cell(cell) for cell in row) for row in table.rows[:MOST_ROWS])
    left = len(table.rows) - len(rows)
    more = f" {left} more rows are in the attached document." if left > 0 else ""
    return PrintedTable(table.title, table.columns, rows, _numeric(table.rows), f"{table.note}{more}".strip())


def blocks_of(report: Report) -> tuple[Block, ...]:
    """Return the tables and figures of a result's report, in its order."""
    return tuple(printed_table(one) if isinstance(one, Table) else one for one in report.sections)


def _cell(cell: Cell) -> str:
    if cell is None:
        return "–"
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    return f"{cell:.{LEAST_DIGITS}g}" if isinstance(cell, float) else str(cell)


def _numeric(rows: Sequence[Sequence[Cell]]) -> tuple[int, ...]:
    """Indices of the columns that hold numbers and dashes alone."""
    columns = len(rows[0]) if rows else 0
    return tuple(i for i in range(columns) if all(isinstance(row[i], int | float | None) for row in rows))
