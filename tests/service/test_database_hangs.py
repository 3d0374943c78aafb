"""A Postgres that neither answers nor refuses, because its processes are stopped: who looks after a bench goes on."""

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from bench_service.bench import driven
from bench_service.bench.driven import ShuttingDown
from bench_service.bench.heartbeat import HeartbeatFile
from bench_service.bench.processes import Driving
from bench_service.bench.session import BenchSession
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.supervisor import Supervisor
from bench_service.cli.asking.client import connect
from bench_service.drivers.registered import RegisteredDevices
from bench_service.jobs.runner import StepOutcome
from bench_service.persistence import acquire_lease, open_stores
from bench_service.persistence.bench.safety_books import SqlSafetyBooks
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from procedures.bench import Bench
from tests.chaos.databases import OwnPostgres, database
from tests.database_away import connections_that_wait, hung
from tests.kit.abandoned_bench import abandoned
from tests.kit.begun_job import prepared
from tests.kit.busy_machine import BUSY_S
from tests.kit.failing_driver import IMPATIENT, FailingDriver
from tests.kit.supervised_bench import GONE, Watch, identity, state
from tests.service.client import Client


@pytest.fixture(scope="module")
def postgres(tmp_path_factory: pytest.TempPathFactory) -> Generator[OwnPostgres]:
    """A server that no other test uses, with our tables."""
    with connections_that_wait(), database("postgres", tmp_path_factory.mktemp("own")) as made:
        assert isinstance(made, OwnPostgres)
        open_stores(made.url)[1].dispose()
        yield made


def test_a_supervisor_makes_the_bench_of_a_dead_worker_safe_and_says_so_later(
    postgres: OwnPostgres, tmp_path: Path, worker: Any
) -> None:
    register, watch = abandoned(tmp_path), Watch(Driving(identity(worker)))
    books = SqlSafetyBooks(postgres.url, "sim")
    take_lease = partial(acquire_lease, postgres.url, "sim", "supervisor")
    channel, heartbeat = StopChannel(tmp_path, "sim"), HeartbeatFile(tmp_path, "sim")
    channel.prepare()
    supervisor = Supervisor("sim", RegisteredDevices(register), watch, books, take_lease, channel, heartbeat)
    ending = Event()
    thread = Thread(target=supervisor.run, args=(ending, False), daemon=True)
    thread.start()
    pause(1.0)
    with hung(postgres.data):
        pause(1.0)
        assert not state(tmp_path).safe
        watch.now = GONE
        begun_s = monotonic_s()
        while not state(tmp_path).safe:
            assert monotonic_s() - begun_s < BUSY_S, "the supervisor waits for the database"
            pause(0.02)
        assert thread.is_alive()
    stores, opened = open_stores(postgres.url)
    deadline_s = monotonic_s() + 10.0
    while not (said := [entry for entry in stores.audit.list().items if entry.action == "make_safe"]):
        assert monotonic_s() < deadline_s
        pause(0.05)
    assert "made safe by the supervisor" in str(said)
    opened.dispose()
    ending.set()
    thread.join(10)
    books.close()


@pytest.mark.parametrize("what", ["a device falls silent", "the service ends"])
def test_a_worker_sees_its_devices_and_its_own_end(
    postgres: OwnPostgres, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    silent = what == "a device falls silent"
    monkeypatch.setattr(driven, "TIME_LIMITS", IMPATIENT if silent else driven.TIME_LIMITS)
    moving, go_on = Event(), Event()

    async def move(*_: object) -> None:
        moving.set()
        go_on.wait(30)  # as a vendor's library that does not return

    def change(bench: Bench) -> None:
        bench.turntable._table.move_to = move

    stores, opened = open_stores(postgres.url)
    driver = FailingDriver(tmp_path, change)
    runner, job = prepared(stores, driver, lambda: True)
    with ThreadPoolExecutor(1) as threads:
        station = threads.submit(runner.acquire, job.id, 0)
        assert moving.wait(10)
        with hung(postgres.data):
            pause(0.5)
            if silent:
                failure = station.result(BUSY_S).failure
                assert failure is not None
                assert failure.kind == "Disconnected"
            else:
                runner.shut_down()
                with pytest.raises(ShuttingDown):
                    station.result(BUSY_S)
            Thread(target=runner.make_safe, args=(job.id,), daemon=True).start()
            begun_s = monotonic_s()
            while not state(tmp_path).safe:
                assert monotonic_s() - begun_s < BUSY_S, "the worker waits for the database"
                pause(0.02)
        go_on.set()
    runner.end_early(job.id, StepOutcome(cancelled=True))
    opened.dispose()


def test_a_living_worker_gives_the_station_up_and_the_job_goes_on_after(
    postgres: OwnPostgres, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the thread that drives the bench is the one that waits, because it stores samples."""
    monkeypatch.setattr(driven, "HANGS_S", 1.0)
    record, begun = BenchSession.record, Event()

    def recorded(driving: BenchSession, index: int) -> Any:
        if index == 1:
            begun.set()
        return record(driving, index)

    monkeypatch.setattr(BenchSession, "record", recorded)
    settings = Settings(database_url=postgres.url, device_folder=tmp_path, real_time_factor=200.0)
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        job = client.submit(seed=1, parameters={"dwell_s": 200.0, "settle_s": 0.5})
        assert begun.wait(30)
        pause(0.2)
        with hung(postgres.data):
            assert not state(tmp_path).safe
            begun_s = monotonic_s()
            while not state(tmp_path).safe:
                assert monotonic_s() - begun_s < BUSY_S, "the worker waits for the database"
                pause(0.02)
        ended = client.wait(job["id"])
        assert (ended["state"], ended["attempt"]) == ("succeeded", 2), ended["error"]
        assert "the database has not answered for 1 s" in http.get(f"/api/v1/jobs/{job['id']}/events").text
