"""The interface of every reader of logs: tables with columns, clocks and doubts, and their rows in blocks."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from bench_service.formats.bounds import listed, quoted
from bench_service.formats.description import Accumulated
from bench_service.formats.errors import UnreadableFile
from procedures.core.recording import Quantity

BLOCK_ROWS = 65_536
"""Number of rows of a block, about."""
PIECE_BYTES = 4 * 1024 * 1024
"""Number of bytes that a reader takes at once."""

Numbers = NDArray[Any]
"""One column's values in a block, (n,)."""


@dataclass(frozen=True)
class LogColumn:
    """A column of a log. ``scale·(raw − offset)`` is in `unit`."""

    name: str
    quantity: Quantity | Accumulated | None = None
    """Quantity of the column; None: not known, or neither rate, force, increment nor temperature."""
    unit: str | None = None
    """Unit of the column; None: the file does not state it."""
    scale: float = 1.0
    offset: float = 0.0
    channel: str = ""
    """Proposed name of the channel, gyro_x for example; empty: the column is not proposed."""
    source: str = ""
    """Origin of quantity, unit and scale, in words."""
    doubt: str = ""
    """Sentence on a column that may be something else, by its name; empty: none."""
    unit_doubt: str = ""
    """Sentence on a unit that was guessed; empty: the file states the unit, or the values tell it."""


@dataclass(frozen=True)
class LogClock:
    """A column of a log that holds time, with its unit and the meaning of the time."""

    column: str
    unit_s: float | None
    """Seconds in one unit; None: the file does not say."""
    meaning: str
    """Whose clock it is, and which moment it marks."""


@dataclass(frozen=True)
class LogTable:
    """A table of a log: a topic, a message type and its instance, a group of arrays of one length."""

    name: str
    columns: tuple[LogColumn, ...]
    clocks: tuple[LogClock, ...] = ()
    """Clocks of the rows, the one that marks the measurement first."""
    rate_hz: float | None = None
    """Rate where the file states it."""
    rows: int | None = None
    notes: tuple[str, ...] = ()
    """Sentences on what a person should know."""
    asks: tuple[str, ...] = ()
    """Sentences on what the file cannot say and a person has to decide; the proposal has a guess there."""

    rank: int = 0
    """Preference among tables of equal axes: the measurement itself above what is derived from it."""

    def column(self, name: str) -> LogColumn | None:
        """Return the column of a name; None: there is none."""
        return next((c for c in self.columns if c.name == name), None)

    def clock(self, name: str) -> LogClock | None:
        """Return the clock in a column; None: the column is no clock."""
        return next((c for c in self.clocks if c.column == name), None)


class Log(Protocol):
    """An opened file of one format. `warnings` grows while rows are read: bad checksums, parts that were left out.
    Interface.
    """

    warnings: list[str]

    def tables(self) -> Sequence[LogTable]:
        """Return the tables of the file. Raises `UnreadableFile`."""
        ...

    def rows(self, table: LogTable, columns: Sequence[str]) -> Iterator[list[Numbers]]:
        """Yield blocks of rows: for each named column its raw values, (n,). Raises `UnreadableFile`."""
        ...


@runtime_checkable
class SelfDescribing(Protocol):
    """A log whose format has a place for facts about itself and about its columns, as name -> text. Interface."""

    facts: dict[str, str]
    column_facts: dict[str, dict[str, str]]
    """By the name of a column."""


class LogFormat(Protocol):
    """Module of a format of log files: its name, its signature and its reader. Interface of the modules in
    `formats/logs`.
    """

    NAME: str
    TITLE: str

    def begins(self, start: bytes) -> bool:
        """Return whether a file that begins so is of this format."""
        ...

    def opened(self, stream: BinaryIO, name: str) -> Log:
        """Return a reader of a file of this format. Raises `UnreadableFile`."""
        ...


def find_table(log: Log, name: str, wanted: str | None, columns: Sequence[str]) -> LogTable:
    """Return the table that is asked for, or the only one that has all the columns. Raises `UnreadableFile`."""
    tables = log.tables()
    if wanted is not None:
        found = [t for t in tables if t.name == wanted]
        if not found:
            raise UnreadableFile(name, f"there is no table {quoted(wanted)}; it has {_names(tables)}")
        return found[0]
    fitting = [t for t in tables if all(t.column(c) is not None or t.clock(c) is not None for c in columns)]
    if len(fitting) == 1:
        return fitting[0]
    if not fitting and len(tables) == 1:
        return tables[0]
    why = f"the columns are in {len(fitting)} tables" if fitting else "no table has all the columns"
    raise UnreadableFile(name, f"{why}: give table, one of {_names(tables)}")


def _names(tables: Sequence[LogTable]) -> str:
    return listed([t.name for t in tables]) if tables else "none at all"


def as_numbers(values: Numbers) -> Numbers:
    """Return a column as float64, or as int64 where it holds integers that fit."""
    if values.dtype == np.int64 or values.dtype == np.float64:
        return values
    if values.dtype.kind in "iu" and values.dtype.itemsize < 8:
        return values.astype(np.int64)
    if values.dtype.kind == "u":
        return values.astype(np.int64) if not len(values) or values.max() < 2**63 else values.astype(np.float64)
    return values.astype(np.float64)


def triad(
    names: Sequence[str], kind: str, quantity: Quantity, unit: str | None, scale: float = 1.0, source: str = ""
) -> tuple[LogColumn, ...]:
    """Return the columns of three axes x, y, z; `kind`: gyro or accelerometer."""
    return tuple(
        LogColumn(name, quantity, unit, scale, 0.0, f"{kind}_{axis}", source)
        for name, axis in zip(names, "xyz", strict=True)
    )
