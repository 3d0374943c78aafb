"""The right to drive a bench: one process at a time, held for its life, and free again the moment it dies.

On SQLite it is a lock on a file beside the database (the kernel drops it with the process); on Postgres an advisory
lock of a connection that is used for nothing else (the server drops it with the connection). Must not know what is
driven.
"""

import fcntl
import hashlib
import os
import socket
import threading
from pathlib import Path
from typing import Protocol

from sqlalchemy import URL, Connection, create_engine, make_url, text
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.pool import NullPool

from bench_service import wall_clock
from bench_service.jobs.errors import BenchBusy
from bench_service.persistence.database import storage_errors


class BenchLease(Protocol):
    """The right to drive a bench, held for a process's life, and whether it is still ours."""

    def held(self) -> bool: ...

    def release(self) -> None: ...


PASSING_S = 5.0
"""How long a process that starts waits for a supervisor that makes the bench safe at this moment [s]."""
SUPERVISOR = "supervisor"


def acquire_lease(database_url: str, bench_id: str, role: str = "process") -> BenchLease:
    """Take the bench, at once or not at all; only a supervisor, which has it for a moment, is waited for.

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
    """Role and process id in a lock file; its holder writes it a moment after it took the lock."""
    for _ in range(20):
        holder = os.pread(file, 32, 0).decode(errors="replace").strip()
        if holder:
            return holder
        wall_clock.pause(0.01)
    return ""


class FileLease:
    """A locked file, with the holder's process id in it."""

    def __init__(self, path: Path, bench_id: str, role: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path
        self._file: int | None = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _written_holder(self._file)
            os.close(self._file)
            raise _busy(bench_id, holder or "another process") from None
        os.ftruncate(self._file, 0)
        os.pwrite(self._file, f"{role} {os.getpid()}\n".encode(), 0)

    def held(self) -> bool:
        """Whether the locked file is still the one that others would lock."""
        if self._file is None:
            return False
        try:
            there = self._path.stat()
        except OSError:
            return False
        here = os.fstat(self._file)
        return (here.st_dev, here.st_ino) == (there.st_dev, there.st_ino)

    def release(self) -> None:
        """Give the bench back; a second time does nothing."""
        if self._file is not None:
            os.close(self._file)
            self._file = None


class ServerLease:
    """An advisory lock of a connection of its own."""

    def __init__(self, url: URL, bench_id: str, role: str) -> None:
        self._mutex = threading.Lock()
        engine = create_engine(
            url,
            poolclass=NullPool,
            isolation_level="AUTOCOMMIT",
            connect_args={
                "connect_timeout": 10,
                "application_name": f"bench {bench_id} {role} pid {os.getpid()} on {socket.gethostname()}"[:63],
                "keepalives_idle": 5,
                "keepalives_interval": 2,
                "keepalives_count": 3,
                "tcp_user_timeout": 10_000,
            },
        )
        key = int.from_bytes(hashlib.sha256(f"bench lease {bench_id}".encode()).digest()[:8], "big", signed=True)
        connection = engine.connect()
        if not connection.scalar(text("SELECT pg_try_advisory_lock(:key)"), {"key": key}):
            holder = _holder(connection, key)
            connection.close()
            raise _busy(bench_id, holder)
        self._connection: Connection | None = connection

    def held(self) -> bool:
        """Ask the server over the connection that has the lock: while it answers, the lock is ours."""
        with self._mutex:
            if self._connection is None:
                return False
            try:
                self._connection.execute(text("SELECT 1"))
            except SQLAlchemyError:
                self._drop()
                return False
            return True

    def release(self) -> None:
        """Give the bench back; a second time does nothing."""
        with self._mutex:
            self._drop()

    def _drop(self) -> None:
        if self._connection is not None:
            self._connection.invalidate()
            self._connection.close()
            self._connection = None


def _busy(bench_id: str, holder: str) -> BenchBusy:
    """For example: bench 'sim' is driven by process 4711."""
    return BenchBusy(f"bench {bench_id!r} is driven by {holder}", passing=f"{SUPERVISOR} " in holder)


def _holder(connection: Connection, key: int) -> str:
    """Who has an advisory lock, in the words of its connection."""
    query = text(
        "SELECT a.application_name FROM pg_locks l JOIN pg_stat_activity a ON a.pid = l.pid "
        "WHERE l.locktype = 'advisory' AND l.granted AND l.objsubid = 1 "
        "AND l.classid::bigint = :high AND l.objid::bigint = :low "
        "AND l.database = (SELECT oid FROM pg_database WHERE datname = current_database())"
    )
    low, high = key & 0xFFFFFFFF, (key >> 32) & 0xFFFFFFFF
    name = connection.scalar(query, {"high": high, "low": low})
    return f"{name!r}" if name else "another process"
