"""A start that fails ends by itself: one sentence, exit code 2, and no process is left."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bench_service.wall_clock import monotonic_s, pause

SOON_S = 30.0
"""For a start that fails in two seconds on an idle machine: the suite's other processes run beside it."""
HANGING = """
import threading
from bench_service.jobs import worker
from bench_service.jobs.engine import Engine
worker.START_S = 1.0
Engine.launch = lambda engine: threading.Event().wait(600)
from bench_service.__main__ import main
main()
"""
"""A program whose engine neither starts nor fails."""


class Started:
    """A command that is run to its end in a folder with a database of its own."""

    def __init__(self, folder: Path, port: int, *command: str) -> None:
        environment = {
            **os.environ,
            "BENCH_DATABASE_URL": f"sqlite:///{folder / 'bench.sqlite'}",
            "BENCH_DEVICE_FOLDER": str(folder),
            "BENCH_PORT": str(port),
        }
        begun_s = monotonic_s()
        done = subprocess.run(
            [sys.executable, *command], env=environment, capture_output=True, text=True, timeout=90, check=False
        )
        self.took_s = monotonic_s() - begun_s
        self.code, self.err = done.returncode, done.stderr


def left(folder: Path) -> list[int]:
    """Processes that were started with this folder, and live."""
    found: list[int] = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            environment = (process / "environ").read_bytes()
        except OSError:
            continue
        if f"BENCH_DEVICE_FOLDER={folder}\0".encode() in environment:
            found.append(int(process.name))
    return found


def check_nothing_left(folder: Path) -> None:
    """A supervisor that had been started sees within a moment that nothing is left to watch."""
    end_s = monotonic_s() + SOON_S
    while left(folder):
        assert monotonic_s() < end_s, left(folder)
        pause(0.05)


@pytest.mark.parametrize("command", ["serve", "worker", "demo --once", "run no_operation --unit SIM-0001"])
def test_an_engine_whose_books_cannot_be_read_ends_the_start(command: str, tmp_path: Path, free_port: int) -> None:
    books = tmp_path / "bench.sqlite.sim.jobs"
    books.write_text("Dear laboratory, " * 500)
    arguments = ("-m", "bench_service", *command.split())
    failed = Started(tmp_path, free_port, *arguments)
    ways = "`bench scrub` lists the damage, `bench restore` restores a copy"
    damage = f"the database is damaged (file is not a database): {ways}"
    sentence = f"the job engine did not start: {damage}"
    assert failed.err == f"bench: {sentence}\n"
    assert failed.code == 2
    assert failed.took_s < SOON_S
    check_nothing_left(tmp_path)
    if command.startswith("run"):
        books.unlink()
        repaired = Started(tmp_path, free_port, *arguments)
        assert repaired.code == 0, repaired.err


def test_an_engine_that_hangs_is_given_up(tmp_path: Path, free_port: int) -> None:
    failed = Started(tmp_path, free_port, "-c", HANGING, "serve")
    assert failed.err == "bench: the job engine did not start within 1 s\n"
    assert failed.code == 2
    assert failed.took_s < SOON_S
    check_nothing_left(tmp_path)
