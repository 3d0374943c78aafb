"""Upkeep of the database: reports of checks and copies, the interface of their store, and that of the database as a
whole.
"""

from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any, Protocol

from bench_service.model.records import Page


class UpkeepKind(StrEnum):
    """Kinds of upkeep that are reported: check of the contents, copy, retention of raw data."""

    SCRUB = "scrub"
    """A check of the database's integrity and of every stored chunk against its hash."""
    BACKUP = "backup"
    """A copy of the whole database."""
    RETENTION = "retention"
    """Removal of raw data by the rule of retention."""
    ARCHIVE = "archive"
    """Raw data moved to the archive."""


@dataclass(frozen=True)
class UpkeepReport:
    """One piece of upkeep of the database, with its times, its outcome and a document of details."""

    id: str
    kind: UpkeepKind
    began_at: datetime
    by: str
    """The process that did the work, as text."""
    ended_at: datetime | None = None
    """Time of the end; None: the work is under way, or its process died."""
    good: bool | None = None
    """True where nothing was wrong, False where something was, which the document names; None: it has not ended."""
    document: dict[str, Any] = field(default_factory=dict[str, Any])


class UpkeepStore(Protocol):
    """Store of the reports of upkeep. Every method is one transaction. Interface; the SQL is in `persistence`."""

    def begin(self, report: UpkeepReport, unless_since: datetime | None = None) -> bool:
        """Store a report that has not ended, and return True; with `unless_since` only where no other of its kind began
        since then.
        """
        ...

    def end(self, report: UpkeepReport) -> None:
        """Replace a report that has not ended by the one with its outcome."""
        ...

    def last(self, kind: UpkeepKind) -> UpkeepReport | None:
        """Return the latest report of a kind that has ended; None where there is none."""
        ...

    def list(self, *, kind: UpkeepKind | None = None, after: str | None = None, limit: int = 50) -> Page[UpkeepReport]:
        """Return one page of reports, of one kind or all, newest first."""
        ...


@dataclass(frozen=True)
class DatabaseSize:
    """Size of a database and of its log, free space on its disk [bytes], and its revision."""

    kind: str
    """"sqlite" or "postgresql"."""
    stored_bytes: int
    log_bytes: int | None
    """Length of the write-ahead log's file; None where the database is a server's."""
    free_bytes: int | None
    """Room on the disk of the file; None where the database is a server's."""
    revision: str | None
    """Revision of the tables."""
    reusable_bytes: int | None = None
    """Room inside an SQLite file that removed data left; None where the database is a server's."""


class DatabasePort(Protocol):
    """The database as a whole: its size and its faults. Interface; see `persistence/upkeep/contents.py`."""

    def size(self) -> DatabaseSize:
        """Return the size of the database. Raises `StorageFailure`."""
        ...

    def faults(self) -> tuple[str, ...]:
        """Return faults that the database itself finds in its pages and references, a sentence each; it may take
        minutes.
        """
        ...

    def trouble(self) -> str | None:
        """Return why the database's file is no longer the one that was opened; None where it is."""
        ...


class NoDatabase:
    """A `DatabasePort` of a service whose database is not known as a whole."""

    def size(self) -> DatabaseSize:
        return DatabaseSize("unknown", 0, None, None, None)

    def faults(self) -> tuple[str, ...]:
        return ()

    def trouble(self) -> str | None:
        return None
