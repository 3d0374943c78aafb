"""A service with one account for tests of pages, made on its host as a laboratory makes it."""

import os
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from bench_service.wall_clock import monotonic_s, pause
from tests.browser.conftest import process
from tests.end_to_end.bench_process import BenchProcess

NAME, PASSWORD = "ada", "a long and quiet password 7"


@contextmanager
def with_account(folder: Path) -> Generator[BenchProcess]:
    """A service whose log-in is on, with an admin."""
    made = process(folder)
    made.start()
    command = [sys.executable, "-m", "bench_service", "user", "add", NAME, "--role", "admin", "--password-file", "-"]
    subprocess.run(
        command, input=f"{PASSWORD}\n", text=True, check=True, env={**os.environ, **made.environment}, timeout=60
    )
    deadline = monotonic_s() + 20.0
    while made.client.get("/start").status_code != 303:  # the service looks for new accounts once a second
        assert monotonic_s() < deadline
        pause(0.05)
    yield made
    made.end()
