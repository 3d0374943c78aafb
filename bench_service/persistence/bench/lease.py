"""The right to drive a bench: one process at a time, held for its life, and free again the moment it dies.

On SQLite it is a lock on a file next to the database (the kernel drops it with the process); on Postgres an advisory
lock of a connection that is used for nothing else (the server drops it with the connection). Must not know what is
driven.
"""

import fcntl
import hashlib
import os
import socket
import threading
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, create_engine, make_url, text
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session
from sqlalchemy.pool import NullPool

from bench_service import wall_clock
from bench_service.model.errors import BenchBusy
from bench_service.persistence.database import TCP, Database, storage_errors

PASSING_S = 5.0
"""Time for which a process that starts waits for a supervisor that is just making the bench safe [s]."""
SUPERVISOR = "supervisor"
ANALYSES = "analyses"
"""Role of a worker that analyses. A host of such workers may vanish with its network, so the server looks after the
connection too and drops one that does not answer for ten seconds: the tasks of that worker go to another one."""
_SERVER_LOOKS = "-c tcp_keepalives_idle=5 -c tcp_keepalives_interval=2 -c tcp_keepalives_count=3"


class BenchLease(ABC):
    """Lease of a bench, held for the life of a process, with a check that it is still held. Base of the leases on
    SQLite and Postgres.
    """

    def __init__(self, bench_id: str, role: str) -> None:
        """Take the lease of the bench. Raises `BenchBusy`."""
        self._bench_id = bench_id
        self._role = role
        self._mutex = threading.Lock()
        self._given_back = False
        self._right: Any = self._take()
        """The open file or the connection that holds the lease; None: nothing."""

    def held(self) -> bool:
        """Return whether this process still holds the lease of the bench."""
        with self._mutex:
            return self._right is not None and self._is_ours(self._right)

    def regain(self) -> bool:
        """Take the lease again after it was lost; return False where another process was first, or on a failure."""
        with self._mutex:
            self._drop()
            if self._given_back:  # a thread that looks once more while the process ends
                return False
            try:
                self._right = self._take()
            except (BenchBusy, OSError, SQLAlchemyError):
                return False
            return True

    def release(self) -> None:
        """Release the lease for good; a second call does nothing."""
        with self._mutex:
            self._given_back = True
            self._drop()

    def _drop(self) -> None:
        right, self._right = self._right, None
        if right is not None:
            self._end(right)

    @abstractmethod
    def _take(self) -> Any:
        """Take the lease of the bench. Raises `BenchBusy`, and the errors of file or database."""

    @abstractmethod
    def _is_ours(self, right: Any) -> bool: ...

    @abstractmethod
    def _end(self, right: Any) -> None: ...


def acquire_lease(database_url: str, bench_id: str, role: str = "process") -> BenchLease:
    """Acquire the lease at once or not at all; only a supervisor, which has it for a moment, is waited for.

    `role`: as what others shall name the holder. Raises `BenchBusy`, naming the holder where it is known.
    """
    deadline = wall_clock.monotonic_s() + PASSING_S
    while True:
        try:
            return _lease(database_url, bench_id, role)
        except BenchBusy as busy:
            if not busy.passing or role == SUPERVISOR or wall_clock.monotonic_s() > deadline:
                raise
        wall_clock.pause(0.02)


def _lease(database_url: str, bench_id: str, role: str) -> BenchLease:
    with storage_errors():
        url = make_url(database_url)
        if url.get_backend_name() == "sqlite":
            return FileLease(Path(url.database or "bench.sqlite").parent / f"bench-{bench_id}.lock", bench_id, role)
        return ServerLease(url, bench_id, role)


def _written_holder(file: int) -> str:
    """Read role and process id from a lock file; its holder writes it a moment after it took the lock."""
    for _ in range(20):
        holder = os.pread(file, 32, 0).decode(errors="replace").strip()
        if holder:
            return holder
        wall_clock.pause(0.01)
    return ""


