"""Two APIs and four workers on one Postgres, as plain processes: every bench strictly serial, priorities obeyed."""

import os
import signal
import socket
import statistics
import subprocess
import sys
from collections.abc import Callable, Generator
from datetime import datetime
from itertools import pairwise
from pathlib import Path

import httpx
import pytest

from bench_service.wall_clock import monotonic_s, pause

ROOT = Path(__file__).resolve().parents[2]
BENCHES = ("east", "north", "south", "west")
JOBS = 40
Start = Callable[..., subprocess.Popen[bytes]]


@pytest.fixture
def start(postgres_url: str, tmp_path: Path) -> Generator[Start]:
    """Starts processes of the service on one database; all are ended in order."""
    started: list[subprocess.Popen[bytes]] = []
    outer = {k: v for k, v in os.environ.items() if not k.startswith("BENCH_")}
    own = {"BENCH_DATABASE_URL": postgres_url, "BENCH_DEVICE_FOLDER": str(tmp_path), "PYTHONPATH": str(ROOT)}

    def begin(*arguments: str) -> subprocess.Popen[bytes]:
        with (tmp_path / "log").open("ab") as log:
            command = [sys.executable, "-m", "bench_service", *arguments]
            started.append(subprocess.Popen(command, env={**outer, **own}, stdout=log, stderr=subprocess.PIPE))
        return started[-1]

    yield begin
    for process in started:
        process.send_signal(signal.SIGTERM)
    for process in started:
        process.communicate(timeout=60)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def until(condition: Callable[[], bool], what: str, seconds: float = 90.0) -> None:
    deadline = monotonic_s() + seconds
    while not condition():
        assert monotonic_s() < deadline, what
        pause(0.05)


def answers(client: httpx.Client) -> bool:
    try:
        return client.get("/readyz").is_success
    except httpx.TransportError:
        return False


@pytest.mark.timeout(240)
def test_two_apis_and_four_workers_share_a_database(start: Start) -> None:
    ports = [free_port(), free_port()]
    for port in ports:
        start("serve", "--no-worker", "--port", str(port))
    for bench in BENCHES:
        start("worker", "--bench", bench)
    clients = [httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60) for port in ports]
    first, second = clients
    until(lambda: all(map(answers, clients)), "the APIs do not answer")
    until(lambda: {b["id"] for b in first.get("/api/v1/benches").json() if b["driven_by"]} == set(BENCHES), "no worker")

    rival = start("worker", "--bench", "east")
    assert rival.wait(60) == 2
    assert rival.stderr is not None
    assert b"bench 'east' is driven by" in rival.stderr.read()

    until(lambda: all(submitted(second, bench, "no_operation", 1)["id"] for bench in BENCHES), "warm-up")
    for bench in BENCHES:
        assert first.post(f"/api/v1/benches/{bench}/stop", json={"reason": "filling the queues"}).status_code == 202
    jobs: list[dict] = []
    for number in range(JOBS):
        bench = BENCHES[number % len(BENCHES)]
        jobs.append(submitted(clients[number % 2], bench, "no_operation", (number * 7) % 5 + 1))
    waiting = second.get(f"/api/v1/jobs/{jobs[-1]['id']}").json()
    assert "filling the queues" in waiting["waiting"]
    begun = monotonic_s()
    for bench in BENCHES:
        released = second.post(f"/api/v1/benches/{bench}/release")
        assert released.is_success, released.text

    def ended() -> bool:
        return first.get("/api/v1/jobs", params={"state": "queued", "limit": 1}).json()["items"] == []

    until(ended, "jobs are left in the queue")
    took_s = monotonic_s() - begun
    done = [first.get(f"/api/v1/jobs/{job['id']}").json() for job in jobs]
    until(lambda: all(first.get(f"/api/v1/jobs/{j['id']}").json()["state"] == "succeeded" for j in jobs), "not all ran")
    done = [first.get(f"/api/v1/jobs/{job['id']}").json() for job in jobs]
    for bench in BENCHES:
        mine = sorted((job for job in done if job["bench"] == bench), key=lambda job: job["started_at"])
        assert len(mine) == JOBS // len(BENCHES)
        assert all(a["finished_at"] <= b["started_at"] for a, b in pairwise(mine)), bench
        turns = [(job["priority"], job["queued_at"], job["id"]) for job in mine]
        assert turns == sorted(turns), bench
    ran_s = [(moment(job["finished_at"]) - moment(job["started_at"])).total_seconds() for job in done]
    latencies = [latency_s(second, bench) for bench in BENCHES for _ in range(3)]
    print(
        f"\n{JOBS} jobs over {len(BENCHES)} benches: {JOBS / took_s:.1f}/s; begun to ended p50 "
        f"{statistics.median(ran_s) * 1e3:.0f} ms; submitted over HTTP to ended, in another process, p50 "
        f"{statistics.median(latencies) * 1e3:.0f} ms"
    )
    for client in clients:
        client.close()


def submitted(client: httpx.Client, bench: str, procedure: str, priority: int) -> dict:
    body = {"procedure": procedure, "unit": "SIM-0001", "bench": bench, "priority": priority}
    answer = client.post("/api/v1/jobs", json=body)
    assert answer.status_code == 202, answer.text
    return answer.json()


def latency_s(client: httpx.Client, bench: str) -> float:
    begun = monotonic_s()
    job = submitted(client, bench, "no_operation", 1)["id"]
    until(lambda: client.get(f"/api/v1/jobs/{job}").json()["state"] == "succeeded", job)
    return monotonic_s() - begun


def moment(text: str) -> datetime:
    return datetime.fromisoformat(text)
