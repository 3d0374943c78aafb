"""Those who look on while the storm lasts, and only from outside: at the devices, at the database, at the events.

Nothing of the service's own code is used: registers, locks and tables are read as they lie there.
"""

import json
import time
import zlib
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from threading import Event, Thread
from typing import Any

import httpx
import sqlalchemy as sa

from tests.chaos.databases import engine
from tests.chaos.load import FINAL
from tests.chaos.processes import living

LOCKS = Path("/proc/locks")
LOCKS_EVERY = 7
"""The kernel's list is long: it is read in one of so many looks."""


class Witness(Thread):
    """Looks again and again until it is told to end."""

    def __init__(self, name: str, every_s: float) -> None:
        super().__init__(name=name, daemon=True)
        self._every_s = every_s
        self._ending = Event()

    def run(self) -> None:
        while not self._ending.wait(self._every_s):
            self.look()

    def look(self) -> None:
        raise NotImplementedError

    def end(self) -> None:
        self._ending.set()
        self.join()


@dataclass(frozen=True)
class Sight:
    """State of a bench's devices as it was seen, from one moment [s, Unix time] to the next sight."""

    at: float
    safe: bool
    by: str
    warm: bool = False
    """Whether the chamber was led away from ambient."""


def register(path: Path) -> dict[str, Any] | None:
    """The devices' register: a checksum, and a JSON document with the state."""
    try:
        checksum, _, body = path.read_bytes().partition(b" ")
    except OSError:
        return None
    body = body.rstrip()
    return json.loads(body) if checksum == b"%08x" % zlib.crc32(body) else None


def is_safe(state: dict[str, Any]) -> bool:
    """Table at rest, unit without power, chamber led nowhere but to ambient, no current, no fault."""
    quiet = not state["powered"] and state["current_ma"] == 0.0
    return state["table"] == "at rest" and quiet and not is_warm(state) and not state["fault"]


def is_warm(state: dict[str, Any]) -> bool:
    """Whether the chamber is commanded to anything but ambient."""
    return state["chamber_target_c"] not in (None, state["chamber_ambient_c"])


def unreachable(folder: Path, bench: str, at: float, lasts_s: float) -> list[str]:
    """Devices that have to be made safe and whose link was lost at a moment [s, Unix time].

    By their files, which say until when; each loss is known to last `lasts_s`.
    """
    found: list[str] = []
    for device in ("turntable", "chamber", "current_source", "supply"):
        try:
            until = json.loads((folder / f"bench-{bench}.{device}.lost").read_text())["until"]
        except (OSError, ValueError):
            continue
        end = datetime.fromisoformat(until).timestamp()
        if end - lasts_s < at < end:
            found.append(device)
    return found


def lock_holders(path: Path) -> list[int]:
    """Which processes hold a lock on a file, by the kernel's own list; those that wait for one are not in it."""
    inode = str(path.stat().st_ino)
    fields = [line.split() for line in LOCKS.read_text().splitlines() if "->" not in line]
    # a list that changes while it is read may name one twice
    return sorted({int(field[4]) for field in fields if field[1] == "FLOCK" and field[5].rpartition(":")[2] == inode})


class DeviceWitness(Witness):
    """When each bench was safe, by its register; and that its link's lock was held by the one who said so."""

    def __init__(self, folder: Path, benches: tuple[str, ...], lost_s: float) -> None:
        """`lost_s`: how long a link that is lost stays lost [s]."""
        super().__init__("devices", 0.01)
        self.sights: dict[str, list[Sight]] = {bench: [] for bench in benches}
        self.locks_seen = 0
        self.wrong: list[str] = []
        self.warm_s = 0.0
        """How long chambers were seen led away from ambient [s]."""
        self._looks = 0
        self._looked_at = time.time()
        self._folder, self._lost_s = folder, lost_s
        self._files = {bench: folder / f"bench-{bench}.devices" for bench in benches}

    def look(self) -> None:
        self._looks += 1
        passed_s, self._looked_at = time.time() - self._looked_at, time.time()
        for bench, path in self._files.items():
            state, at = register(path), time.time()
            if state is None:
                continue
            if is_warm(state):
                self.warm_s += passed_s
            sights = self.sights[bench]
            seen = Sight(at, is_safe(state), state["by"], is_warm(state))
            if not sights or (sights[-1].safe, sights[-1].warm) != (seen.safe, seen.warm):
                sights.append(seen)
                self.wrong += self.false_safety(bench, state)
            if LOCKS.exists() and self._looks % LOCKS_EVERY == 0:
                self._look_at_lock(bench, path, state)

    def false_safety(self, bench: str, state: dict[str, Any]) -> list[str]:
        """Whether a bench is said to be safe by somebody who could not reach all of it."""
        if not is_safe(state) or state["at"] is None:
            return []
        lost = unreachable(self._folder, bench, datetime.fromisoformat(state["at"]).timestamp(), self._lost_s)
        return (
            [f"bench {bench}: {state['by']!r} calls it safe at {state['at']}, {lost} cannot be reached"] if lost else []
        )

    def _look_at_lock(self, bench: str, path: Path, before: dict[str, Any]) -> None:
        holders = lock_holders(path)
        if len(holders) > 1:
            self.wrong.append(f"bench {bench}: the devices' link is held by processes {holders} at once")
        if self._contradiction(path, before, holders):
            time.sleep(0.1)  # a process that is being killed has given up its files, and is not gone yet
            holders = lock_holders(path)
            if self._contradiction(path, before, holders):
                self.wrong.append(f"bench {bench}: {before['by']!r} commands while the lock is held by {holders}")

    def _contradiction(self, path: Path, before: dict[str, Any], holders: list[int]) -> bool:
        """Whether a living master of the link, before and after, was not the one who held its lock."""
        after = register(path)
        if after is None or not (before["linked"] and after["linked"]) or before["openings"] != after["openings"]:
            return False
        master = master_of(before)
        if not living(master):
            return False
        self.locks_seen += 1
        return holders != [master]

    def warm_at(self, bench: str, at: float) -> bool:
        """Whether the chamber was led away from ambient at a moment."""
        before = [sight for sight in self.sights[bench] if sight.at <= at]
        return bool(before) and before[-1].warm

    def safe_after(self, bench: str, at: float) -> tuple[bool, float | None]:
        """Whether the bench was safe at a moment, and how long it then took until it was [s]; None: never."""
        before = [sight for sight in self.sights[bench] if sight.at <= at]
        if not before or before[-1].safe:
            return True, 0.0
        later = next((sight.at for sight in self.sights[bench] if sight.at > at and sight.safe), None)
        return False, None if later is None else later - at


