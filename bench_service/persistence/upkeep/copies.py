"""Copies of the whole database, made while it is used: always one SQLite file, whatever the database is.

Of SQLite it is the online backup: the pages of one moment. Of Postgres it is every row of every table of the service,
read in one snapshot (REPEATABLE READ) and written into a file that the same migrations made; documents go over as
text, so they keep their spelling. Either way the file is a database that the service itself can open.

The job engine's own database is not copied. The service's tables alone say which stations of a job are recorded, and a
job that was running at the moment of the copy continues with those that are missing. An engine's database of another
moment could count a station as done whose recording the copy does not have.
"""

import os
import sqlite3
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sqlalchemy import Connection, MetaData, Table, inspect, text
from sqlalchemy.types import JSON

from bench_service.model.errors import StorageFailure, StorageFull
from bench_service.persistence.database import Database, connect, storage_errors
from bench_service.persistence.migration import revision_of, upgrade

WIDE = frozenset({"chunks"})
"""Tables whose rows are about a megabyte each."""
ROWS, WIDE_ROWS = 1000, 16
"""Rows that are held in memory at a time."""
MOMENT = "%Y-%m-%d %H:%M:%S.%f"
"""Form of a moment (UTC) in an SQLite file."""


def copy_database(database: Database, target: Path) -> None:
    """Copy the database as it is at one moment into a new file; on a failure no file remains.

    Raises `StorageFailure` where the target exists or the copy fails, `StorageFull` where its disk is full.
    """
    with _new_file(target) as partial:
        if database.is_postgres:
            _copy_server(database, partial)
        else:
            _copy_file(Path(database.engine.url.database or ""), partial)


def copy_file(source: Path, target: Path) -> None:
    """Copy an SQLite file as `copy_database` does, without the service's own settings of a connection."""
    with _new_file(target) as partial:
        _copy_file(source, partial)


@contextmanager
def _new_file(target: Path) -> Generator[Path]:
    """Give a file to write to, which has its name once the block has ended, or is removed where it fails."""
    if target.exists():
        raise StorageFailure(f"{target} exists already: a copy is written to a new file only")
    partial = target.with_name(f".{target.name}.partial")
    try:
        with _room(partial), storage_errors():
            partial.parent.mkdir(parents=True, exist_ok=True)
            yield partial
            _settle(partial, target)
    finally:
        for left in (partial, *_companions(partial)):
            left.unlink(missing_ok=True)


@contextmanager
def _room(target: Path) -> Generator[None]:
    try:
        yield
    except StorageFull as error:
        raise StorageFull(f"no copy was made: the disk of {target.parent} is full") from error
    except OSError as error:
        raise StorageFailure(f"no copy was made in {target.parent}: {error.strerror}") from error


def _settle(partial: Path, target: Path) -> None:
    """Give a finished copy its name, once its bytes are on the disk."""
    file = os.open(partial, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)
    partial.rename(target)
    folder = os.open(target.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _companions(file: Path) -> tuple[Path, ...]:
    """Return the files that SQLite puts next to a database file."""
    return tuple(file.with_name(file.name + ending) for ending in ("-wal", "-shm", "-journal"))


def _copy_file(source: Path, target: Path) -> None:
    """Copy in one step: with WAL a reader holds no writer up, and a copy in many steps begins again at each write."""
    uri = f"file:{quote(str(source.absolute()))}?mode=rw"
    with closing(sqlite3.connect(uri, uri=True)) as from_, closing(sqlite3.connect(target)) as to:
        from_.backup(to, pages=-1)
        to.execute("PRAGMA journal_mode=DELETE")  # one file, without a log of its own


def _copy_server(database: Database, target: Path) -> None:
    source = database.engine.execution_options(isolation_level="REPEATABLE READ")
    with source.connect() as connection, connection.begin():
        connection.execute(text("SET TRANSACTION READ ONLY"))
        revision = revision_of(connection)
        if revision is None:
            raise StorageFailure("the database is empty: there is nothing to copy")
        made = empty_file(target, revision)
        with closing(sqlite3.connect(target, isolation_level=None)) as to:
            to.execute("PRAGMA journal_mode=OFF")
            to.execute("PRAGMA synchronous=OFF")  # synced once, when it is whole
            to.execute("BEGIN")
            for table in tables_of(connection, set(made)):
                columns = [column for column in table.columns if column.name in made[table.name]]
                names, marks = ", ".join(f'"{c.name}"' for c in columns), ", ".join("?" * len(columns))
                to.execute(f'DELETE FROM "{table.name}"')
                for rows in _rows(connection, table, [c.name for c in columns]):
                    to.executemany(f'INSERT INTO "{table.name}" ({names}) VALUES ({marks})', rows)
            to.execute("COMMIT")


def empty_file(target: Path, revision: str) -> dict[str, set[str]]:
    """Make an SQLite file with the tables of a revision; return the names of each table's columns."""
    database = connect(f"sqlite:///{target}")
    try:
        with database.write_connection() as connection:
            upgrade(connection, revision)
        with database.engine.connect() as connection:
            found = inspect(connection)
            return {name: {c["name"] for c in found.get_columns(name)} for name in found.get_table_names()}
    finally:
        database.dispose()


def tables_of(connection: Connection, names: set[str]) -> list[Table]:
    """Return tables of a database as it describes them itself, those first that others refer to."""
    found = MetaData()
    found.reflect(connection, only=lambda name, _: name in names)
    return [table for table in found.sorted_tables if table.name in names]


def _rows(connection: Connection, table: Table, names: list[str]) -> Iterator[list[tuple[Any, ...]]]:
    quoted = connection.dialect.identifier_preparer.quote
    wanted = [
        f"CAST({quoted(name)} AS TEXT)" if isinstance(table.c[name].type, JSON) else quoted(name) for name in names
    ]
    query = text(f"SELECT {', '.join(wanted)} FROM {quoted(table.name)}")
    size = WIDE_ROWS if table.name in WIDE else ROWS
    found = connection.execution_options(stream_results=True, yield_per=size).execute(query)
    for part in found.partitions():
        yield [tuple(map(_in_file, row)) for row in part]


def _in_file(value: Any) -> Any:
    """A value of Postgres as the service writes it into SQLite."""
    if isinstance(value, datetime):
        return value.astimezone(UTC).strftime(MOMENT)
    if isinstance(value, bool):
        return int(value)
    return bytes(value) if isinstance(value, memoryview) else value
