"""``python -m tests.benchmarks.listeners``: one job's events while 200 listen to it.

First they come, stay, and are compared with the same job alone, in alternating rounds: wall time and the service's own
processor time, which a busy machine disturbs less (medians; at most 5 % more). Then each loses its connection twice:
events missed or doubled, and the delay from an event's time to a listener's ear. The listeners are a process of their
own; on a machine of two cores they take wall time from the job that listeners elsewhere would not take.
"""

import asyncio
import json
import statistics
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime

import httpx
import psutil

from bench_service.wall_clock import pause
from tests.benchmarks.process import Service, service

LISTENERS = 200
LOSSES = 2
ROUNDS = 3
JOB = {"procedure": "calibration_12_orientations", "parameters": {"dwell_s": 3600.0, "scalar_check": False}, "seed": 1}

EVENTS = list(range(1, 2 + 12 + 1 + 1))
"""queued, running, twelve stations, succeeded."""


async def listen(http: httpx.AsyncClient, path: str, number: int, losses: int) -> tuple[list[int], list[float]]:
    """Every sequence heard, and the delays [s] of events that came while the listener was there."""
    heard: list[int] = []
    delays: list[float] = []
    for loss in range(losses + 1):
        lose_after = None if loss == losses else 2 + (number + loss) % 4
        headers = {"Last-Event-ID": str(heard[-1])} if heard else {}
        there_since, fresh = datetime.now(UTC), 0
        async with http.stream("GET", path, headers=headers) as answer:
            async for line in answer.aiter_lines():
                if not line.startswith('data: {"sequence"'):
                    continue
                event = json.loads(line.removeprefix("data: "))
                heard.append(event["sequence"])
                at = datetime.fromisoformat(event["at"])
                if at > there_since:
                    delays.append((datetime.now(UTC) - at).total_seconds())
                fresh += 1
                if fresh == lose_after:
                    break
            else:
                break
    return heard, delays


async def crowd(address: str, job_id: str, losses: int) -> None:
    """Listen, and print what was heard as one JSON document."""
    limits = httpx.Limits(max_connections=None, max_keepalive_connections=0)
    async with httpx.AsyncClient(base_url=address, timeout=120, limits=limits) as http:
        path = f"/api/v1/jobs/{job_id}/events"
        found = await asyncio.gather(*(listen(http, path, number, losses) for number in range(LISTENERS)))
    print(json.dumps({"heard": [heard for heard, _ in found], "delays_s": [d for _, delays in found for d in delays]}))


@dataclass(frozen=True)
class Round:
    """One job: its wall time, the service's processor time, how many heard not exactly everything, the delays."""

    wall_s: float
    processor_s: float
    wrong: int
    delays_s: list[float]


def one_job(running: Service, losses: int | None) -> Round:
    """Run a job while all listen, each losing its connection so often; None: nobody listens."""
    service_process = psutil.Process(running.process.pid)
    before = service_process.cpu_times()
    job = running.client.post("/api/v1/jobs", json={"unit": "SIM-0001", **JOB}).raise_for_status().json()
    ears = None
    if losses is not None:
        command = [sys.executable, "-m", "tests.benchmarks.listeners", str(running.client.base_url), job["id"]]
        ears = subprocess.Popen([*command, str(losses)], stdout=subprocess.PIPE)
    while (job := running.client.get(f"/api/v1/jobs/{job['id']}").json())["state"] in ("queued", "running"):
        pause(0.5)
    assert job["state"] == "succeeded", job
    after = service_process.cpu_times()
    processor_s = after.user + after.system - before.user - before.system
    took = datetime.fromisoformat(job["finished_at"]) - datetime.fromisoformat(job["started_at"])
    if ears is None:
        return Round(took.total_seconds(), processor_s, 0, [])
    said = json.loads(ears.communicate(timeout=120)[0])
    wrong = sum(heard != EVENTS for heard in said["heard"])
    return Round(took.total_seconds(), processor_s, wrong, said["delays_s"])


def main() -> int:
    """Print; 1 where somebody missed something or the job took more than 5 % more of the service's time."""
    alone: list[Round] = []
    heard: list[Round] = []
    with service() as running:
        running.finish(0.2, procedure="no_operation")
        for _ in range(ROUNDS):
            alone.append(one_job(running, None))
            heard.append(one_job(running, 0))
        lost = one_job(running, LOSSES)
        scrape = running.client.get("/metrics").text
    slower = 0.0
    for what in ("wall_s", "processor_s"):
        without, with_them = ([getattr(r, what) for r in rounds] for rounds in (alone, heard))
        slower = statistics.median(with_them) / statistics.median(without) - 1.0
        print(f"{what}: {_shown(without)} alone, {_shown(with_them)} while {LISTENERS} listen: {slower:+.1%}")
    for what, rounds in (("staying", heard), (f"losing the connection {LOSSES} times", [lost])):
        delays = sorted(d for r in rounds for d in r.delays_s)
        p50, p95 = statistics.median(delays) * 1e3, delays[int(0.95 * len(delays))] * 1e3
        wrong = sum(r.wrong for r in rounds)
        print(f"{what}: {wrong} heard not exactly everything; delay p50 {p50:.0f} ms, p95 {p95:.0f} ms")
    print(next(line for line in scrape.splitlines() if line.startswith("bench_listeners_dropped_total")))
    return 0 if sum(r.wrong for r in (*heard, lost)) == 0 and slower <= 0.05 else 1


def _shown(seconds: list[float]) -> str:
    return f"{statistics.median(seconds):.2f} s ({', '.join(f'{s:.2f}' for s in seconds)})"


if __name__ == "__main__":
    if len(sys.argv) == 4:
        asyncio.run(crowd(sys.argv[1], sys.argv[2], int(sys.argv[3])))
    else:
        sys.exit(main())
