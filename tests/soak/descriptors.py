"""Open descriptors of a process by what they are: files by name, sockets by the port at their other end."""

import os
import socket
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from numpy.typing import NDArray

from tests.soak.slope import slope

Values = NDArray[np.float64]
POOLED = 15
"""Largest number of connections to one file: SQLAlchemy's pool keeps five and lends ten more."""
LEAK_PER_MIN = 0.05
"""Rise of the least number that counts as a leak, with 97.5 % confidence [1/min]: three an hour."""


def descriptors_of(process: psutil.Process, names: Mapping[int, str]) -> Counter[str]:
    """Number of open descriptors by kind. `names`: ports by what is there; other ports are "another port".

    A socket counts as "from" a port where it is this process's own port that is known, and as "to" it where the peer's
    is. One that is closed while it is looked at is left out.
    """
    sockets = {c.fd: _socket(c, names) for c in _connections(process)}
    found: Counter[str] = Counter()
    for entry in _entries(process.pid):
        try:
            target = os.readlink(entry)
        except OSError:
            continue
        number = int(entry.name)
        if target.startswith("/"):
            found[Path(target).name] += 1
        elif target.startswith("socket:"):
            found[sockets.get(number, "socket, neither TCP nor UDP")] += 1
        else:
            found[target.split(":")[0] if not target.startswith("anon_inode") else target] += 1
    return found


def changed(before: Counter[str], after: Counter[str]) -> str:
    """Kinds whose number differs, with how much."""
    kinds = sorted({*before, *after}, key=lambda kind: (before[kind] - after[kind], kind))
    return ", ".join(f"{after[kind] - before[kind]:+d} {kind}" for kind in kinds if after[kind] != before[kind])


def _entries(process_id: int) -> Iterable[Path]:
    try:
        return tuple(Path(f"/proc/{process_id}/fd").iterdir())
    except OSError:
        return ()


def _connections(process: psutil.Process) -> Iterable[Any]:
    try:
        return process.net_connections("inet")
    except psutil.Error:
        return ()


def _socket(connection: Any, names: Mapping[int, str]) -> str:
    if connection.type != socket.SOCK_STREAM:
        return "datagram socket"
    if not connection.raddr:
        return "listening socket" if connection.status == psutil.CONN_LISTEN else f"TCP socket, {connection.status}"
    if (name := names.get(connection.laddr.port)) is not None:
        return f"TCP from {name}"
    return f"TCP to {names.get(connection.raddr.port, 'another port')}"


class Descriptors:
    """Descriptors of a process over a run, and whether it keeps ever more of them.

    Two parts are judged apart. Connections of a database come with those who ask at the same time: a pool keeps five
    and lends ten more, so their number may reach a level late and is held to that of the pool. All others come and go
    with jobs, lines and the event loops of those who ask devices; what leaks is never given back, so the *least* number
    of each minute rises. Its slope is judged with its interval, after a quarter of the run. Looks between two jobs show
    it best.
    """

    def __init__(self) -> None:
        self.minutes: list[float] = []
        self.kinds: list[Counter[str]] = []

    def take(self, minutes: float, kinds: Counter[str]) -> None:
        """Add a look."""
        self.minutes.append(minutes)
        self.kinds.append(kinds)

    def judged(self, minutes: float) -> list[str]:
        """Print the figures of a run of some minutes; a sentence for what grows."""
        databases = np.array([_of_databases(kinds) for kinds in self.kinds])
        others = np.array([kinds.total() for kinds in self.kinds]) - databases
        for name, numbers in (("of databases", databases), ("others", others)):
            quarters = np.array_split(numbers, 4)
            print(f"descriptors, {name}: {', '.join(f'{q.min()}-{q.max()}' for q in quarters)} by quarter")
        wrong = self._beyond_a_pool()
        times = np.array(self.minutes)
        late = times >= minutes / 4.0
        try:
            found = slope(*least_of_minutes(times[late], others[late]))
        except ValueError as error:
            print(f"  no slope: {error}")
            return wrong
        print(f"  least of each minute, others: {found}")
        if found.low > LEAK_PER_MIN:
            first, last = (self.kinds[k] for k in (np.flatnonzero(late)[0], -1))
            wrong.append(f"descriptors grow by {found}: {changed(first, last)}")
        return wrong

    def _beyond_a_pool(self) -> list[str]:
        most: Counter[str] = Counter()
        for kinds in self.kinds:
            most |= kinds
        return [
            f"{number} connections to {name}: a pool has {POOLED} at most"
            for name, number in most.items()
            if _is_database(name) and number > POOLED
        ]


def least_of_minutes(minutes: NDArray[np.float64], numbers: NDArray[np.int64]) -> tuple[Values, Values]:
    """Middle of each whole minute, and the least of its numbers."""
    whole = np.floor(minutes)
    marks = np.unique(whole)
    return marks + 0.5, np.array([float(numbers[whole == mark].min()) for mark in marks])


def _is_database(name: str) -> bool:
    return ".sqlite" in name and not name.endswith("-shm")


def _of_databases(kinds: Counter[str]) -> int:
    return sum(number for name, number in kinds.items() if _is_database(name))
