"""The service as an operating system process: what a benchmark starts, asks and stops."""

import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
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
        return _memory_mb(self.process.pid, "VmHWM")

    def memory_mb(self) -> dict[str, float]:
        """Resident set of the process now, and of each other process that it has begun, by kind and number."""
        found = {"service": _memory_mb(self.process.pid, "VmRSS")}
        return found | {name: _memory_mb(pid, "VmRSS") for name, pid in self._others()}

    def peaks_mb(self) -> dict[str, float]:
        """Largest resident set so far of each process that the service has begun and that still runs."""
        return {name: _memory_mb(pid, "VmHWM") for name, pid in self._others()}

    def processor_s(self) -> float:
        """Processor time so far of the process and of those that it has begun [s]."""
        whole = 0.0
        for process in (psutil.Process(self.process.pid), *self.children()):
            with suppress(psutil.NoSuchProcess):
                times = process.cpu_times()
                whole += times.user + times.system + times.children_user + times.children_system
        return whole

    def _others(self) -> Generator[tuple[str, int]]:
        for process in self.children():
            with suppress(psutil.NoSuchProcess):
                line = " ".join(process.cmdline())
                kinds = ("supervise", "resource_tracker", "spawn_main")
                yield f"{next((kind for kind in kinds if kind in line), 'other')} {process.pid}", process.pid

    def children(self) -> list[psutil.Process]:
        """The processes that it has begun, and those that these have begun."""
        with suppress(psutil.NoSuchProcess):
            return psutil.Process(self.process.pid).children(recursive=True)
        return []


@contextmanager
def command(
    arguments: list[str], port: int, environment: dict[str, str], folder: Path | None = None
) -> Generator[Service]:
    """Start a command that will answer on a port, wait for its first 200, and end it afterwards."""
    begun = monotonic_s()
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(arguments, env={**os.environ, **environment}, cwd=folder, stdout=quiet, stderr=quiet)
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


def _memory_mb(pid: int, kind: str) -> float:
    """A line of the kernel's book of a process [MB]; where there is no such book, or no such process, its resident set.

    `kind`: "VmHWM", the largest so far, or "VmRSS", now.
    """
    status = Path(f"/proc/{pid}/status")
    try:
        lines = status.read_text().splitlines()
    except OSError:
        with suppress(psutil.NoSuchProcess):
            return psutil.Process(pid).memory_info().rss / 1e6
        return 0.0
    line = next((line for line in lines if line.startswith(kind)), f"{kind}: 0 kB")
    return float(line.split()[1]) / 1e3


def free_port() -> int:
    """A loopback port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
