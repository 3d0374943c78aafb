"""Workers that analyse, as plain processes on one Postgres: one is killed, and nothing is lost or stored twice."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from pathlib import Path

import pytest
import sqlalchemy as sa

from bench_service.evidence.batches.service import BatchService
from bench_service.evidence.catalogue import Catalogue
from bench_service.model.batches import BatchRequest, BatchState, Selection, TaskState
from bench_service.persistence import open_stores
from bench_service.persistence.evidence.worker_names import SqlWorkerNames
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.white_recordings import store_white

ROOT = Path(__file__).resolve().parents[2]
TASKS = 24
Start = Callable[..., subprocess.Popen[bytes]]


@pytest.fixture
def start(postgres_url: str, tmp_path: Path) -> Generator[Start]:
    """Starts workers on one database; those that still run are killed at the end."""
    started: list[subprocess.Popen[bytes]] = []
    outer = {k: v for k, v in os.environ.items() if not k.startswith("BENCH_")}
    own = {"BENCH_DATABASE_URL": postgres_url, "BENCH_DEVICE_FOLDER": str(tmp_path), "PYTHONPATH": str(ROOT)}

    def begin(*arguments: str) -> subprocess.Popen[bytes]:
        with (tmp_path / "log").open("ab") as log:
            command = [sys.executable, "-m", "bench_service", "worker", "--analyse", *arguments]
            started.append(subprocess.Popen(command, env={**outer, **own}, stdout=log, stderr=log))
        return started[-1]

    yield begin
    for process in started:
        if process.poll() is None:
            process.kill()
        process.wait(30)


def until(condition: Callable[[], bool], what: str, seconds: float = 90.0) -> None:
    deadline = monotonic_s() + seconds
    while not condition():
        assert monotonic_s() < deadline, what
        pause(0.05)


@pytest.mark.timeout(240)
def test_a_killed_worker_loses_nothing_and_doubles_nothing(start: Start, postgres_url: str) -> None:
    stores, database = open_stores(postgres_url)
    store_white(stores, TASKS, 200_000)
    batches = stores.batches
    submitted = BatchService(stores, Catalogue()).submit(
        BatchRequest(method="allan_deviation", selection=Selection(unit="IMU-1")), "a test"
    )
    victim, other = start(), start()

    def claimed_by() -> set[str]:
        return set(batches.claimants())

    until(lambda: len(claimed_by()) == 2, "two workers at work")
    victim.send_signal(signal.SIGKILL)  # in the middle of a task, most probably
    until(lambda: batches.get(submitted.id).ended_at is not None, "the batch does not end")
    done = batches.get(submitted.id)
    assert (done.state, done.total) == (BatchState.SUCCEEDED, TASKS)
    assert other.poll() is None
    tasks = batches.tasks(submitted.id, limit=500)
    assert all(task.attempt <= 2 for task in tasks)
    with database.read() as session:
        stored = session.execute(sa.text("SELECT count(*), count(DISTINCT recording_id) FROM result_recordings")).one()
        results = session.scalar(sa.text("SELECT count(*) FROM results"))
    assert (*stored, results) == (TASKS, TASKS, TASKS), "one result for each recording"
    assert len({task.result for task in tasks}) == TASKS

    other.send_signal(signal.SIGTERM)
    assert other.wait(30) == 0
    names = SqlWorkerNames(database, postgres_url)
    until(lambda: not any(names.alive(f"analyses.{number}") for number in (1, 2)), "a name is still held")
    database.dispose()


def test_an_ended_worker_gives_its_task_back_and_the_next_one_goes_on(start: Start, postgres_url: str) -> None:
    stores, database = open_stores(postgres_url)
    store_white(stores, 2, 8_000_000, seed=1)  # some seconds each
    submitted = BatchService(stores, Catalogue()).submit(
        BatchRequest(method="allan_deviation", selection=Selection(unit="IMU-1")), "a test"
    )
    first = start()
    until(lambda: stores.batches.claimants() != (), "a task under way")
    first.send_signal(signal.SIGTERM)
    assert first.wait(30) == 0
    waiting = stores.batches.tasks(submitted.id, state=TaskState.WAITING)
    assert waiting, "what was under way waits again"
    assert all(task.attempt == 0 for task in waiting), "an end in order spends no attempt"
    assert stores.batches.claimants() == ()
    stores.batches.cancel(submitted.id, "a test", submitted.created_at)
    database.dispose()
