"""The heartbeat of the process that drives a bench, in the bench's device folder.

One preallocated record, written in place: it needs neither a database nor a free byte. Its reader counts, on its
own clock, how long it has not changed, so no clock of the other process matters.
"""

import os
from contextlib import suppress
from pathlib import Path

from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.records_in_place import Unreadable, encoded, preallocate, read_record, write_record

BEAT_S = 0.5
"""Interval between two heartbeats of a process that drives a bench [s, real time]."""


class HeartbeatFile:
    """The heartbeat file of one bench on its host: a counter that the driving process raises every 0.5 s, and that the
    supervisor reads.
    """

    def __init__(self, folder: Path, bench_id: str) -> None:
        self._path = folder / f"bench-{bench_id}.heartbeat"
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
        record = encoded({"pid": self._own.pid, "started": self._own.started, "count": self._count})
        assert record is not None, "three short fields"
        if self._file is None:
            self._file = os.open(self._path, os.O_RDWR | os.O_CLOEXEC)
        write_record(self._file, 0, record)

    def last(self, process: ProcessIdentity) -> int:
        """Return the number of a process's last heartbeat; 0 where it has written none or the file cannot be read.
        Raises nothing.
        """
        with suppress(OSError, Unreadable):
            file = os.open(self._path, os.O_RDONLY | os.O_CLOEXEC)
            try:
                found = read_record(file)
            finally:
                os.close(file)
            if found is not None and (found["pid"], found["started"]) == (process.pid, process.started):
                return int(found["count"])
        return 0

    def close(self) -> None:
        """Close the heartbeat file; the next heartbeat opens it again."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
