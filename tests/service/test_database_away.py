"""A database that goes away while a job drives the bench: the bench is safe at once, and the job goes on after."""

from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from bench_service.bench.session import BenchSession
from bench_service.cli.asking.client import connect
from bench_service.drivers.device_register import DeviceRegister
from bench_service.jobs.runner import JobRunner
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.database_away import Port
from tests.service.client import Client

STATION = {"dwell_s": 30.0, "settle_s": 0.5}
STATION_S = 1.0
"""After so long in real time a station that began is stored, or cannot be."""
SAFE_S = 2.0


@pytest.fixture
def port(postgres_url: str) -> Generator[Port]:
    made = Port(postgres_url)
    yield made
    made.cut()


def seconds_until_safe(folder: Path, most_s: float) -> float:
    register, begun_s = DeviceRegister(folder, "sim"), monotonic_s()
    while True:
        state = register.read()
        assert state is not None
        if state.safe:
            return monotonic_s() - begun_s
        assert monotonic_s() - begun_s < most_s, state.unsafe
        pause(0.02)


@pytest.mark.parametrize("when", ["before a station", "in a station", "after a station"])
def test_over_tcp_the_bench_is_safe_once_the_database_is_found_away_and_the_job_goes_on(
    port: Port, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    """A port that refuses: found by our own books before and in a station, by the engine's after."""
    cut: list[int] = []
    acquire, record = JobRunner.acquire, BenchSession.record

    def cut_at(moment: str, index: int) -> None:
        if moment == when and index == 1 and not cut:
            cut.append(index)
            port.cut()

    def acquired(runner: JobRunner, job_id: str, index: int) -> Any:
        cut_at("before a station", index)
        outcome = acquire(runner, job_id, index)
        cut_at("after a station", index)
        return outcome

    def recorded(session: BenchSession, index: int) -> Any:
        cut_at("in a station", index)
        return record(session, index)

    monkeypatch.setattr(JobRunner, "acquire", acquired)
    monkeypatch.setattr(BenchSession, "record", recorded)
    settings = Settings(database_url=port.url, device_folder=tmp_path, real_time_factor=200.0)
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        job = client.submit(seed=1, parameters=STATION)
        client.wait(job["id"], "running")
        while not cut:
            pause(0.01)
        seconds_until_safe(tmp_path, SAFE_S + (STATION_S if when == "in a station" else 0.0))
        pause(1.0)
        port.open()
        ended = client.wait(job["id"])
        assert (ended["state"], ended["attempt"]) == ("succeeded", 2), ended["error"]
        told = http.get(f"/api/v1/jobs/{job['id']}/events").text
        assert "StorageFailure" in told
        assert "INSERT" not in told, "raw SQL"
        assert "[SQL" not in told, "raw SQL"
        complete = [r["station"]["index"] for r in client.recordings(job["id"]) if r["state"] == "complete"]
        assert sorted(complete) == list(range(12))