class FileLease(BenchLease):
    """Lease on SQLite: an exclusive `flock` on a file beside the database, which holds the role and process id of the
    holder. The constructor takes it and raises `BenchBusy`.
    """

    def __init__(self, path: Path, bench_id: str, role: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path
        super().__init__(bench_id, role)

    def _is_ours(self, right: int) -> bool:
        """Return whether the locked file is still the one that other processes would lock."""
        try:
            there = self._path.stat()
        except OSError:
            return False
        here = os.fstat(right)
        return (here.st_dev, here.st_ino) == (there.st_dev, there.st_ino)

    def _end(self, right: int) -> None:
        os.close(right)

    def _take(self) -> int:
        """Open the file, lock it and write this process's id into it."""
        file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            self._lock(file)
            os.ftruncate(file, 0)
            os.pwrite(file, f"{self._role} {os.getpid()}\n".encode(), 0)
        except BaseException:  # a full disk: a leaked open file would keep the lock
            os.close(file)
            raise
        return file

    def _lock(self, file: int) -> None:
        for again in range(5, -1, -1):
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            except BlockingIOError:
                if not again:
                    raise _busy(self._bench_id, _written_holder(file)) from None
            wall_clock.pause(0.01)  # perhaps `lease_holder` is only testing the lock


class ServerLease(BenchLease):
    """Lease on Postgres: an advisory lock, held by a connection that is used for nothing else. The constructor takes it
    and raises `BenchBusy`.
    """

    def __init__(self, url: URL, bench_id: str, role: str) -> None:
        self._key = lease_key(bench_id)
        self._engine = create_engine(
            url,
            poolclass=NullPool,
            isolation_level="AUTOCOMMIT",
            connect_args={
                **TCP,
                **({"options": _SERVER_LOOKS} if role == ANALYSES else {}),
                "application_name": f"bench {bench_id} {role} pid {os.getpid()} on {socket.gethostname()}"[:63],
            },
        )
        super().__init__(bench_id, role)

    def _is_ours(self, right: Connection) -> bool:
        """Ask the server over the connection that holds the lock: while it answers, the lock is held."""
        try:
            right.execute(text("SELECT 1"))
        except SQLAlchemyError:
            self._drop()
            return False
        return True

    def _end(self, right: Connection) -> None:
        right.invalidate()
        right.close()

    def _take(self) -> Connection:
        """Open a connection that holds the lock."""
        connection = self._engine.connect()
        try:
            if not connection.scalar(text("SELECT pg_try_advisory_lock(:key)"), {"key": self._key}):
                raise _busy(self._bench_id, holder(connection, self._key))
        except BaseException:
            connection.close()
            raise
        return connection


def lease_holder(database: Database, database_url: str, bench_id: str) -> str | None:
    """Name the process that drives a bench now, for a person; None: none, or only a supervisor that makes it safe.

    On SQLite the lock is tried for a moment in its shared form, which a process that starts meanwhile waits out.
    """
    if database.is_postgres:
        with database.read() as session:
            return _worker(holder(session, lease_key(bench_id)))
    path = Path(make_url(database_url).database or "bench.sqlite").parent / f"bench-{bench_id}.lock"
    try:
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _worker(os.pread(file, 32, 0).decode(errors="replace").strip() or "another process")
    else:
        return None
    finally:
        os.close(file)


def _worker(holder: str | None) -> str | None:
    return None if holder is None or f"{SUPERVISOR} " in holder else holder


def _busy(bench_id: str, who: str | None) -> BenchBusy:
    """Build the refusal of a lease, for example: bench 'sim' is driven by process 4711."""
    named = who or "another process"
    return BenchBusy(f"bench {bench_id!r} is driven by {named}", passing=f"{SUPERVISOR} " in named)


def lease_key(bench_id: str) -> int:
    """Return the number of a bench's advisory lock on Postgres, from a hash of the bench's id."""
    return int.from_bytes(hashlib.sha256(f"bench lease {bench_id}".encode()).digest()[:8], "big", signed=True)


def holder(connection: Connection | Session, key: int) -> str | None:
    """Return the holder of an advisory lock, by its connection's application name; None where the lock is free."""
    query = text(
        "SELECT a.application_name FROM pg_locks l JOIN pg_stat_activity a ON a.pid = l.pid "
        "WHERE l.locktype = 'advisory' AND l.granted AND l.objsubid = 1 "
        "AND l.classid::bigint = :high AND l.objid::bigint = :low "
        "AND l.database = (SELECT oid FROM pg_database WHERE datname = current_database())"
    )
    low, high = key & 0xFFFFFFFF, (key >> 32) & 0xFFFFFFFF
    row = connection.execute(query, {"high": high, "low": low}).first()
    return None if row is None else f"{row[0]!r}" if row[0] else "another process"
