"""No job is left running without anybody who runs it: another version, an engine that gives up, a death in between."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from pathlib import Path

import httpx
import pytest

from bench_service.persistence import open_stores
from bench_service.wall_clock import monotonic_s, now, pause
from tests.stops import release_all

ROOT = Path(__file__).resolve().parents[2]
SERVE = """
import sys
from bench_service.__main__ import main
from bench_service.jobs import engine
from tests.stops import release_all
engine.PROCEDURE_ABI, engine.MAX_RECOVERIES = sys.argv.pop(1), int(sys.argv.pop(1))
main()
"""
Start = Callable[..., "Served"]


class Served:
    """The service as a process of its own, of some version."""

    def __init__(self, url: str, port: int, log: Path, version: str, recoveries: int) -> None:
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=30)
        settings = {"BENCH_DATABASE_URL": url, "BENCH_PORT": str(port), "BENCH_REAL_TIME_FACTOR": "400"}
        command = [sys.executable, "-c", SERVE, version, str(recoveries), "serve"]
        with log.open("ab") as said:
            self.process = subprocess.Popen(
                command, env={**os.environ, **settings, "PYTHONPATH": str(ROOT)}, stdout=said, stderr=said
            )
        deadline = monotonic_s() + 60
        while True:
            assert self.process.poll() is None, log.read_text()
            assert monotonic_s() < deadline, log.read_text()
            try:
                if self.client.get("/readyz").is_success:
                    return
            except httpx.TransportError:
                pause(0.05)

    def submit(self, **body: object) -> str:
        answer = self.client.post("/api/v1/jobs", json={"unit": "SIM-0001", **body})
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    def until(self, job: str, *states: str, station: int = 0) -> dict:
        deadline = monotonic_s() + 60
        while True:
            seen = self.client.get(f"/api/v1/jobs/{job}").json()
            if seen["state"] in states and seen["progress"]["station"] >= station:
                return seen
            assert monotonic_s() < deadline, seen
            pause(0.01)

    def hashes(self, job: str) -> list[str]:
        found = self.client.get("/api/v1/recordings", params={"job": job}).json()["items"]
        return [r["content_hash"] for r in sorted(found, key=lambda r: r["station"]["index"])]

    def end(self, how: int = signal.SIGKILL) -> None:
        self.client.close()
        self.process.send_signal(how)
        self.process.wait(30)


@pytest.fixture
def start_on(tmp_path: Path, free_port: int) -> Generator[Callable[[str], Start]]:
    """Starts services on a database, one after the other."""
    running: list[Served] = []

    def on(url: str) -> Start:
        def begin(version: str = "1", recoveries: int = 50) -> Served:
            running.append(Served(url, free_port, tmp_path / "log", version, recoveries))
            return running[-1]

        return begin

    yield on
    for served in running:
        served.end()


CALIBRATION = {"procedure": "calibration_12_orientations", "seed": 7}


@pytest.mark.timeout(240)
def test_another_version_interrupts_a_job_says_why_and_blocks_nothing(
    start_on: Callable[[str], Start], postgres_url: str
) -> None:
    start = start_on(postgres_url)
    old = start(version="0")
    job = old.submit(**CALIBRATION)
    behind = old.submit(procedure="no_operation", priority=500)
    old.until(job, "running", station=2)
    old.end()
    new = start(version="1")
    said = new.until(job, "interrupted")["error"]
    assert said["kind"] == "OtherVersion"
    assert "sim:0" in said["message"]
    assert "sim:1" in said["message"]
    new.until(behind, "succeeded")
    assert new.client.post(f"/api/v1/jobs/{job}/resume").status_code == 202
    assert new.until(job, "succeeded", "failed")["state"] == "succeeded"
    undisturbed = new.submit(**CALIBRATION)
    new.until(undisturbed, "succeeded")
    assert new.hashes(job) == new.hashes(undisturbed)
    new.end(signal.SIGTERM)
    back = start(version="0")  # rolled back: nothing of what it left goes on by itself
    assert back.until(job, "succeeded")["attempt"] == 2
    back.until(back.submit(procedure="no_operation"), "succeeded")


@pytest.mark.timeout(240)
def test_a_job_that_takes_the_service_down_too_often_or_never_began(
    start_on: Callable[[str], Start], sqlite_url: str
) -> None:
    start = start_on(sqlite_url)
    first = start(recoveries=0)
    job = first.submit(**CALIBRATION)
    behind = first.submit(procedure="no_operation", priority=500)
    first.until(job, "running", station=1)
    first.end()
    second = start(recoveries=0)
    said = second.until(job, "interrupted")["error"]
    assert said["kind"] == "EngineGaveUp"
    assert "MAX_RECOVERY_ATTEMPTS_EXCEEDED" in said["message"]
    second.until(behind, "succeeded")

    second.client.post("/api/v1/benches/sim/stop")
    chosen = second.submit(procedure="no_operation")
    second.end()
    stores, database = open_stores(sqlite_url)
    release_all(stores.benches, "sim")
    entry = stores.queue.look("sim", now()).next()
    assert entry is not None
    assert stores.queue.claim(entry, stores.jobs.get(chosen).context, now()) is not None  # and here the process died
    database.dispose()
    third = start()
    assert third.until(chosen, "succeeded")["attempt"] == 2
    assert "NeverBegan" in third.client.get(f"/api/v1/jobs/{chosen}/events").text
