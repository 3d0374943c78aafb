"""The live state of a bench: written by its driver, read by every process, kept in one row per bench.

In the process that drives a bench the newest state is in memory; other processes read the row. It is at the same time
the driver's heartbeat: an idle driver writes it every `BEAT_S`.
"""

import logging
import os
import socket
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from threading import Event, Thread
from typing import Protocol

from bench_service.model.errors import ServiceError
from bench_service.model.job import Job, JobState
from bench_service.wall_clock import now
from procedures.bench.chamber import ChamberReading

PUBLISH_S = 0.5
"""Minimum interval between two published states of a running job [s, real time]."""
BEAT_S = 5.0
"""Interval between two heartbeats of an idle driver [s, real time]."""
SEEN_S = 15.0
"""A driver whose last heartbeat is older than this is gone, or cannot write [s, real time]."""
HOST = socket.gethostname()

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class LiveStatus:
    """A status word of a device, and since when it has had this value."""

    device: str
    name: str
    raw: str
    bits: tuple[str, ...]
    """Names of the bits that are set: interlocks, limiters, faults."""
    since: datetime


@dataclass(frozen=True)
class LiveDevices:
    """The state that the devices report: encoder angles, supply, chamber, status words."""

    outer_deg: float
    middle_deg: float
    inner_deg: float
    moving: bool
    """True while the table follows a demand, or settles after it."""
    unit_on: bool
    chamber: ChamberReading | None = None
    """Reading of the chamber; None: the bench has none."""
    status: tuple[LiveStatus, ...] = ()
    """Status words of all devices, as they were last read."""
    rates_deg_s: tuple[float, float, float] | None = None
    """Rates of outer, middle and inner axis; None: the controller reports none."""
    voltage_v: float | None = None
    """Measured voltage of the unit's supply."""
    current_a: float | None = None
    """Measured current of the unit's supply."""


@dataclass(frozen=True)
class LiveChannel:
    """A channel's minimum, mean and maximum in nominal rate units, one number for each stretch of `LiveSamples`."""

    name: str
    unit: str
    minimum: tuple[float, ...]
    mean: tuple[float, ...]
    maximum: tuple[float, ...]


@dataclass(frozen=True)
class LiveSamples:
    """A few of the last stretches of the recording: enough for a live plot, never the data."""

    start_s: tuple[float, ...]
    """Bench time of each stretch's beginning [s]."""
    stop_s: tuple[float, ...]
    channels: tuple[LiveChannel, ...]


@dataclass(frozen=True)
class LiveJob:
    """Progress of the job that drives the bench."""

    id: str
    station: int
    """Index of the station that it works on."""
    stations: int
    label: str
    bench_time_s: float
    """Time of the bench's clock."""
    fraction: float
    """Part of the planned bench time that is over, 0 … 1."""
    eta_s: float
    """Bench time left, by the plan [s]."""
    eta_wall_s: float | None
    """Real time left at the rate so far, without the analysis [s]; None: no bench time has passed yet."""
    bench_s_per_s: float | None
    """Seconds of bench time in a second of real time, since this process opened the bench."""


@dataclass(frozen=True)
class LiveSensor:
    """A channel of the unit: its mean over the last samples, in nominal units."""

    name: str
    unit: str
    value: float


@dataclass(frozen=True)
class LiveManual:
    """State of manual mode on the bench: the lease and its holder, what is being carried out, and the unit's
    sensors.
    """

    lease: str
    holder: str
    reason: str
    until: datetime
    bench_time_s: float
    """Time of the bench's clock."""
    doing: str
    """The motion that is under way; empty: the table rests."""
    sensors: tuple[LiveSensor, ...] = ()
    """The unit's channels; empty while it is off, or before its first samples."""
    sensors_at_s: float | None = None
    """Bench time of their samples' end: during a move to angles a simulated unit is not read."""
    sensors_problem: str = ""
    """The reason why the unit was not read; empty: it was, or it is off."""


