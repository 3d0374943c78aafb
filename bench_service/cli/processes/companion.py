"""Companion of a process that drives a bench: a supervisor in a process of its own, restarted while it drives.

A companion that ended is started again, whatever ended it, at a pace that falls while it does not last. One that left
the bench to another supervisor comes back only once the bench has been without supervisor for a while: long enough for
the keeper of that other one to have started it again.

A supervisor that lives and gives no heartbeat, because it hangs or is suspended, watches over nothing, and keeps the
right to supervise. It is killed, whoever started it, before another one is started: so one that is continued later
cannot act beside the new one.
"""

import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from math import inf
from pathlib import Path

from bench_service.bench.heartbeat import SUPERVISOR_KILLED_S, HeartbeatFile, SilenceCounter
from bench_service.bench.processes import ProcessIdentity
from bench_service.cli.processes.supervising import SUPERVISED_ALREADY
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s

LOOK_S = 0.25
"""Interval between checks that the companion is alive [s]."""
AGAIN_S = 1.0
"""Shortest time from one start to the next [s], doubled after each companion that did not last."""
SLOWEST_S = 60.0
"""Longest time from one start to the next [s]; a companion has lasted when it lived for this time."""
UNSUPERVISED_S = 5.0
"""Longest time that a bench left to another supervisor may be without one [s]."""
LEAVE_S = 2.0
"""Time that a process that ends waits for its companion to notice it [s]."""

Process = subprocess.Popen[bytes]
log = logging.getLogger(__name__)


class Companion:
    """Starts a supervisor as a process of its own and restarts it when it ends; that process outlives this one."""

    def __init__(
        self,
        bench_id: str,
        spawn: Callable[[], Process],
        supervisor: Callable[[], ProcessIdentity | None],
        silence: SilenceCounter,
    ) -> None:
        """`spawn` starts a supervisor; `supervisor`: returns the living process that has the right to supervise the
        bench now; `silence` counts for how long it has given no heartbeat.
        """
        self._bench_id = bench_id
        self._spawn = spawn
        self._supervisor = supervisor
        self._silence = silence
        self._logged: ProcessIdentity | None = None
        """The last silent supervisor that was logged."""
        self._process: Process | None = None
        self._started_s = -inf
        self._due_s = -inf
        self._pause_s = AGAIN_S

    def look(self, now_s: float) -> None:
        """Check once whether the companion has ended, or whichever supervisor there is is silent, and start it if that
        is due.
        """
        supervisor = self._supervisor()
        if self._silence.silent_s(supervisor, now_s) > SUPERVISOR_KILLED_S and supervisor is not None:
            self._end_silent(supervisor)
        if self._process is not None:
            code = self._process.poll()
            if code is None:
                return
            self._process = None
            self._ended(code, now_s)
        if self._started_s > -inf and supervisor is not None:
            self._due_s = max(self._due_s, now_s + UNSUPERVISED_S)
        elif now_s >= self._due_s:
            self._start(now_s)

    def leave(self) -> None:
        """Wait a moment for the companion's end; if it still has work to do, it continues alone."""
        if self._process is None:
            return
        try:
            self._process.wait(LEAVE_S)
        except subprocess.TimeoutExpired:
            self._process.returncode = 0  # no one waits for the process any more

    def _end_silent(self, supervisor: ProcessIdentity) -> None:
        """Kill a supervisor without a heartbeat: its right to supervise ends with it. It is logged once, though a
        process that waits in the kernel ends late.
        """
        try:
            if not supervisor.kill():
                return
            level, outcome = logging.WARNING, "killed, and another one is started"
        except PermissionError:
            level = logging.ERROR
            outcome = "it belongs to another user: nobody watches over the bench until it is ended (kill -9)"
        if supervisor != self._logged:
            log.log(
                level,
                "the supervisor of bench %s, %s, gave no heartbeat for %g s: %s",
                self._bench_id,
                supervisor,
                SUPERVISOR_KILLED_S,
                outcome,
            )
        self._logged = supervisor

    def _start(self, now_s: float) -> None:
        self._started_s = now_s
        try:
            self._process = self._spawn()
        except OSError as error:
            self._again(f"cannot be started: {error}", now_s)

    def _ended(self, code: int, now_s: float) -> None:
        if code == SUPERVISED_ALREADY:
            log.info("bench %s has another supervisor", self._bench_id)
            self._due_s, self._pause_s = now_s + UNSUPERVISED_S, AGAIN_S
            return
        if now_s - self._started_s >= SLOWEST_S:
            self._pause_s = AGAIN_S
        self._again(f"was ended by signal {-code}" if code < 0 else f"ended with exit code {code}", now_s)

    def _again(self, what: str, now_s: float) -> None:
        self._due_s = max(now_s, self._started_s + self._pause_s)
        when = "now" if self._due_s == now_s else f"in {self._due_s - now_s:.0f} s"
        log.warning("the supervisor of bench %s %s: started again %s", self._bench_id, what, when)
        self._pause_s = min(2.0 * self._pause_s, SLOWEST_S)


@contextmanager
def accompanied(settings: Settings, driving: Callable[[], bool]) -> Generator[None]:
    """Run the block with a supervisor process next to this one; it outlives the block if it must.

    `driving`: returns whether this process drives the bench now: not before it has started, not while it ends.
    """
    over = threading.Event()
    files = HostFiles(settings.devices_in(), settings.bench_id)
    silence = SilenceCounter(HeartbeatFile(settings.devices_in(), settings.bench_id, of_supervisor=True))
    companion = Companion(settings.bench_id, lambda: _spawn(settings), files.living_supervisor, silence)

    def keep() -> None:
        while not over.wait(LOOK_S):
            if driving():
                companion.look(monotonic_s())

    thread = threading.Thread(target=keep, name="companion", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        companion.leave()


def _spawn(settings: Settings) -> Process:
    folder = settings.devices_in()
    folder.mkdir(parents=True, exist_ok=True)
    environment = {
        **os.environ,
        "BENCH_DATABASE_URL": settings.database_url,
        "BENCH_ID": settings.bench_id,
        "BENCH_DEVICE_FOLDER": str(folder),
        "BENCH_LOG_FILE": str(log_of(settings)),
        **({} if settings.bench_file is None else {"BENCH_FILE": str(settings.bench_file)}),
    }
    with output_of(settings).open("wb") as output:  # what is no line of its log: the end of one that did not start
        return subprocess.Popen(
            [sys.executable, "-m", "bench_service", "supervise", "--companion"],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            start_new_session=True,
        )


def log_of(settings: Settings) -> Path:
    """Return the path of the companion's log file."""
    return settings.devices_in() / f"bench-{settings.bench_id}.supervisor.log"


def output_of(settings: Settings) -> Path:
    """Return the path of the file with what the latest companion printed."""
    return settings.devices_in() / f"bench-{settings.bench_id}.supervisor.out"
