"""The heartbeats of the process that drives a bench and of its supervisor, in the bench's device folder.

One preallocated record each, written in place: it needs neither a database nor a free byte. Whoever kills for a missing
heartbeat counts, on its own clock, how long it has not changed, so no clock of the other process matters.
"""

import logging
import os
from collections.abc import Callable
from contextlib import suppress
from math import inf
from pathlib import Path
from threading import Event, Thread
from typing import Any

from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.records_in_place import Unreadable, encoded, preallocate, read_record, write_record
from bench_service.wall_clock import monotonic_s

BEAT_S = 0.5
"""Interval between two heartbeats of a process [s, real time]."""
SUPERVISOR_SILENT_S = 5.0
"""Time without a heartbeat after which a supervisor counts as silent, which people are shown [s]."""
SUPERVISOR_KILLED_S = 10.0
"""Time without a heartbeat after which the process that drives the bench kills a supervisor and starts another [s]."""
COUNTED_S = 0.5
"""Maximum part of the time between two looks that counts as silence [s]: this process may have been held up itself."""

log = logging.getLogger(__name__)


class HeartbeatFile:
    """The heartbeat file of one bench on its host: a counter that the driving process raises every 0.5 s, and that the
    supervisor reads; `of_supervisor`: the one that the supervisor raises, and that worker and API read.
    """

    def __init__(self, folder: Path, bench_id: str, of_supervisor: bool = False) -> None:
        self._path = folder / f"bench-{bench_id}.{'supervisor-heartbeat' if of_supervisor else 'heartbeat'}"
        self._own = ProcessIdentity.own()
        self._file: int | None = None
        self._count = 0

    def prepare(self) -> None:
        """Make the file with its full length, so that later writes need no free disk. Raises `OSError` where there is
        no room.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            preallocate(file, 1)
        finally:
            os.close(file)

    def beat(self) -> None:
        """Write the next heartbeat of this process into the file: its process id, its start time, a count. Raises
        `OSError`.
        """
        self._count += 1
        record = encoded(
            {"pid": self._own.pid, "started": self._own.started, "count": self._count, "at_s": monotonic_s()}
        )
        assert record is not None, "four short fields"
        if self._file is None:
            self._file = os.open(self._path, os.O_RDWR | os.O_CLOEXEC)
        write_record(self._file, 0, record)

    def last(self, process: ProcessIdentity) -> int:
        """Return the number of a process's last heartbeat; 0 where it has written none or the file cannot be read.
        Raises nothing.
        """
        return int(self._record(process).get("count", 0))

    def age_s(self, process: ProcessIdentity) -> float | None:
        """Return the time since a process's last heartbeat [s], by the monotonic clock that the processes of a host
        share; None where it has written none, or none with its time. Raises nothing.
        """
        at_s = self._record(process).get("at_s")
        return None if at_s is None else max(monotonic_s() - float(at_s), 0.0)

    def _record(self, process: ProcessIdentity) -> dict[str, Any]:
        """The last heartbeat of a process; empty where it has written none."""
        with suppress(OSError, Unreadable):
            file = os.open(self._path, os.O_RDONLY | os.O_CLOEXEC)
            try:
                found = read_record(file)
            finally:
                os.close(file)
            if found is not None and (found["pid"], found["started"]) == (process.pid, process.started):
                return found
        return {}

    def close(self) -> None:
        """Close the heartbeat file; the next heartbeat opens it again."""
        if self._file is not None:
            os.close(self._file)
            self._file = None


class Heartbeat:
    """A thread that writes the heartbeat of this process while its work goes on; a suspended process writes none."""

    def __init__(self, file: HeartbeatFile, goes_on: Callable[[], bool]) -> None:
        """Set up with `goes_on`: returns whether the work of the process is not stuck; without it no heartbeat is
        written.
        """
        self._file = file
        self._goes_on = goes_on
        self._ending = Event()
        self._thread = Thread(target=self._run, name="heartbeat", daemon=True)

    def begin(self) -> None:
        """Write the first heartbeat, and start the thread. Where there is no room for one, none is ever written."""
        try:
            self._file.prepare()
            self._file.beat()
        except OSError as error:
            log.warning("the heartbeat of this process cannot be written: %s", error)
            return
        self._thread.start()

    def end(self) -> None:
        """Stop the thread, and close the file."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()
        self._file.close()

    def _run(self) -> None:
        while not self._ending.wait(BEAT_S):
            if self._goes_on():
                with suppress(OSError):  # no descriptor left, for one: the next one is tried
                    self._file.beat()


class SilenceCounter:
    """Counts look by look, on this process's own clock, for how long another process has given no heartbeat."""

    def __init__(self, file: HeartbeatFile) -> None:
        self._file = file
        self._process: ProcessIdentity | None = None
        self._count = 0
        self._looked_s = inf
        self._silent_s = 0.0

    def silent_s(self, process: ProcessIdentity | None, now_s: float) -> float:
        """Return the time for which a process has been silent [s], by the looks so far; 0 where it is None, or has
        never given a heartbeat.
        """
        passed_s = min(max(now_s - self._looked_s, 0.0), COUNTED_S)
        self._looked_s = now_s
        count = 0 if process is None else self._file.last(process)
        silent = process == self._process and count == self._count and count > 0
        self._process, self._count = process, count
        self._silent_s = self._silent_s + passed_s if silent else 0.0
        return self._silent_s
