"""Files by which processes of one host know which of them drives and which supervises a bench.

Two small files for each bench, next to the devices' register. Must not know what is driven.
"""

import fcntl
import json
import os
from dataclasses import asdict
from pathlib import Path

from bench_service.bench.heartbeat import SUPERVISOR_SILENT_S, HeartbeatFile
from bench_service.bench.processes import Driving, ProcessIdentity, living
from bench_service.model.errors import BenchBusy


class HostFiles:
    """Files that mark this process as driver or supervisor of a bench on this host. Implements
    `bench_service.bench.processes.Watch`.
    """

    def __init__(self, folder: Path, bench_id: str) -> None:
        self._bench_id = bench_id
        self._driver = folder / f"bench-{bench_id}.driver"
        self._supervisor = folder / f"bench-{bench_id}.supervisor"
        self._heartbeat = HeartbeatFile(folder, bench_id, of_supervisor=True)

    def driving(self) -> Driving | None:
        """Return the process that drives, or last drove, the bench from this host; None where none ever did."""
        try:
            document = json.loads(self._driver.read_text(encoding="utf-8"))
            return Driving(ProcessIdentity(**document["process"]), document["ended"])
        except (OSError, ValueError, TypeError, KeyError):
            return None

    def begin_driving(self) -> None:
        """Write into the file that this process drives the bench. Its lease must be held.

        Raises `BenchBusy` where another living process does: by another database, or one that lost its lease and has
        not noticed. The supervisor watches one process, and would not see the end of the other.
        """
        self._driver.parent.mkdir(parents=True, exist_ok=True)
        other = living(self.driving())
        if other is not None and other != ProcessIdentity.own():
            raise BenchBusy(
                f"bench {self._bench_id!r} is driven from the folder {self._driver.parent.absolute()} by {other}, "
                "though this database has no process that drives it: end that one, or give this one another "
                "BENCH_DEVICE_FOLDER or BENCH_ID"
            )
        self._write(False)

    def end_driving(self) -> None:
        """Write into the file that this process has ended in order. Its lease must still be held."""
        self._write(True)

    def supervisor(self) -> ProcessIdentity | None:
        """Return the process that supervises the bench on this host, if one is alive and not silent."""
        found = self.living_supervisor()
        return None if found is None or self._silent(found) else found

    def silent_supervisor(self) -> ProcessIdentity | None:
        """Return the bench's supervisor on this host, if it is alive and has given no heartbeat for
        `SUPERVISOR_SILENT_S`.
        """
        found = self.living_supervisor()
        return found if found is not None and self._silent(found) else None

    def _silent(self, supervisor: ProcessIdentity) -> bool:
        """Return whether a supervisor is silent; one of an older version, which has no heartbeat, is not."""
        age_s = self._heartbeat.age_s(supervisor)
        return age_s is not None and age_s > SUPERVISOR_SILENT_S

    def living_supervisor(self) -> ProcessIdentity | None:
        """Return the process that has the right to supervise the bench on this host, silent or not, if one is alive."""
        try:
            process = ProcessIdentity(**json.loads(self._supervisor.read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None
        return process if process.alive() else None

    def supervise(self) -> "SupervisorLock":
        """Become the bench's supervisor on this host, and return that right. Raises `BenchBusy` where there is one."""
        self._supervisor.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(self._supervisor, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(file)
            other = self.living_supervisor()
            silent = other is not None and self._silent(other)
            more = ", which gives no heartbeat: it hangs or is suspended; end it (kill -9)" if silent else ""
            raise BenchBusy(f"bench {self._bench_id!r} is supervised by {other or 'another process'}{more}") from None
        os.ftruncate(file, 0)
        os.pwrite(file, json.dumps(asdict(ProcessIdentity.own())).encode(), 0)
        return SupervisorLock(file)

    def _write(self, ended: bool) -> None:
        """Replace the file whole: a reader finds the old one or the new one."""
        document = {"process": asdict(ProcessIdentity.own()), "ended": ended}
        partial = self._driver.with_name(f"{self._driver.name}.part")
        partial.write_text(json.dumps(document), encoding="utf-8")
        partial.replace(self._driver)


class SupervisorLock:
    """The right to be a bench's supervisor, for a process's life: an exclusive lock on a file that holds its
    identity.
    """

    def __init__(self, file: int) -> None:
        self._file: int | None = file

    def release(self) -> None:
        """Empty and unlock the file; a second call does nothing."""
        if self._file is not None:
            os.ftruncate(self._file, 0)
            os.close(self._file)
            self._file = None
