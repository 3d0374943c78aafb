"""A supervisor with books, watch and lease that a test switches, on real files and processes."""

import subprocess
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from bench_service import wall_clock
from bench_service.bench.devices import BenchDevices, DeviceState
from bench_service.bench.heartbeat import HeartbeatFile
from bench_service.bench.processes import Driving, ProcessIdentity
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.word import StopWord
from bench_service.bench.supervisor import Supervisor
from bench_service.drivers.device_register import DeviceRegister
from bench_service.model.errors import StorageFailure
from bench_service.model.records import BenchStop
from bench_service.wall_clock import monotonic_s, pause

GONE = Driving(ProcessIdentity("nowhere", 1, "never"))


class Books:
    """A database that can be switched off."""

    def __init__(self) -> None:
        self.answers = True
        self.is_stopped = False
        self.by_hand = BenchStop("sim", wall_clock.now(), "a test")
        self.entered: dict[str, BenchStop] = {}
        self.said: list[str] = []
        self.confirmed = ""

    def _ask(self) -> None:
        if not self.answers:
            raise StorageFailure("the database failed: it is restarted")

    def standing(self) -> tuple[BenchStop, ...]:
        self._ask()
        by_hand = (self.by_hand,) if self.is_stopped else ()
        return (*by_hand, *(stop for stop in self.entered.values() if stop.stands))

    def stored(self, ids: Iterable[str]) -> tuple[BenchStop, ...]:
        self._ask()
        known = {self.by_hand.id: replace(self.by_hand, released_at=None if self.is_stopped else wall_clock.now())}
        return tuple(found for each in ids if (found := (known | self.entered).get(each)) is not None)

    def release(self, stop_id: str) -> None:
        """A release by somebody who has only the database."""
        self.entered[stop_id] = replace(self.entered[stop_id], released_at=wall_clock.now(), released_by="Bo")

    def enter(self, word: StopWord) -> None:
        self._ask()
        self.entered.setdefault(word.id, BenchStop("sim", word.at, word.reason, by=word.by, id=word.id))

    def confirm_safe(self, by: str) -> None:
        self._ask()
        self.confirmed = by

    def stop(self, reason: str, by: str) -> None:
        self._ask()
        self.is_stopped = True
        self.said.append(f"stopped: {reason}")

    def note(self, by: str, text: str, job: str | None) -> None:
        self._ask()
        self.said.append(f"{job}: {text}")


class Watch:
    """Identities of worker and supervisor, in place of the files of the host."""

    def __init__(self, driving: Driving | None) -> None:
        self.now = driving

    def driving(self) -> Driving | None:
        return self.now

    def supervisor(self) -> ProcessIdentity | None:
        return None

    def silent_supervisor(self) -> ProcessIdentity | None:
        return None


class Lease:
    def __init__(self) -> None:
        self.taken = self.given_back = 0

    def take(self) -> "Lease":
        self.taken += 1
        return self

    def release(self) -> None:
        self.given_back += 1


def identity(worker: subprocess.Popen[bytes]) -> ProcessIdentity:
    return ProcessIdentity(ProcessIdentity.own().host, worker.pid, started(worker.pid))


def started(pid: int) -> str:
    from bench_service.bench import processes

    return processes._started(pid)


def state(folder: Path) -> DeviceState:
    found = DeviceRegister(folder, "sim").read()
    assert found is not None
    return found


def supervised(
    folder: Path, devices: BenchDevices, watch: Watch, books: Books, take_lease: Any, **how: float
) -> Supervisor:
    """A supervisor with the channel and the heartbeat of a folder."""
    channel = StopChannel(folder, "sim")
    channel.prepare()
    return Supervisor("sim", devices, watch, books, take_lease, channel, HeartbeatFile(folder, "sim"), **how)


def look_for(supervisor: Supervisor, seconds: float) -> None:
    """Let a supervisor look again and again."""
    end_s = monotonic_s() + seconds
    while monotonic_s() < end_s:
        supervisor.look()
        pause(0.05)
