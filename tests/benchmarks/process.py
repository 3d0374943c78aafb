"""The service as an operating system process: what a benchmark starts, asks and stops."""

import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import httpx
import psutil

from bench_service.wall_clock import monotonic_s, pause


class Service:
    """A service that runs, and a client that is connected to it."""

    def __init__(self, process: subprocess.Popen[bytes], client: httpx.Client, start_s: float) -> None:
        self.process = process
        self.client = client
        self.start_s = start_s

    def finish(self, poll_s: float = 0.002, **body: object) -> dict:
        """Submit a job and wait for its end, asking every `poll_s`: each answer takes its time from the job."""
        answer = self.client.post("/api/v1/jobs", json={"unit": "SIM-0001", **body})
        answer.raise_for_status()
        job = answer.json()
        while job["state"] in ("queued", "running"):
            pause(poll_s)
            job = self.client.get(f"/api/v1/jobs/{job['id']}").json()
        assert job["state"] == "succeeded", job
        return job

    def peak_memory_mb(self) -> float:
        """Largest resident set of the process so far."""
        status = Path(f"/proc/{self.process.pid}/status")
        if not status.exists():
            return psutil.Process(self.process.pid).memory_info().rss / 1e6
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return float(line.split()[1]) / 1e3


@contextmanager
def command(arguments: list[str], port: int, environment: dict[str, str]) -> Generator[Service]:
    """Start a command that will answer on a port, wait for its first 200, and end it afterwards."""
    begun = monotonic_s()
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(arguments, env={**os.environ, **environment}, stdout=quiet, stderr=quiet)
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=600) as client:
        try:
            while True:
                assert process.poll() is None, f"{arguments} ended with {process.returncode}"
                try:
                    if client.get("/healthz").status_code == 200:
                        break
                except httpx.TransportError:
                    pause(0.005)
            yield Service(process, client, monotonic_s() - begun)
        finally:
            process.terminate()
            process.wait(30)


@contextmanager
def service(database_url: str | None = None) -> Generator[Service]:
    """Our service, on a database of its own unless one is named."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        port = free_port()
        environment = {
            "BENCH_DATABASE_URL": database_url or f"sqlite:///{folder}/bench.sqlite",
            "BENCH_PORT": str(port),
        }
        with command([sys.executable, "-m", "bench_service", "serve"], port, environment) as running:
            yield running


def free_port() -> int:
    """A loopback port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