def master_of(state: dict[str, Any]) -> int:
    """The number of the process that has the link, in words like "the supervisor, process 4711 on host"."""
    return int(state["by"].partition("process ")[2].partition(" ")[0] or 0)


@dataclass
class Seen:
    """Rows that were read as committed while the storm lasted."""

    complete: dict[str, str] = field(default_factory=dict)
    """Of sealed recordings: id and content hash."""
    chunks: dict[tuple[str, int], str] = field(default_factory=dict)
    """Of sealed recordings: recording and number, and the payload's hash."""
    stations: dict[tuple[str, int], str] = field(default_factory=dict)
    """Of events that said a station is done: job and sequence, and the recording's content hash."""


class DatabaseWitness(Witness):
    """Witness of what was once committed, read by SQL."""

    def __init__(self, database_url: str) -> None:
        super().__init__("database", 0.4)
        self.seen = Seen()
        self.looks = 0
        self._engine = engine(database_url)

    def look(self) -> None:
        try:
            with self._engine.connect() as connection:
                self._read(connection)
        except sa.exc.SQLAlchemyError:
            return
        self.looks += 1

    def _read(self, connection: sa.Connection) -> None:
        sealed = connection.execute(sa.text("SELECT id, content_hash FROM recordings WHERE state = 'complete'"))
        fresh = {row[0]: row[1] for row in sealed if row[0] not in self.seen.complete}
        for recording, content in fresh.items():
            query = sa.text("SELECT number, sha256 FROM chunks WHERE recording_id = :id")
            for number, sha in connection.execute(query, {"id": recording}):
                self.seen.chunks[recording, number] = sha
            self.seen.complete[recording] = content
        done = connection.execute(sa.text("SELECT job_id, sequence, data FROM events WHERE kind = 'station'"))
        for job, sequence, data in done:
            document = json.loads(data) if isinstance(data, str) else data
            if "hash" in document:
                self.seen.stations[job, sequence] = document["hash"]


class Listener(Witness):
    """A client of one job's server-sent events, who comes back with `Last-Event-ID` to whichever process answers."""

    def __init__(self, ports: tuple[int, ...], job: str) -> None:
        super().__init__(f"listener of {job}", 0.2)
        self.job = job
        self.heard: list[tuple[int, str, Any]] = []
        self.connections = 0
        self._ports = ports

    def look(self) -> None:
        """Listen until the connection ends, or a little while, but not in vain: then leave, and come back."""
        before = len(self.heard)
        last = self.heard[-1][0] if self.heard else 0
        port = self._ports[self.connections % len(self._ports)]
        self.connections += 1
        address = f"http://127.0.0.1:{port}/api/v1/jobs/{self.job}/events"
        until = time.monotonic() + 2.0
        try:
            with httpx.stream(
                "GET", address, headers={"Last-Event-ID": str(last)}, timeout=20, trust_env=False
            ) as answer:
                frame: dict[str, str] = {}
                for line in answer.iter_lines():
                    if line:
                        name, _, value = line.partition(": ")
                        frame[name] = value
                        continue
                    if "id" in frame:
                        said = json.loads(frame["data"])
                        self.heard.append((int(frame["id"]), frame["event"], said["data"]))
                        if said["data"].get("state") in FINAL:
                            self._ending.set()
                    frame = {}
                    if (time.monotonic() > until and len(self.heard) > before) or self._ending.is_set():
                        return
        except (httpx.HTTPError, OSError):
            return
