"""Restoration of a database from a copy of it, into SQLite or into an empty Postgres database, whichever it was.

Nothing of an older database is lost: the files of an SQLite one are put aside under another name, and a Postgres
database that holds rows is refused.
"""

import fcntl
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sqlalchemy import JSON, Boolean, Connection, DateTime, Table, inspect, make_url, text

from bench_service import wall_clock
from bench_service.model.errors import BenchBusy, StorageFailure
from bench_service.persistence.database import connect, storage_errors
from bench_service.persistence.migration import revision_of, upgrade
from bench_service.persistence.upkeep.copies import ROWS, WIDE, WIDE_ROWS, copy_file, tables_of


def restore_database(copy: Path, database_url: str, replace: bool = False) -> list[Path]:
    """Make the database of a URL from a copy; return the files that were put aside.

    With `replace` an SQLite database that exists is put aside; without, it is refused, as is a Postgres database that
    holds rows. Raises `StorageFailure`, and `BenchBusy` where a process drives a bench with the database.
    """
    if not copy.is_file():
        raise StorageFailure(f"there is no file {copy}")
    with storage_errors():
        url = make_url(database_url)
    with closing(sqlite3.connect(f"file:{quote(str(copy.absolute()))}?mode=ro", uri=True)) as file:
        _revision_in(copy, file)
    if url.get_backend_name() == "sqlite":
        return _into_file(copy, Path(url.database or ""), replace)
    _into_server(copy, database_url)
    return []


def _into_file(copy: Path, file: Path, replace: bool) -> list[Path]:
    folder, stamp = file.parent, wall_clock.now().strftime("%Y%m%dT%H%M%SZ")
    own = sorted(path for path in folder.glob(f"{file.name}*") if _belongs(path, file))
    if own and not replace:
        raise StorageFailure(f"{file} exists already; --replace puts it aside first")
    locks = [_locked(path) for path in folder.glob("bench-*.lock")]
    try:
        fresh = file.with_name(f".{file.name}.{stamp}")
        copy_file(copy, fresh)
        aside = [path.rename(path.with_name(f"{path.name}.before-restore-{stamp}")) for path in own]
        fresh.rename(file)
    finally:
        for lock in locks:
            os.close(lock)
    return aside


def _belongs(path: Path, file: Path) -> bool:
    """Return whether a file is the database, its log, or an engine's database: not a copy that was put aside."""
    rest = path.name.removeprefix(file.name)
    return rest in ("", "-wal", "-shm") or rest.endswith((".jobs", ".jobs-wal", ".jobs-shm"))


def _locked(path: Path) -> int:
    """Take a bench's lock for the time of the restoration. Raises `BenchBusy` where a process has it."""
    lock = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = os.pread(lock, 32, 0).decode(errors="replace").strip()
        os.close(lock)
        raise BenchBusy(f"{holder or 'a process'} drives a bench with this database: end it first ({path})") from None
    return lock


def _into_server(copy: Path, database_url: str) -> None:
    database = connect(database_url)
    try:
        with (
            closing(sqlite3.connect(f"file:{quote(str(copy.absolute()))}?mode=ro", uri=True)) as from_,
            storage_errors(),
        ):
            revision = _revision_in(copy, from_)
            with database.write_connection() as connection:
                _check_empty(connection)
                upgrade(connection, revision)
                names = {row[0] for row in from_.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
                tables = tables_of(connection, names - {"alembic_version"})
                for table in reversed(tables):  # a migration may have put rows of its own into a new table
                    connection.execute(table.delete())
                for table in tables:
                    _fill(connection, table, from_)
    finally:
        database.dispose()


def _revision_in(copy: Path, file: sqlite3.Connection) -> str:
    try:
        return str(file.execute("SELECT version_num FROM alembic_version").fetchone()[0])
    except (sqlite3.Error, TypeError) as error:
        raise StorageFailure(f"{copy} is not a copy of a database of this service") from error


def _check_empty(connection: Connection) -> None:
    if revision_of(connection) is None:
        return
    quoted = connection.dialect.identifier_preparer.quote
    for name in inspect(connection).get_table_names():
        if name != "alembic_version" and connection.scalar(text(f"SELECT 1 FROM {quoted(name)} LIMIT 1")):
            raise StorageFailure(f"the database holds rows already (table {name}): restore into an empty one")


def _fill(connection: Connection, table: Table, file: sqlite3.Connection) -> None:
    quoted = connection.dialect.identifier_preparer.quote
    names = [column.name for column in table.columns]
    marks = [f"CAST(:p{i} AS JSON)" if isinstance(c.type, JSON) else f":p{i}" for i, c in enumerate(table.columns)]
    insert = text(f"INSERT INTO {quoted(table.name)} ({', '.join(map(quoted, names))}) VALUES ({', '.join(marks)})")
    for rows in _rows(file, table, names):
        connection.execute(insert, rows)


def _rows(file: sqlite3.Connection, table: Table, names: list[str]) -> Iterator[list[dict[str, Any]]]:
    wanted = ", ".join(f'"{name}"' for name in names)
    found = file.execute(f'SELECT {wanted} FROM "{table.name}"')
    while part := found.fetchmany(WIDE_ROWS if table.name in WIDE else ROWS):
        yield [
            {f"p{i}": _on_server(c.type, v) for i, (c, v) in enumerate(zip(table.columns, row, strict=True))}
            for row in part
        ]


def _on_server(kind: Any, value: Any) -> Any:
    """A value of an SQLite file as Postgres takes it."""
    if value is None:
        return None
    if isinstance(kind, DateTime):
        return datetime.fromisoformat(value).replace(tzinfo=UTC)
    return bool(value) if isinstance(kind, Boolean) else value
