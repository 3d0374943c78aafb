"""The service's processes as one sees them who kills them: started, struck down, started again, each death noted."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from uuid import uuid4

import psutil

ROOT = Path(__file__).parents[2]
MARK = "CHAOS_RUN"
"""In the environment of every process of a run: so that each is found and ended, whatever became of its parent."""
GONE_S = 30.0
"""How long a killed process may take to be gone [s]: a loaded machine, a core in the middle of an fsync."""


@dataclass(frozen=True)
class Death:
    """The end of a process: when it was told, when it was seen to be gone [s, Unix time]."""

    name: str
    pid: int
    told: float
    gone: float
    how: str

    @property
    def earliest(self) -> float:
        """When it may have been gone: told to end in order, it first gives back what it has."""
        return self.told if self.how == signal.SIGKILL.name else self.gone


@dataclass
class Ledger:
    """Processes that were started and that died in a run."""

    run: str = field(default_factory=lambda: uuid4().hex)
    births: dict[int, tuple[str, float]] = field(default_factory=dict)
    deaths: list[Death] = field(default_factory=list)
    falls: list[str] = field(default_factory=list)
    """Processes that ended though nobody struck them: what they said last."""

    def of(self, pid: int) -> Death | None:
        """The last death of a process number."""
        return next((death for death in reversed(self.deaths) if death.pid == pid), None)


def living(pid: int) -> bool:
    """Whether a process runs; one that only waits to be noticed by its parent does not."""
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def strike(ledger: Ledger, name: str, pid: int, how: signal.Signals = signal.SIGKILL) -> bool:
    """Send a signal and wait until the process is gone; False where it was gone before."""
    if not living(pid):
        return False
    told = time.time()
    try:
        os.kill(pid, how)
    except ProcessLookupError:
        return False
    deadline = time.monotonic() + GONE_S
    while living(pid):
        assert time.monotonic() < deadline, f"{name}, process {pid}, is not gone {GONE_S:g} s after {how.name}"
        time.sleep(0.002)
    ledger.deaths.append(Death(name, pid, told, time.time(), how.name))
    return True


def end_all(ledger: Ledger) -> None:
    """Kill whatever still lives of a run, known by its mark."""
    for process in psutil.process_iter(["pid"]):
        try:
            if process.environ().get(MARK) == ledger.run and process.pid != os.getpid():
                process.kill()
        except psutil.Error:
            continue


class Program:
    """A command of ours that is started again after each death."""

    def __init__(self, ledger: Ledger, name: str, arguments: list[str], folder: Path, settings: dict[str, str]) -> None:
        outer = {key: value for key, value in os.environ.items() if not key.startswith("BENCH_")}
        self.name = name
        self.log = folder / f"{name}.log"
        self._ledger = ledger
        self._folder = folder
        self._command = [sys.executable, "-m", "bench_service", *arguments]
        self._environment = {**outer, **settings, "PYTHONPATH": str(ROOT), MARK: ledger.run}
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """Id of the process that was started last; 0 before the first."""
        return 0 if self._process is None else self._process.pid

    @property
    def runs(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Start, where it does not run."""
        if self.runs:
            return
        if self._process is not None and self._ledger.of(self.pid) is None:
            last = self.log.read_text(errors="replace").strip().splitlines()[-1:] or ["(nothing)"]
            self._ledger.falls.append(f"{self.name} ended with {self._process.returncode}: {last[0][:200]}")
        with self.log.open("ab") as log:
            self._process = subprocess.Popen(
                self._command, env=self._environment, cwd=self._folder, stdout=log, stderr=log, start_new_session=True
            )
        self._ledger.births[self.pid] = (self.name, time.time())

    def reap(self) -> None:
        """Take note of the end of a process that was killed."""
        if self._process is not None:
            self._process.wait(GONE_S)

    def strike(self, how: signal.Signals = signal.SIGKILL) -> bool:
        """See `strike`; the process is noticed as gone by us, its parent."""
        done = self.pid > 0 and strike(self._ledger, self.name, self.pid, how)
        if self._process is not None:
            self._process.poll()
        return done


class Topology:
    """Which processes there are: on SQLite one that does everything, on Postgres two of HTTP and one a bench."""

    def __init__(self, ledger: Ledger, folder: Path, database_url: str, settings: dict[str, str]) -> None:
        self.ledger = ledger
        self.folder = folder
        self.database_url = database_url
        given = {"BENCH_DATABASE_URL": database_url, "BENCH_DEVICE_FOLDER": str(folder), **settings}

        def program(name: str, *arguments: str, **more: str) -> Program:
            return Program(ledger, name, list(arguments), folder, {**given, **more})

        if database_url.startswith("sqlite"):
            self.benches = ("sim",)
            self.ports = (free_port(),)
            self.apis = (program("serve", "serve", "--port", str(self.ports[0])),)
            self.workers = {"sim": self.apis[0]}
        else:
            self.benches = ("east", "west")
            self.ports = (free_port(), free_port())
            self.apis = tuple(
                program(f"api-{number}", "serve", "--no-worker", "--port", str(port))
                for number, port in enumerate(self.ports)
            )
            self.workers = {bench: program(f"worker-{bench}", "worker", "--bench", bench) for bench in self.benches}
        self._supervisors = {
            bench: program(f"supervisor-{bench}", "supervise", "--companion", "--bench", bench)
            for bench in self.benches
        }

    def start(self) -> None:
        """Start whatever does not run. Supervisors are started by the workers."""
        for program in (*self.apis, *self.workers.values()):
            program.start()

    def supervisor(self, bench: str) -> int:
        """The number of the process that supervises a bench, as its file says; 0 where none lives."""
        try:
            pid = json.loads((self.folder / f"bench-{bench}.supervisor").read_text())["pid"]
        except (OSError, ValueError, KeyError):
            return 0
        return pid if living(pid) else 0

    def strike_supervisor(self, bench: str) -> bool:
        pid = self.supervisor(bench)
        return pid > 0 and strike(self.ledger, f"supervisor-{bench}", pid)

    def supervise(self, bench: str) -> None:
        """Start a supervisor, as a service manager would after its death."""
        self._supervisors[bench].start()

    def drives(self, bench: str) -> bool:
        """Whether the worker that was started last has taken its bench."""
        try:
            document = json.loads((self.folder / f"bench-{bench}.driver").read_text())
        except (OSError, ValueError):
            return False
        return not document["ended"] and document["process"]["pid"] == self.workers[bench].pid

    def end_at_once(self) -> None:
        """Kill whatever is left, also of processes that ours started."""
        end_all(self.ledger)
        for program in (*self.apis, *self.workers.values(), *self._supervisors.values()):
            program.reap()

    def end_in_order(self) -> None:
        """SIGTERM to all, as a machine that is shut down does."""
        for program in (*self.workers.values(), *self.apis):
            program.strike(signal.SIGTERM)
        end = time.monotonic() + GONE_S
        while any(self.supervisor(bench) for bench in self.benches) and time.monotonic() < end:
            time.sleep(0.02)


def free_port() -> int:
    """A loopback port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
