"""Ctrl-C, or a closed terminal, while a command watches its job: what becomes of the job, and how it goes on."""

import fcntl
import os
import signal
import sqlite3
import subprocess
import sys
import termios
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path

import pytest

from bench_service.cli.processes.ending import ending_like_ctrl_c
from bench_service.drivers.device_register import DeviceRegister
from bench_service.wall_clock import monotonic_s, pause
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.command_line import Command, Done, command_in, environment

pytestmark = pytest.mark.timeout(240)

RUN = ("run", "calibration_12_orientations", "--unit", "SIM-0001", "--set", "settle_s=0.5", "--set")


def stations_done(folder: Path) -> int:
    """Stations that the only job has done, by the database; looking costs no process."""
    with suppress(sqlite3.OperationalError), sqlite3.connect(folder / "bench.sqlite", timeout=5) as database:
        found = database.execute("SELECT stations_done FROM jobs").fetchall()
        return found[0][0] if found else 0
    return 0


def interrupted(folder: Path, *arguments: str, **settings: str) -> Done:
    """A command that gets Ctrl-C once its job has done a station; its end."""
    command = [sys.executable, "-m", "bench_service", *arguments]
    outside = environment(folder, **settings)
    # A shell's background job ignores Ctrl-C, and hands that on; the command here is one in the foreground.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(
        command, env=outside, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as done:
        signal.signal(signal.SIGINT, before)
        until = monotonic_s() + 60
        while stations_done(folder) < 1:
            assert done.poll() is None, done.communicate()
            assert monotonic_s() < until
            pause(0.05)
        done.send_signal(signal.SIGINT)
        out, err = done.communicate(timeout=60)
        return Done(done.returncode, out, err)


def test_a_job_left_with_ctrl_c_is_paused_and_goes_on_only_when_it_is_asked_for(tmp_path: Path) -> None:
    bench: Command = command_in(tmp_path)
    left = interrupted(tmp_path, *RUN, "dwell_s=120.0", BENCH_REAL_TIME_FACTOR="100")
    (job,) = bench("jobs", "--json").json()["items"]
    assert left.code == 130
    assert job["state"] == "paused"
    assert 1 <= job["progress"]["station"] < 12
    assert f"job {job['id']} is paused after {job['progress']['station']} of 12 stations" in left.err
    assert f"bench job resume {job['id']}" in left.err
    assert bench("run", "no_operation", "--unit", "SIM-0001").code == 0, "no other command takes it up: it would wait"
    resumed = bench("job", "resume", job["id"], "--json", BENCH_REAL_TIME_FACTOR="2000")
    assert resumed.code in (0, 1), resumed.err
    assert resumed.json()["job"]["state"] == "succeeded"
    assert resumed.json()["job"]["attempt"] == 2
    assert len(resumed.json()["result"]["lineage"]["recordings"]) == 12


def _at_a_terminal() -> None:
    """Make standard input the controlling terminal; hear its end also where the suite runs under nohup."""
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def test_a_job_whose_terminal_is_closed_is_paused_and_its_bench_safe(tmp_path: Path) -> None:
    """It has no supervisor: a process that the hang-up killed left table and unit as they were until the next start."""
    terminal, its_end = os.openpty()
    os.set_blocking(terminal, False)
    with subprocess.Popen(
        [sys.executable, "-m", "bench_service", *RUN, "dwell_s=120.0"],
        env=environment(tmp_path, BENCH_REAL_TIME_FACTOR="150"),
        cwd=tmp_path,
        stdin=its_end,
        stdout=its_end,
        stderr=its_end,
        start_new_session=True,
        preexec_fn=_at_a_terminal,
    ) as run:
        os.close(its_end)
        until = monotonic_s() + 60
        while stations_done(tmp_path) < 1:
            with suppress(BlockingIOError):
                os.read(terminal, 100_000)
            assert run.poll() is None
            assert monotonic_s() < until
            pause(0.05)
        os.close(terminal)
        assert run.wait(60) == 130
    state = DeviceRegister(tmp_path, "sim").read()
    assert state is not None
    assert (state.unsafe, state.linked) == ((), False)
    with sqlite3.connect(tmp_path / "bench.sqlite") as database:
        assert database.execute("SELECT state FROM jobs").fetchall() == [("paused",)]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_such_a_signal_interrupts_once_and_nothing_interrupts_the_end(number: signal.Signals) -> None:
    before = signal.signal(number, signal.SIG_DFL)  # the suite may run under nohup
    try:
        with ending_like_ctrl_c() as ignore:
            with pytest.raises(KeyboardInterrupt):
                os.kill(os.getpid(), number)
            os.kill(os.getpid(), number)  # as terminal and shell do
        with ending_like_ctrl_c() as ignore:
            ignore()
            os.kill(os.getpid(), number)
        assert signal.getsignal(number) == signal.SIG_DFL
    finally:
        signal.signal(number, before)


def test_a_command_under_nohup_outlives_its_terminal() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ending_like_ctrl_c():
            os.kill(os.getpid(), signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.fixture
def service(tmp_path: Path, free_port: int) -> Generator[BenchProcess]:
    served = BenchProcess(f"sqlite:///{tmp_path / 'bench.sqlite'}", free_port, tmp_path, real_time_factor="100")
    served.start()
    yield served
    served.end()


def test_a_job_of_a_service_goes_on_after_ctrl_c(service: BenchProcess, tmp_path: Path) -> None:
    address = str(service.client.base_url)
    left = interrupted(tmp_path, *RUN, "dwell_s=60.0", "--label", "lot=7", "--server", address)
    (job,) = service.client.get("/api/v1/jobs").json()["items"]
    assert left.code == 130
    assert f"`bench job wait {job['id']} --server {address}`" in left.err
    assert (job["state"], job["pause_requested"], job["labels"]) == ("running", False, {"lot": "7"})
    waited = command_in(tmp_path)("job", "wait", job["id"], "--server", address.removeprefix("http://"), "--json")
    assert waited.json()["job"]["state"] == "succeeded"
    assert waited.code == {"pass": 0, "fail": 1}[waited.json()["job"]["verdict"]]
