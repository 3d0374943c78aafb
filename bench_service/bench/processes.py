"""Identity of processes: distinguishes a process from a later one with the same number."""

import os
import signal
import socket
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

HOST = socket.gethostname()
GONE = frozenset("ZXx")
"""States of a process that has ended but was not yet reaped by its parent."""


@dataclass(frozen=True)
class ProcessIdentity:
    """A process of one host, by number and by its start time as the system gives it."""

    host: str
    pid: int
    started: str

    @classmethod
    def own(cls) -> "ProcessIdentity":
        """Return the identity of the calling process."""
        return cls(HOST, os.getpid(), _started(os.getpid()))

    @property
    def here(self) -> bool:
        """True for a process, living or dead, of this host."""
        return self.host == HOST

    def alive(self) -> bool:
        """Return whether the process is alive; a process of another host cannot be checked, and counts as dead."""
        return self.here and self.started != "" and _started(self.pid) == self.started

    def kill(self) -> bool:
        """Kill the process, as `kill -9` does; False where it was gone, or its number is another process's by now."""
        if not self.alive():
            return False
        try:
            os.kill(self.pid, signal.SIGKILL)
        except ProcessLookupError:
            return False
        return True

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}"


@dataclass(frozen=True)
class Driving:
    """The process that drives, or last drove, a bench from this host."""

    process: ProcessIdentity
    ended: bool = False
    """True where the process ended in an orderly way."""

    @property
    def alive(self) -> bool:
        return not self.ended and self.process.alive()


def living(driving: Driving | None) -> ProcessIdentity | None:
    """Return the process that drives a bench from this host, if it is alive; otherwise None."""
    return driving.process if driving is not None and driving.alive else None


class Watch(Protocol):
    """The processes of one host that drive or supervise a bench, as they register themselves in the bench's lock files.
    Interface.
    """

    def driving(self) -> Driving | None:
        """The process that drives the bench; None where no process of this host ever did."""
        ...

    def supervisor(self) -> ProcessIdentity | None:
        """Return the process that supervises the bench on this host, if one is alive and gives its heartbeat; else
        None.
        """
        ...

    def silent_supervisor(self) -> ProcessIdentity | None:
        """Return the supervisor of this host that is alive and gives no heartbeat: it hangs, or is suspended."""
        ...


def _started(pid: int) -> str:
    """Start time of a living process, as text; empty for one that is gone."""
    if Path("/proc/self/stat").exists():
        try:
            fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
        except OSError:
            return ""
        return "" if fields[0] in GONE else f"{_boot()} {fields[19]}"
    asked = subprocess.run(["ps", "-o", "stat=,lstart=", "-p", str(pid)], capture_output=True, text=True, check=False)
    state, _, began = asked.stdout.strip().partition(" ")
    return "" if not state or state[0] in GONE else began.strip()


def _boot() -> str:
    """Identifier of the machine's current boot: process start times count from it."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return "boot"
