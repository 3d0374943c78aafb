"""Waiting for a job of a service in another process."""

from typing import Any

from bench_service.wall_clock import monotonic_s, pause
from tests.end_to_end.bench_process import BenchProcess


def ended(service: BenchProcess, job: str, seconds: float = 90.0) -> dict[str, Any]:
    deadline = monotonic_s() + seconds
    while (found := service.client.get(f"/api/v1/jobs/{job}").json())["state"] in ("queued", "running"):
        assert monotonic_s() < deadline
        pause(0.1)
    return found
