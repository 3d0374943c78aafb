"""Who a process is, so that it can be told from a later one with the same number."""

import os
import signal
import socket
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

HOST = socket.gethostname()
GONE = frozenset("ZXx")
"""States of a process that has ended, and only waits for its parent to notice."""


@dataclass(frozen=True)
class ProcessIdentity:
    """A process of one host, by number and the moment of its start in the system's own words."""

    host: str
    pid: int
    started: str

    @classmethod
    def own(cls) -> "ProcessIdentity":
        """The process that asks."""
        return cls(HOST, os.getpid(), _started(os.getpid()))

    @property
    def here(self) -> bool:
        """Whether it is, or was, a process of this host."""
        return self.host == HOST

    def alive(self) -> bool:
        """Whether it lives; of a process on another host nobody here can say, it counts as dead."""
        return self.here and self.started != "" and _started(self.pid) == self.started

    def kill(self) -> bool:
        """End it at once, as `kill -9` does; False where it was gone, or its number is another process's by now."""
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
    """Which process drives, or last drove, a bench from this host."""

    process: ProcessIdentity
    ended: bool = False
    """Whether it ended in order."""

    @property
    def alive(self) -> bool:
        return not self.ended and self.process.alive()


class Watch(Protocol):
    """What processes of one host tell one another about a bench."""

    def driving(self) -> Driving | None:
        """Which process drives the bench; None where none of this host ever did."""
        ...

    def supervisor(self) -> ProcessIdentity | None:
        """The process that supervises the bench on this host, if one lives."""
        ...


def _started(pid: int) -> str:
    """When a living process began; empty for one that is gone."""
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
    """Which start of the machine this is: ticks are counted from it."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return "boot"
