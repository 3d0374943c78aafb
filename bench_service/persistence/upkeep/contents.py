"""Checks of a database's contents as a whole, and its size. Reads only."""

import hashlib
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from sqlalchemy import text

from bench_service.model.errors import StorageFailure
from bench_service.persistence.database import Database, storage_errors
from bench_service.persistence.migration import revision_of
from bench_service.telemetry.upkeep import DatabaseSize

FAULTS = 20
"""Faults of one kind that are listed."""


class DatabaseContents:
    """Size and faults of one database. Implements `bench_service.telemetry.upkeep.DatabasePort`; reads only."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def size(self) -> DatabaseSize:
        """Return size and revision of the database; for SQLite with the room on its disk. Raises `StorageFailure`."""
        database = self._database
        with database.read() as session:
            revision = revision_of(session.connection())
            if database.is_postgres:
                used = session.scalar(text("SELECT pg_database_size(current_database())")) or 0
                return DatabaseSize("postgresql", used, None, None, revision)
            pages = session.scalar(text("PRAGMA freelist_count")) or 0
            reusable = pages * (session.scalar(text("PRAGMA page_size")) or 0)
        file = Path(database.engine.url.database or "")
        return DatabaseSize("sqlite", _bytes(file), _bytes(file, "-wal"), database.free_bytes(), revision, reusable)

    def faults(self) -> tuple[str, ...]:
        """Return what the database's own check finds wrong, a sentence each; on Postgres, which has none, an empty
        tuple.
        """
        if self._database.is_postgres:
            return ()
        self._database.require_file()
        with _reading(Path(self._database.engine.url.database or "")) as file:
            return tuple(_faults(file))

    def trouble(self) -> str | None:
        """Return why the database's file is no longer the opened one; None where it is."""
        return self._database.trouble()


def _bytes(file: Path, ending: str = "") -> int:
    try:
        return file.with_name(file.name + ending).stat().st_size
    except OSError:
        return 0


def _reading(file: Path) -> "closing[sqlite3.Connection]":
    return closing(sqlite3.connect(f"file:{quote(str(file.absolute()))}?mode=rw", uri=True))


def _faults(file: sqlite3.Connection) -> Iterator[str]:
    try:
        found = [row[0] for row in file.execute(f"PRAGMA integrity_check({FAULTS})")]
        yield from (str(line) for line in found if line != "ok")
        for table, row, parent, _ in file.execute("PRAGMA foreign_key_check").fetchmany(FAULTS):
            yield f"row {row} of {table} refers to nothing in {parent}"
    except sqlite3.DatabaseError as error:
        yield str(error)


@dataclass(frozen=True)
class CopyContents:
    """Contents of a copy of the database, as the check found them: revision, rows, chunks, faults."""

    revision: str
    rows: dict[str, int]
    chunks: int
    faults: tuple[str, ...]


def check_copy(copy: Path) -> CopyContents:
    """Check a copy as a whole, its integrity, its references, and every chunk against its hash, and return what was
    found.

    Raises `StorageFailure` where it is not a copy of a database of this service.
    """
    with storage_errors(), _reading(copy) as file:
        names = [row[0] for row in file.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name")]
        if "alembic_version" not in names:
            raise StorageFailure(f"{copy} is not a copy of a database of this service")
        (revision,) = file.execute("SELECT version_num FROM alembic_version").fetchone()
        faults = [*_faults(file)]
        rows = {name: file.execute(f'SELECT count(*) FROM "{name}"').fetchone()[0] for name in names}
        damaged = list(_altered(file)) if "chunks" in names else []
        missing = list(_missing(file)) if "chunks" in names else []
    return CopyContents(revision, rows, rows.get("chunks", 0), (*faults, *damaged[:FAULTS], *missing[:FAULTS]))


def _altered(file: sqlite3.Connection) -> Iterator[str]:
    moved = {"raw"} <= {row[1] for row in file.execute("PRAGMA table_info(recordings)")}
    here = "SELECT id FROM recordings WHERE raw <> 'stored'" if moved else "SELECT NULL WHERE 0"
    elsewhere = {row[0] for row in file.execute(here)}
    for recording, number, sha256, payload in file.execute("SELECT recording_id, number, sha256, payload FROM chunks"):
        if not payload and recording in elsewhere:  # archived, or removed by a rule: the copy does not have it
            continue
        if hashlib.sha256(payload).hexdigest() != sha256:
            yield f"chunk {number} of recording {recording} does not have the hash that it was stored with"


def _missing(file: sqlite3.Connection) -> Iterator[str]:
    query = (
        "SELECT id, chunks, (SELECT count(*) FROM chunks WHERE recording_id = r.id) FROM recordings r "
        "WHERE state = 'complete'"
    )
    for recording, wanted, there in file.execute(query):
        if wanted != there:
            yield f"recording {recording} has {there} chunks of {wanted}"
