"""A stop with real processes: `bench stop`, what books that come late say, a start on a full disk, analyses apart.

The whole matrix of hindrances and ways is in `tests.chaos.stop_matrix`; three of its cells are here.
"""

import html
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import psutil
import pytest

from bench_service.bench.stop.channel import StopChannel
from bench_service.wall_clock import pause
from tests.chaos.stop_hindrances import NotHere, recording_of
from tests.chaos.stop_matrix import MATRIX, press
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.abandoned_bench import abandoned


@pytest.mark.parametrize(
    ("name", "way"), [("locked SQLite", "API"), ("2000 idle sockets", "page"), ("worker stopped (SIGSTOP)", "command")]
)
def test_a_stop_gets_through(name: str, way: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Beside another test on a loaded machine: the limits here are wider than those of the matrix."""
    try:
        outcome = press(name, way, tmp_path / "run")
    except NotHere as why:
        pytest.skip(str(why))
    with capsys.disabled():
        print(f"\n{outcome}")
    assert outcome.safe_s is not None
    assert outcome.safe_s < MATRIX[name].limit_s + 3.0
    assert outcome.killed is (name == "worker stopped (SIGSTOP)")


def stop_command(folder: Path, *arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "BENCH_DEVICE_FOLDER": str(folder), **more}
    command = [sys.executable, "-m", "bench_service", "stop", *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)


def test_the_command_makes_a_bench_safe_by_itself_where_nobody_else_is_there(tmp_path: Path) -> None:
    register = abandoned(tmp_path, "job-1")
    said = stop_command(tmp_path, "--reason", "smoke", BENCH_NO_SUCH_SETTING="1")
    assert said.returncode == 0, said
    assert "was made safe from here" in said.stdout
    state = register.read()
    assert state is not None
    assert state.safe
    (word,) = StopChannel(tmp_path, "sim").standing()
    assert (word.reason, word.via, word.booked) == ("smoke", "command", False)


def test_the_command_does_not_pretend(tmp_path: Path) -> None:
    register = abandoned(tmp_path)
    link = register.open(by="process 4712 on bench-host")
    held = stop_command(tmp_path, "--wait", "2")
    assert held.returncode == 1, held
    assert "is NOT safe" in held.stdout
    assert "hardware emergency stop" in held.stdout
    link.close()
    nowhere = stop_command(tmp_path / "elsewhere")
    assert nowhere.returncode == 2
    assert "run this on the bench's host" in nowhere.stdout
    assert stop_command(tmp_path, "--bench", "../sim").returncode == 2


def test_the_command_loads_neither_database_nor_numerics() -> None:
    code = (
        "import sys; from bench_service.cli.processes.stopping import stop_command; "
        "print([name for name in ('numpy', 'sqlalchemy', 'pydantic', 'typer', 'fastapi') if name in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.fixture
def bench(sqlite_url: str, tmp_path: Path, free_port: int) -> Generator[BenchProcess]:
    made = BenchProcess(sqlite_url, free_port, tmp_path, real_time_factor="5")
    made.start()
    yield made
    made.end()


def late_entries(bench: BenchProcess) -> list[dict[str, Any]]:
    """Entries of the audit trail about stops that the database took late."""
    trail = bench.client.get("/api/v1/audit").json()["items"]
    return [entry for entry in trail if (entry["action"], entry["outcome"]) == ("stop", "noted")]


def test_the_books_follow_a_stop_that_came_without_them_and_say_that_they_were_late(bench: BenchProcess) -> None:
    bench.supervised()
    job = bench.submit(seed=7)
    bench.until(lambda: bench.moving(job), 60)
    with sqlite3.connect(bench.environment["BENCH_DATABASE_URL"].partition(":///")[2], timeout=30) as other:
        other.isolation_level = None
        other.execute("BEGIN IMMEDIATE")
        answer = bench.client.post("/api/v1/benches/sim/stop", json={"reason": "smoke", "by": "Olena"})
        assert answer.status_code == 202, answer.text
        assert answer.json()["books"]
        bench.until(lambda: bench.state().safe, 20)  # the answer waits 1 s; the lock is held until after this
        said = stop_command(bench.register.path.parent, "--reason", "hands in the chamber")
        assert said.returncode == 0, said
        bench.until(lambda: (StopChannel(bench.register.path.parent, "sim").standing()[0].by) == "Olena", 20)
        pause(2.5)
        other.execute("ROLLBACK")
    other.close()
    bench.until(lambda: len(bench.client.get("/api/v1/benches/sim").json()["stops"]) == 2, 40)
    stops = bench.client.get("/api/v1/benches/sim").json()["stops"]
    assert [stop["reason"] for stop in stops] == ["smoke", "hands in the chamber"]
    assert stops[0]["id"] == answer.json()["stop"]
    bench.until(lambda: len(late_entries(bench)) == 2, 20)  # each follows its stop in a transaction of its own
    assert all(entry["detail"]["late_s"] > 2.0 for entry in late_entries(bench))
    bench.until(lambda: bench.job(job)["state"] == "cancelled", 60)
    for stop in stops:
        release = {"by": "Ivan", "remark": "looked at"}
        answer = bench.client.post(f"/api/v1/benches/sim/stops/{stop['id']}/release", json=release)
        assert answer.status_code == 200, answer.text
    assert StopChannel(bench.register.path.parent, "sim").standing() == ()
    next_job = bench.submit(seed=7)
    bench.until(lambda: bench.job(next_job)["state"] == "running", 30)


def test_a_start_on_a_full_disk_makes_the_bench_safe_before_anything_else(small_disk: Path, free_port: int) -> None:
    made = BenchProcess(f"sqlite:///{small_disk / 'bench.sqlite'}", free_port, small_disk, real_time_factor="5")
    made.log = small_disk.parent / "service.log"
    made.start()
    made.supervised()
    job = made.submit(seed=7)
    made.until(lambda: made.moving(job), 60)
    supervisor = made.files.supervisor()
    assert supervisor is not None
    os.kill(supervisor.pid, signal.SIGKILL)
    made.kill()
    with (small_disk / "ballast").open("ab", buffering=0) as file:
        file.write(b"\0" * shutil.disk_usage(small_disk).free)
    assert not made.state().safe
    with made.log.open("ab") as log:
        process = subprocess.Popen(made.command, env=made.environment, stdout=log, stderr=log)
    try:
        made.until(lambda: made.state().safe, 30)
    finally:
        made.client.close()
        process.terminate()
        process.wait(30)
        left = made.files.supervisor()
        if left is not None:
            os.kill(left.pid, signal.SIGTERM)


def test_analyses_and_plots_are_made_in_other_processes_which_end_with_a_killed_service(bench: BenchProcess) -> None:
    body = {"method": "noise_analysis", "recordings": [recording_of(bench.client)], "parameters": {}}
    answer = bench.client.post("/api/v1/analyses", json=body, timeout=100)  # a process has to be begun for it
    assert answer.status_code == 201, answer.text
    page = bench.client.get(f"/results/{answer.json()['id']}").text
    image = re.search(r'"(/results/[^"]+\.svg\?[^"]+)"', page)
    assert image is not None
    drawn = bench.client.get(html.unescape(image[1]))
    assert drawn.status_code == 200
    assert drawn.text.startswith("<svg")
    children = psutil.Process(bench.process.pid).children(recursive=True)
    workers = [child for child in children if "spawn_main" in " ".join(child.cmdline())]
    assert len(workers) >= 2, [child.cmdline() for child in children]
    assert "is drawn in this process" not in bench.log.read_text()
    refused = bench.client.post("/api/v1/analyses", json={**body, "recordings": ["no such recording"]})
    assert (refused.status_code, refused.json()["type"]) == (404, "/problems/NotFound")
    bench.kill()
    bench.until(lambda: not any(child.is_running() and child.status() != "zombie" for child in workers), 10)
    bench.start()
