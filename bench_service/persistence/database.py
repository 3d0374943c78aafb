"""Connections and transactions, on SQLite and Postgres. Knows drivers and their errors; must not know any table.

SQLite runs in WAL with ``synchronous=FULL``: with NORMAL a power cut may take back commits that were acknowledged, and
a station that the job engine counts as done would have lost its samples. The price is one fsync a commit.
Writers begin with ``BEGIN IMMEDIATE``, so two processes queue for the lock instead of failing in mid-transaction.
"""

import hashlib
import json
import shutil
import sqlite3
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, make_url, text
from sqlalchemy.exc import DBAPIError, IntegrityError, OperationalError, SQLAlchemyError, StatementError
from sqlalchemy.orm import Session
from sqlalchemy.pool import QueuePool

from bench_service import wall_clock
from bench_service.formats.plain_json import read_back
from bench_service.model.errors import DamagedDatabase, DatabaseMoved, StorageFailure, StorageFull, UnfitValue
from bench_service.persistence.upkeep.file_identity import FileIdentity

BUSY_S = 30.0
"""Longest time that a writer waits for another one [s]."""
LEAVE_S = 1.0
"""Longest time that `dispose` waits for connections that are in use [s]."""
TCP = {
    "connect_timeout": 10,
    "keepalives_idle": 5,
    "keepalives_interval": 2,
    "keepalives_count": 3,
    "tcp_user_timeout": 10_000,
}
"""A server that cannot be reached any more, or that leaves a new connection without an answer, is given up after ten
seconds [s, user timeout in ms]; over a Unix socket `connect_timeout` alone applies. One that hangs once a connection
stands is waited for: who must not wait asks in a thread of its own."""

_NEWS = "news"
_SQLITE_FULL = frozenset({sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR_SHMSIZE})
_POSTGRES_FULL = frozenset({"53100"})
_SQLITE_DAMAGED = frozenset({sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB})
_POSTGRES_DAMAGED = frozenset({"XX001", "XX002"})
_JSON: dict[str, Any] = {
    "json_serializer": partial(json.dumps, allow_nan=False),
    "json_deserializer": read_back,
}


class Conflict(StorageFailure):
    """Raised where a row contradicts another one: a key that exists already, or a reference to nothing."""


class Database:
    """Short reading and writing transactions of one database, with its errors as `StorageFull` or `StorageFailure`."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self._reading_engine = _reading(engine)
        self._writing_engine = engine.execution_options(bench_write=True)
        self._tell: list[Callable[[str], None]] = []
        self._file = None if self.is_postgres or not engine.url.database else FileIdentity(Path(engine.url.database))

    @contextmanager
    def read(self) -> Generator[Session, None, None]:
        """Open a reading transaction and give its session. On SQLite all its reads see one moment; on Postgres each
        statement its own.
        """
        self.require_file()
        with storage_errors(), Session(self._reading_engine) as session:
            yield session

    @contextmanager
    def write(self) -> Generator[Session, None, None]:
        """Open a transaction that commits at the end, or leaves nothing.

        Raises `StorageFull`, `StorageFailure`, and `DatabaseMoved` where the file is not the one that was opened.
        """
        news: list[str] = []
        self.require_file()
        with storage_errors(), Session(self._writing_engine, expire_on_commit=False) as session, session.begin():
            session.info[_NEWS] = news
            yield session
        if self._file is not None:  # deleted meanwhile: what was committed is lost, and may not be acknowledged
            self._file.look_after_commit()
            self.require_file()
        for subject in dict.fromkeys(news):
            for tell in self._tell:
                tell(subject)

    def on_news(self, tell: Callable[[str], None]) -> None:
        """Register `tell`, called after each commit with every subject that was announced in it; it may not raise."""
        self._tell.append(tell)

    @contextmanager
    def write_connection(self) -> Generator[Connection, None, None]:
        """Open a writing transaction below the tables, for migrations, and give its connection. Raises
        `StorageFailure`.
        """
        with storage_errors(), self._writing_engine.begin() as connection:
            yield connection

    def one_at_a_time(self, session: Session, what: str) -> None:
        """Wait in a writing transaction until no other one with the same `what` is open.

        On SQLite writers queue for the whole database anyway.
        """
        if self.is_postgres:
            key = int.from_bytes(hashlib.sha256(what.encode()).digest()[:8], "big", signed=True)
            session.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": key})

    def turn_at_bench(self, session: Session, bench_id: str) -> None:
        """Wait for a turn at a bench until the transaction ends: claims of its jobs, reservations and mountings take
        turns.
        """
        self.one_at_a_time(session, f"claim a job of bench {bench_id}")

    def free_bytes(self) -> int | None:
        """Return the free space on the disk of an SQLite file [bytes]; None where the database is elsewhere."""
        file = self.engine.url.database
        return None if self.is_postgres or not file else shutil.disk_usage(Path(file).parent).free

    def trouble(self) -> str | None:
        """Return why the database's file is no longer the one that was opened; None where it is, or there is none."""
        return None if self._file is None else self._file.trouble()

    def replaced(self) -> bool:
        """Return whether another file has taken the place of the one that was opened."""
        return self._file is not None and self._file.replaced()

    def require_file(self) -> None:
        """Check that the database's file is the one that was opened. Raises `DatabaseMoved`."""
        trouble = self.trouble()
        if trouble is not None:
            raise DatabaseMoved(trouble)

    @property
    def is_postgres(self) -> bool:
        return self.engine.dialect.name == "postgresql"

    def dispose(self) -> None:
        """Close all connections; wait for those that a thread still reads over, since no one would close them later."""
        pool, deadline = self.engine.pool, wall_clock.monotonic_s() + LEAVE_S
        while isinstance(pool, QueuePool) and pool.checkedout() > 0 and wall_clock.monotonic_s() < deadline:
            wall_clock.pause(0.01)
        self.engine.dispose()


