"""One process drives a bench. Real processes, really killed."""

import errno
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
import sqlalchemy as sa

from bench_service.model.errors import BenchBusy, StorageFailure
from bench_service.persistence import BenchLease, acquire_lease, open_stores
from bench_service.persistence.bench import lease as lease_module
from bench_service.persistence.bench.lease import lease_holder
from bench_service.wall_clock import monotonic_s, pause

ROOT = Path(__file__).resolve().parents[2]
HOLDER = """
import sys
from bench_service.model.errors import BenchBusy
from bench_service.persistence import acquire_lease
print("ready", flush=True)
sys.stdin.readline()
try:
    lease = acquire_lease(sys.argv[1], "sim")
except BenchBusy as busy:
    print("busy", busy, flush=True)
else:
    print("held", lease.held(), flush=True)
sys.stdin.readline()
"""


@contextmanager
def _process(url: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", HOLDER, url]
    with subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert _line(process) == "ready\n"
            yield process
        finally:
            process.kill()


def _line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


def _go(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.write("go\n")
    process.stdin.flush()


def _acquire_soon(url: str) -> BenchLease:
    """The server may need a moment to notice that a process is gone."""
    deadline = monotonic_s() + 10.0
    while True:
        try:
            return acquire_lease(url, "sim")
        except BenchBusy:
            if monotonic_s() > deadline:
                raise
            pause(0.05)


def test_of_processes_that_race_one_gets_the_bench_and_its_death_frees_it(database_url: str) -> None:
    with ExitStack() as stack:
        processes = [stack.enter_context(_process(database_url)) for _ in range(2)]
        for process in processes:
            _go(process)
        said = [_line(process) for process in processes]
        assert sorted(line.split()[0] for line in said) == ["busy", "held"]
        holder = processes[next(i for i, line in enumerate(said) if line == "held True\n")]
        for line in said:
            assert line.startswith("held") or f"{holder.pid}" in line
        with pytest.raises(BenchBusy, match=rf"bench 'sim' is driven by .*{holder.pid}"):
            acquire_lease(database_url, "sim")
        holder.kill()
        holder.wait()
        lease = _acquire_soon(database_url)
        assert lease.held()
        lease.release()


def test_a_lease_is_for_one_bench_and_ends_with_its_release(database_url: str) -> None:
    first, other = acquire_lease(database_url, "sim"), acquire_lease(database_url, "sim-2")
    with pytest.raises(BenchBusy):
        acquire_lease(database_url, "sim")
    first.release()
    first.release()
    assert not first.held()
    assert other.held()
    other.release()
    _acquire_soon(database_url).release()


def test_a_lease_that_was_given_back_is_not_taken_again_by_who_looks_once_more(database_url: str) -> None:
    lease = acquire_lease(database_url, "sim")
    lease.release()
    assert not lease.held()
    assert not lease.regain()
    acquire_lease(database_url, "sim").release()


def test_the_process_that_drives_a_bench_is_named_and_a_supervisor_is_none(database_url: str) -> None:
    _, database = open_stores(database_url)
    assert lease_holder(database, database_url, "sim") is None, "nobody was ever there"
    lease = acquire_lease(database_url, "sim")
    named = lease_holder(database, database_url, "sim")
    assert named is not None
    assert {"process", str(os.getpid())} <= set(named.strip("'").split())
    assert lease_holder(database, database_url, "sim-2") is None
    lease.release()
    until_s = monotonic_s() + 10.0
    while lease_holder(database, database_url, "sim") is not None:  # a server sees a connection's end a moment later
        assert monotonic_s() < until_s
        pause(0.01)
    passing = acquire_lease(database_url, "sim", "supervisor")
    assert lease_holder(database, database_url, "sim") is None, "a supervisor makes a bench safe, it drives none"
    passing.release()
    database.dispose()


def test_a_process_that_starts_waits_for_a_supervisor_and_for_nobody_else(
    database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A supervisor has the lease for a moment, to make the bench safe; it waits for none itself."""
    passing, attempt, attempts = acquire_lease(database_url, "sim", "supervisor"), lease_module._lease, 0

    def attempted(*arguments: str) -> BenchLease:
        nonlocal attempts
        attempts += 1
        if attempts == 3:
            passing.release()
        return attempt(*arguments)

    monkeypatch.setattr(lease_module, "_lease", attempted)
    lease = acquire_lease(database_url, "sim")
    assert lease.held()
    assert attempts >= 3
    attempts = 3
    with pytest.raises(BenchBusy, match="process"):
        acquire_lease(database_url, "sim")
    assert attempts == 4, "a process that drives the bench keeps it: nobody waits"
    lease.release()


def test_a_supervisor_that_stays_is_not_waited_for_for_ever(sqlite_url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    passing = acquire_lease(sqlite_url, "sim", "supervisor")
    monkeypatch.setattr(lease_module, "PASSING_S", 0.1)
    begun_s = monotonic_s()
    with pytest.raises(BenchBusy, match="supervisor"):
        acquire_lease(sqlite_url, "sim")
    assert monotonic_s() - begun_s >= 0.1
    with pytest.raises(BenchBusy, match="supervisor"):
        acquire_lease(sqlite_url, "sim", "supervisor")
    passing.release()


def test_a_lease_whose_lock_file_was_taken_away_is_lost(sqlite_url: str, tmp_path: Path) -> None:
    lease = acquire_lease(sqlite_url, "sim")
    (tmp_path / "bench-sim.lock").unlink()
    assert not lease.held()
    lease.release()


def test_a_lease_whose_connection_ended_is_lost(postgres_url: str) -> None:
    lease = acquire_lease(postgres_url, "sim")
    admin = sa.create_engine(postgres_url, isolation_level="AUTOCOMMIT", poolclass=sa.NullPool)
    with admin.connect() as connection:
        ended = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name LIKE 'bench sim %pid %'"
        assert connection.scalar(sa.text(ended))
    assert not lease.held()
    assert not lease.held()
    _acquire_soon(postgres_url).release()
    lease.release()


def test_a_lease_that_a_full_disk_kept_from_being_written_can_be_had_when_there_is_room(
    sqlite_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lease = acquire_lease(sqlite_url, "sim")
    (tmp_path / "bench-sim.lock").unlink()

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", full)
        assert not lease.regain()
    assert lease.regain()
    assert lease.held()
    lease.release()


def test_a_server_that_does_not_answer_is_a_failure(tmp_path: Path) -> None:
    with pytest.raises(StorageFailure):
        acquire_lease(f"postgresql+psycopg:///bench?host={tmp_path}", "sim")
