"""The service as a process of its own whose log lines a test reads."""

import os
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import httpx

from bench_service.wall_clock import monotonic_s, pause
from tests.service.client import Client


@contextmanager
def process(folder: Path, port: int, **environment: str) -> Generator[tuple[Client, Path]]:
    """The service as a process of its own; its lines are in the file."""
    lines = folder / "lines"
    settings = {"BENCH_DATABASE_URL": f"sqlite:///{folder}/bench.sqlite", "BENCH_PORT": str(port), **environment}
    with lines.open("wb") as sink:
        running = subprocess.Popen(
            [sys.executable, "-m", "bench_service", "serve"], env={**os.environ, **settings}, stderr=sink
        )
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60) as http:
        try:
            deadline = monotonic_s() + 60
            while True:
                try:
                    http.get("/readyz")
                    break
                except httpx.TransportError:
                    assert running.poll() is None, lines.read_text()
                    assert monotonic_s() < deadline
                    pause(0.05)
            yield Client(http), lines
        finally:
            running.terminate()
            running.wait(30)
