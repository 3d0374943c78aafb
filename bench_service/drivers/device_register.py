"""Register of a simulated bench's devices: the state that real devices keep themselves, and a link for one master.

A real table keeps moving when the process that commanded it dies, and can be asked afterwards. A simulated table
dies with its process, so what was commanded last is kept in a file next to the database. The file's lock is the link:
the kernel gives it to one process and takes it back at its death.
"""

import fcntl
import os
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from threading import Lock
from typing import Any

from bench_service import wall_clock
from bench_service.bench.devices import DeviceState
from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.records_in_place import Unreadable, encoded, read_record, write_record
from bench_service.drivers.device_cables import DeviceCables
from bench_service.drivers.device_journal import DeviceJournal
from procedures.bench.errors import DeviceBusy, Disconnected


class DeviceRegister:
    """Last known state, journal and lost links of one bench's devices, in files of a folder on the bench's host."""

    def __init__(self, folder: Path, bench_id: str) -> None:
        self.bench_id = bench_id
        self.path = folder / f"bench-{bench_id}.devices"
        self.journal = DeviceJournal(folder / f"bench-{bench_id}.journal")
        self.cables = DeviceCables(folder, bench_id)

    def read(self) -> DeviceState | None:
        """Return the devices' last noted state, without their link; None where no process of this host ever had it."""
        try:
            file = os.open(self.path, os.O_RDONLY | os.O_CLOEXEC)
        except FileNotFoundError:
            return None
        try:
            return _read(file)
        finally:
            os.close(file)

    def open(self, by: str = "", job: str | None = None) -> "DeviceLink":
        """Take the devices' link, which one process has at a time, and return it. Raises `DeviceBusy` naming its
        present holder. `by`: name of this process for others; `job`: id of the job that takes the link, None outside of
        jobs.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            state = _read(file)
            os.close(file)
            holder = (state.by if state is not None else "") or "another process"
            refusals = DeviceJournal(self.journal.path)  # closed again: the holder of the link may rotate it
            refusals.write("link.refused", {"holder": holder})
            refusals.close()
            raise DeviceBusy(f"the devices of bench {self.bench_id!r} are driven by {holder}") from None
        return DeviceLink(file, self.journal, by or str(ProcessIdentity.own()), job)


class DeviceLink:
    """The right to command a bench's devices, and the memory of the last commands. Closed, it commands nothing."""

    def __init__(self, file: int, journal: DeviceJournal, by: str, job: str | None) -> None:
        self._file: int | None = file
        self._journal = journal
        self._mutex = Lock()
        self.state = _read(file) or DeviceState()
        self.openings = self.state.openings + 1
        self.note("link.opened", {}, by=by, job=job, linked=True, openings=self.openings)

    @property
    def is_open(self) -> bool:
        """Return whether the link is still open."""
        return self._file is not None

    def note(self, verb: str, arguments: dict[str, Any], **changes: Any) -> None:
        """Write a demand on the devices into the journal, and the state that it leads to into the register. Raises
        `Disconnected` once it is closed.
        """
        with self._mutex:
            if self._file is None:
                raise Disconnected(f"{verb}: this process has closed its link to the devices")
            self._note(self._file, verb, arguments, changes)

    def close(self) -> None:
        """Release the link; a second call does nothing. A device that still moves keeps moving."""
        with self._mutex:
            if self._file is not None:
                self._note(self._file, "link.closed", {}, {"linked": False})
                self._journal.rotate()
                self._journal.close()
                os.close(self._file)
                self._file = None

    def _note(self, file: int, verb: str, arguments: dict[str, Any], changes: dict[str, Any]) -> None:
        self.state = replace(self.state, at=wall_clock.now(), **changes)
        write_record(file, 0, _written(self.state))
        self._journal.write(verb, arguments, job=self.state.job)


def _written(state: DeviceState) -> bytes:
    document = dict(vars(state))
    document["at"] = None if state.at is None else state.at.isoformat()
    return encoded(document) or _written(replace(state, fault=state.fault[:200], by=state.by[:200], job=None))


def _read(file: int) -> DeviceState | None:
    """Read the state in a file; None in an empty one, which another process is about to write."""
    try:
        document = read_record(file)
    except Unreadable:
        return DeviceState(fault="what the devices' register holds cannot be read: they must be looked at")
    return None if document is None else _state(document)


def _state(document: dict[str, Any]) -> DeviceState:
    at, angles = document.pop("at"), document.pop("angles_deg")
    return DeviceState(
        **document,
        at=None if at is None else datetime.fromisoformat(at),
        angles_deg=None if angles is None else tuple(angles),
    )