@dataclass(frozen=True)
class BenchLive:
    """The newest live state of a bench, as its driver wrote it: process, job, devices, samples, manual mode. Also the
    driver's heartbeat.
    """

    bench: str
    at: datetime
    host: str = HOST
    process: int = 0
    driving: bool = True
    """False: the driver ended in an orderly way."""
    job: LiveJob | None = None
    devices: LiveDevices | None = None
    """State of the devices; None: no process has opened the bench, or they do not answer."""
    samples: LiveSamples | None = None
    manual: LiveManual | None = None
    """Manual mode; None: the bench is not in it."""

    def seen_s(self, at: datetime) -> float:
        """Age of this state at a moment [s]; 0 for a state with a later time."""
        return max(0.0, (at - self.at).total_seconds())

    def there(self, at: datetime) -> bool:
        """Return whether a driver is alive, judged by the age of its last heartbeat.

        A heartbeat dated more than `SEEN_S` in the future comes from before the clock was set back, and counts as
        stale: a living driver writes a new one.
        """
        return self.driving and abs((at - self.at).total_seconds()) <= SEEN_S


class LiveStore(Protocol):
    """Store of the live states, one row a bench, which each write replaces. Interface; the SQL is in `persistence`."""

    def put(self, live: BenchLive) -> None:
        """Replace the bench's live state. Raises `StorageFull`, `StorageFailure`."""
        ...

    def get(self, bench_id: str) -> BenchLive | None: ...

    def all(self) -> tuple[BenchLive, ...]:
        """Return the live states of all benches that ever had a driver, in order of their names. Raises
        `StorageFailure`.
        """
        ...


class LiveBoard:
    """The newest live state of every bench: of this process's own bench from memory, of others from their rows."""

    def __init__(self, store: LiveStore, own: str | None = None, clock: Callable[[], datetime] = now) -> None:
        """Set up for the bench that this process drives (`own`); None where it drives none."""
        self.own = own
        self._store = store
        self._clock = clock
        self._said: BenchLive | None = None if own is None else BenchLive(own, clock(), process=os.getpid())
        self.news = Event()

    def publish(self, live: BenchLive) -> None:
        """Publish the own bench's live state; called by its driver, never waits."""
        self._said = replace(live, process=os.getpid())
        self.news.set()

    def own_live(self) -> BenchLive | None:
        """Return the newest live state of the own bench from memory; None before the first one."""
        return self._said

    def of_bench(self, bench_id: str) -> BenchLive | None:
        """The newest live state of a bench; None: it never had a driver. Raises `StorageFailure`."""
        if bench_id == self.own and self._said is not None:
            return self._said if self._said.job or self._said.manual else replace(self._said, at=self._clock())
        return self._store.get(bench_id)

    def all(self) -> tuple[BenchLive, ...]:
        """Return the newest live states of all benches, the own bench first. Raises `StorageFailure`."""
        others = (live for live in self._store.all() if live.bench != self.own)
        mine = () if self.own is None else (self.of_bench(self.own),)
        return tuple(live for live in (*mine, *others) if live is not None)

    def of_job(self, job: Job) -> LiveJob | None:
        """Progress of a running job; None where it does not run, or its driver is silent. Raises `StorageFailure`."""
        if job.state is not JobState.RUNNING:
            return None
        live = self.of_bench(job.bench)
        if live is None or live.job is None or live.job.id != job.id or not live.there(self._clock()):
            return None
        return live.job


class Heartbeat:
    """Writes the own bench's live state into its row, in its own thread: a slow disk never holds the bench up."""

    def __init__(self, board: LiveBoard, store: LiveStore) -> None:
        self._board = board
        self._store = store
        self._ending = Event()
        self._silent = False
        self._thread = Thread(target=self._run, name="heartbeat", daemon=True)

    def begin(self) -> None:
        """Start the heartbeat's thread. The bench's lease must be held."""
        self._thread.start()

    def end(self) -> None:
        """Stop the thread and wait for it, then write a last state: the bench has no driver."""
        self._ending.set()
        self._board.news.set()
        self._thread.join()
        if (said := self._board.own_live()) is not None:
            self._write(replace(said, at=now(), driving=False, job=None, devices=None, samples=None, manual=None))

    def _run(self) -> None:
        while not self._ending.is_set():
            self._board.news.clear()
            said = self._board.own_live()
            if said is not None:
                self._write(said if said.job or said.manual else replace(said, at=now()))
            self._board.news.wait(BEAT_S)
            self._ending.wait(PUBLISH_S)

    def _write(self, live: BenchLive) -> None:
        try:
            self._store.put(live)
            self._silent = False
        except ServiceError as error:
            if not self._silent:  # once: a full disk lasts
                log.warning("the state of bench %s cannot be published to other processes: %s", live.bench, error)
            self._silent = True
