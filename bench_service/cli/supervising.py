"""``bench supervise``, and the companion that a driving process starts. Imports no engine, no simulator, no numerics.

It has a composition of its own, because that of the service loads what a supervisor must do without.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from types import FrameType

from bench_service.cli.logs import set_up
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredDevices
from bench_service.jobs.errors import BenchBusy
from bench_service.jobs.supervisor import Supervisor
from bench_service.persistence import acquire_lease
from bench_service.persistence.host_files import HostFiles, SupervisorLock
from bench_service.persistence.lease import SUPERVISOR
from bench_service.persistence.safety_books import SqlSafetyBooks
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause

TAKE_OVER_S = 2.0
"""How long a companion tries to become the supervisor [s]: one that is about to leave has left by then."""
LEAVE_S = 2.0
"""How long a process that ends waits for its companion to see it [s]."""


def supervise(settings: Settings, companion: bool, say: Callable[[str], object]) -> None:
    """Supervise the settings' bench until SIGTERM or SIGINT. Raises `BenchBusy` where it is supervised already.

    A companion then leaves it at that: one supervisor looks after every process that drives the bench.
    """
    set_up(settings, "info")
    ending = threading.Event()

    def end(_signal: int, _frame: FrameType | None) -> None:
        ending.set()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    folder, bench = settings.devices_in(), settings.bench_id
    files = HostFiles(folder, bench)
    with ExitStack() as closing:
        try:
            closing.callback(_lock(files, TAKE_OVER_S if companion else 0.0).release)
        except BenchBusy:
            if companion:
                return
            raise
        books = SqlSafetyBooks(settings.database_url, bench)
        closing.callback(books.close)
        take_lease = partial(acquire_lease, settings.database_url, bench, SUPERVISOR)
        devices = RegisteredDevices(DeviceRegister(folder, bench))
        say(f"supervising bench {bench}")
        Supervisor(bench, devices, files, books, take_lease).run(ending, companion)


@contextmanager
def accompanied(settings: Settings, started: Callable[[], bool]) -> Generator[None]:
    """A supervisor in a process of its own, begun once `started` says so, that outlives the block if it must."""
    over = threading.Event()
    made: list[subprocess.Popen[bytes]] = []

    def begin() -> None:
        while not started():
            if over.wait(0.05):
                return
        made.append(_spawn(settings))

    thread = threading.Thread(target=begin, name="companion", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        for process in made:
            try:
                process.wait(LEAVE_S)
            except subprocess.TimeoutExpired:
                process.returncode = 0  # it has work left and goes on alone


def _spawn(settings: Settings) -> subprocess.Popen[bytes]:
    folder = settings.devices_in()
    folder.mkdir(parents=True, exist_ok=True)
    environment = {
        **os.environ,
        "BENCH_DATABASE_URL": settings.database_url,
        "BENCH_ID": settings.bench_id,
        "BENCH_DEVICE_FOLDER": str(folder),
    }
    with log_of(settings).open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "bench_service", "supervise", "--companion"],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )


def _lock(files: HostFiles, patience_s: float) -> SupervisorLock:
    deadline = monotonic_s() + patience_s
    while True:
        try:
            return files.supervise()
        except BenchBusy:
            if monotonic_s() > deadline:
                raise
        pause(0.1)


def log_of(settings: Settings) -> Path:
    """Where the companion writes what it has to say."""
    return settings.devices_in() / f"bench-{settings.bench_id}.supervisor.log"