def announce(session: Session, subject: str) -> None:
    """Announce a subject to the listeners of `Database.on_news` once this writing transaction is committed."""
    session.info[_NEWS].append(subject)


def missing_file(database_url: str) -> Path | None:
    """Return the file of an SQLite database that is not there, and that opening it would make; None for every other
    one.
    """
    url = make_url(database_url)
    if url.get_backend_name() != "sqlite" or url.database in (None, "", ":memory:"):
        return None
    file = Path(url.database or "")
    return None if file.is_file() else file


def connect(database_url: str) -> Database:
    """Open a database by its URL; file and folder of an SQLite one are created. Raises `StorageFailure`."""
    with storage_errors():
        url = make_url(database_url)
        if url.get_backend_name() == "sqlite":
            return Database(_sqlite_engine(database_url, url.database))
        return Database(
            create_engine(
                url,
                pool_pre_ping=True,
                pool_size=8,
                connect_args=TCP,
                **_JSON,
            )
        )


def _reading(engine: Engine) -> Engine:
    """On Postgres a read needs no transaction: under READ COMMITTED it would see no more for it, it would cost two
    round trips, and at each ROLLBACK the driver forgets what it had prepared."""
    return engine.execution_options(isolation_level="AUTOCOMMIT") if engine.dialect.name == "postgresql" else engine


def _sqlite_engine(database_url: str, file: str | None) -> Engine:
    if not file or file == ":memory:":
        raise StorageFailure(f"{database_url!r}: a file is needed, several connections share the database")
    try:
        Path(file).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageFailure(f"the folder of {file} cannot be made: {error.strerror}") from error
    engine = create_engine(database_url, connect_args={"timeout": BUSY_S}, **_JSON)
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    _switch_to_wal(engine)
    return engine


def _prepare_sqlite(connection: Any, _record: object) -> None:
    connection.isolation_level = None  # transactions are begun by `_begin_sqlite`, not guessed by the driver
    for pragma in ("synchronous=FULL", "foreign_keys=ON", "journal_size_limit=67108864", "cache_size=-8192"):
        connection.execute(f"PRAGMA {pragma}")


def _begin_sqlite(connection: Connection) -> None:
    writes = connection.get_execution_options().get("bench_write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _switch_to_wal(engine: Engine) -> None:
    """WAL is a property of the file. Two processes that switch at once do not wait for each other, so try again."""
    deadline = wall_clock.monotonic_s() + BUSY_S
    while True:
        raw = engine.raw_connection()
        try:
            raw.cursor().execute("PRAGMA journal_mode=WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or wall_clock.monotonic_s() > deadline:
                raise OperationalError("PRAGMA journal_mode=WAL", None, error) from error
        finally:
            raw.close()
        wall_clock.pause(0.02)


@contextmanager
def storage_errors() -> Generator[None, None, None]:
    """Translate errors of the database or its driver in the block: `StorageFull`, `Conflict`, `UnfitValue` or
    `DamagedDatabase`; any other one is `StorageFailure`.
    """
    try:
        yield
    except IntegrityError as error:
        raise Conflict(f"the database refused: {error.orig}") from error
    except DBAPIError as error:
        if is_full(error.orig):
            raise StorageFull("the database cannot grow: the disk is full") from error
        if is_damaged(error.orig):
            raise _damaged(error.orig) from error
        raise StorageFailure(f"the database failed: {error.orig}") from error
    except StatementError as error:  # raised before the database is asked: the value has no form there
        raise UnfitValue(f"a value cannot be stored: {error.orig}") from error
    except SQLAlchemyError as error:
        raise StorageFailure(f"the database failed: {error}") from error
    except sqlite3.Error as error:
        if is_full(error):
            raise StorageFull("the database cannot grow: the disk is full") from error
        if is_damaged(error):
            raise _damaged(error) from error
        raise StorageFailure(f"the database failed: {error}") from error
    except (ValueError, OverflowError) as error:
        raise UnfitValue(f"a value cannot be stored, or not be read again: {error}") from error


def as_storage_error(error: Exception) -> Exception:
    """Return an error of the database or its driver that was caught elsewhere as `storage_errors` translates it; any
    other error as it is.
    """
    if not isinstance(error, (SQLAlchemyError, sqlite3.Error)):
        return error
    try:
        with storage_errors():
            raise error
    except StorageFull as full:
        return full
    except StorageFailure as failure:
        return failure


def is_full(error: BaseException | None) -> bool:
    """Return whether a driver's error means that there is no room left."""
    if isinstance(error, sqlite3.Error):
        code = getattr(error, "sqlite_errorcode", 0)
        return code in _SQLITE_FULL or code & 0xFF == sqlite3.SQLITE_FULL
    return getattr(error, "sqlstate", None) in _POSTGRES_FULL


def is_damaged(error: BaseException | None) -> bool:
    """Return whether a driver's error means that the database's stored bytes are damaged."""
    if isinstance(error, sqlite3.Error):
        return getattr(error, "sqlite_errorcode", 0) & 0xFF in _SQLITE_DAMAGED
    return getattr(error, "sqlstate", None) in _POSTGRES_DAMAGED


def _damaged(error: BaseException | None) -> DamagedDatabase:
    return DamagedDatabase(
        f"the database is damaged ({error}): `bench scrub` lists the damage, `bench restore` restores a copy"
    )
