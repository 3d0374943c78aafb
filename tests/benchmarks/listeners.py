"""``python -m tests.benchmarks.listeners``: one job's events while 200 listen to it, each losing its connection.

Printed: events missed or doubled, p95 of the delay from an event's commit to a listener's ear, and the job's wall time
beside that of the same job with nobody listening (alternating rounds, medians; at most 5 % slower). The listeners are a
process of their own; on a machine of two cores they take time from the job that listeners elsewhere would not take.
"""

import asyncio
import json
import statistics
import subprocess
import sys
from datetime import UTC, datetime

import httpx

from bench_service.wall_clock import monotonic_s, pause
from tests.benchmarks.process import Service, service

LISTENERS = 200
LOSSES = 2
ROUNDS = 3
JOB = {"procedure": "calibration_12_orientations", "parameters": {"dwell_s": 3600.0, "scalar_check": False}, "seed": 1}


async def listen(http: httpx.AsyncClient, path: str, number: int) -> tuple[list[int], list[float]]:
    """Every sequence heard, and the delays [s] of events that came while the listener was there."""
    heard: list[int] = []
    delays: list[float] = []
    for loss in range(LOSSES + 1):
        lose_after = None if loss == LOSSES else 2 + (number + loss) % 4
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


async def crowd(address: str, job_id: str) -> None:
    """Listen, and print what was heard as one JSON document."""
    limits = httpx.Limits(max_connections=None, max_keepalive_connections=0)
    async with httpx.AsyncClient(base_url=address, timeout=120, limits=limits) as http:
        found = await asyncio.gather(*(listen(http, f"/api/v1/jobs/{job_id}/events", n) for n in range(LISTENERS)))
    print(json.dumps({"heard": [heard for heard, _ in found], "delays_s": [d for _, delays in found for d in delays]}))


def job_s(running: Service, listeners: bool) -> tuple[float, int, list[float]]:
    """Wall time of a job from start to end [s], how many listeners heard not exactly everything, and the delays."""
    job = running.client.post("/api/v1/jobs", json={"unit": "SIM-0001", **JOB}).raise_for_status().json()
    ears = None
    if listeners:
        command = [sys.executable, "-m", "tests.benchmarks.listeners", str(running.client.base_url), job["id"]]
        ears = subprocess.Popen(command, stdout=subprocess.PIPE)
    while (job := running.client.get(f"/api/v1/jobs/{job['id']}").json())["state"] in ("queued", "running"):
        pause(0.2)
    assert job["state"] == "succeeded", job
    took = datetime.fromisoformat(job["finished_at"]) - datetime.fromisoformat(job["started_at"])
    if ears is None:
        return took.total_seconds(), 0, []
    said = json.loads(ears.communicate(timeout=120)[0])
    whole = list(range(1, 2 + 12 + 1 + 1))
    return took.total_seconds(), sum(heard != whole for heard in said["heard"]), said["delays_s"]


def main() -> int:
    """Print; 1 where somebody missed something or the job was slowed by more than 5 %."""
    alone: list[float] = []
    heard_by: list[float] = []
    delays: list[float] = []
    wrong = 0
    begun = monotonic_s()
    with service() as running:
        job_s(running, False)
        for _ in range(ROUNDS):
            alone.append(job_s(running, False)[0])
            seconds, missed, found = job_s(running, True)
            heard_by.append(seconds)
            delays += found
            wrong += missed
        scrape = running.client.get("/metrics").text
    slower = statistics.median(heard_by) / statistics.median(alone) - 1.0
    delays.sort()
    print(f"{LISTENERS} listeners, {LOSSES} losses each, {ROUNDS} rounds: {wrong} heard not exactly everything")
    print(f"delay p50 {statistics.median(delays) * 1e3:.0f} ms, p95 {delays[int(0.95 * len(delays))] * 1e3:.0f} ms")
    print(f"job {_shown(alone)} alone, {_shown(heard_by)} with listeners: {slower:+.1%}, budget +5 %")
    print(next(line for line in scrape.splitlines() if line.startswith("bench_listeners_dropped_total")))
    print(f"{monotonic_s() - begun:.0f} s")
    return 0 if wrong == 0 and slower <= 0.05 else 1


def _shown(seconds: list[float]) -> str:
    return f"{statistics.median(seconds):.2f} s ({', '.join(f'{s:.2f}' for s in seconds)})"


if __name__ == "__main__":
    if len(sys.argv) == 3:
        asyncio.run(crowd(sys.argv[1], sys.argv[2]))
    else:
        sys.exit(main())
