"""A service with one account, for the tests of pages in a browser."""

import os
import subprocess
import sys
from collections.abc import Callable, Generator

import pytest

from bench_service.wall_clock import monotonic_s, pause
from tests.browser.conftest import process
from tests.end_to_end.bench_process import BenchProcess

PASSWORD = "a long and quiet password 7"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Generator[BenchProcess]:
    """A service with one account, made on its host."""
    made = process(tmp_path_factory.mktemp("accounts"))
    made.start()
    command = [sys.executable, "-m", "bench_service", "user", "add", "ada", "--role", "admin", "--password-file", "-"]
    subprocess.run(
        command, input=f"{PASSWORD}\n", text=True, check=True, env={**os.environ, **made.environment}, timeout=60
    )
    until(lambda: made.client.get("/start").status_code == 303)  # the service looks for new accounts once a second
    yield made
    made.end()


def until(true: Callable[[], bool]) -> None:
    deadline = monotonic_s() + 20.0
    while not true():
        assert monotonic_s() < deadline
        pause(0.05)
