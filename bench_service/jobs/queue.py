"""The queue of a bench: who may start, who waits, and why. Pure: the same rules pick a job and explain its waiting.

Order: priority (smaller first), then the moment of queueing, then the id. A job that may not start yet (its bench is
stopped, its bench or unit is reserved by somebody else, its retry is not due) is passed over: it blocks nobody.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Protocol

from bench_service.jobs.reservation import Reservation, Reserved
from bench_service.model.job import Failure, Job
from bench_service.model.records import BenchStop, reasons_of

LONGEST_PAUSE_S = 300.0
"""No retry is put off for longer [s]. One that is due later than that was put off by a clock that was set back since:
it waits no more."""


@dataclass(frozen=True)
class QueueEntry:
    """A job that waits for its bench or drives it, by the fields that every version of the service reads."""

    id: str
    procedure: str
    unit: str
    priority: int
    queued_at: datetime
    attempt: int
    not_before: datetime | None = None
    reservation: str | None = None


@dataclass(frozen=True)
class Place:
    """Where a queued job stands."""

    position: int
    """From 1, in the order of the queue."""
    ahead: int
    """How many jobs go before it as things stand: the running one, and those before it that may start."""
    waiting: str
    """Why it does not run yet, as a sentence."""


@dataclass(frozen=True)
class BenchQueue:
    """A bench's queue at one moment."""

    bench: str
    at: datetime
    entries: tuple[QueueEntry, ...]
    """In order."""
    running: str | None = None
    """The job that drives the bench."""
    stops: tuple[BenchStop, ...] = ()
    """Those that stand, oldest first."""
    reservations: tuple[Reservation, ...] = ()
    """Those that hold now, of the bench and of the units in the queue."""

    def next(self) -> QueueEntry | None:
        """The job that starts next, if any may."""
        return next((entry for entry in self.entries if self.hold(entry) is None), None)

    def hold(self, entry: QueueEntry) -> str | None:
        """Why a job may not start whatever else the bench does; None where it may."""
        if self.stops:
            return f"bench {self.bench} is stopped: {reasons_of(self.stops)}"
        for reservation in self._of_others(entry):
            what = f"{reservation.kind.value} {reservation.name}"
            return f"{what} is reserved by {reservation.holder} until {reservation.until.isoformat()}"
        latest = self.at + timedelta(seconds=LONGEST_PAUSE_S)
        if entry.not_before is not None and self.at < entry.not_before <= latest:
            return f"it is tried again at {entry.not_before.isoformat()}"
        return None

    def place(self, job_id: str, driven: bool) -> Place | None:
        """Where a job stands; None where it is not in the queue. `driven`: whether a worker drives the bench."""
        return self.places(driven).get(job_id)

    def places(self, driven: bool) -> dict[str, Place]:
        """Where every job of the queue stands, by its id, in order: one walk for all of them."""
        places: dict[str, Place] = {}
        ahead, last = (0, "") if self.running is None else (1, self.running)
        for number, entry in enumerate(self.entries, start=1):
            hold = self.hold(entry)
            places[entry.id] = Place(number, ahead, hold or self._turn(ahead, last, driven))
            if hold is None:
                ahead, last = ahead + 1, entry.id
        return places

    def _turn(self, ahead: int, last: str, driven: bool) -> str:
        """Why a job that may start does not: `ahead` jobs go before it, and `last` is the last of them."""
        if not driven:
            return f"no worker drives bench {self.bench} now"
        if ahead == 0:
            return "it is next"
        if last == self.running:
            return f"behind job {self.running}, which runs"
        return f"behind {ahead} jobs; the last of them is {last}"

    def _of_others(self, entry: QueueEntry) -> Iterator[Reservation]:
        """Reservations of its bench or unit by another holder than that of the job's own reservation."""
        mine = next((r.holder for r in self.reservations if r.id == entry.reservation), None)
        for reservation in self.reservations:
            concerned = {Reserved.BENCH: self.bench, Reserved.UNIT: entry.unit}[reservation.kind]
            if reservation.name == concerned and reservation.holder != mine:
                yield reservation


class QueueStore(Protocol):
    """The queues of all benches, as they are kept. Every method is one transaction."""

    def look(self, bench: str, at: datetime) -> BenchQueue:
        """A bench's queue now."""
        ...

    def front(self, bench: str, at: datetime) -> BenchQueue:
        """The same with its first entries only: so many that `next` answers as for the whole; none while a job runs."""
        ...

    def claim(self, entry: QueueEntry, context: dict[str, Any], at: datetime) -> Job | None:
        """Begin a queued job, with what is known of its unit now: it is running from this moment.

        None where that is not possible any more: it left the queue, was queued anew, may not start, or its bench has a
        running job (so no two jobs of one bench are ever running, whoever asks).
        """
        ...

    def running(self, bench: str) -> QueueEntry | None:
        """The job that drives a bench."""
        ...

    def requeue(self, job_id: str, at: datetime, not_before: datetime | None, why: Failure, spend: bool) -> Job:
        """Put a running job back into its place in the queue, as its next attempt, until `not_before`.

        `spend`: it costs one of the job's retries. Raises `IllegalTransition` where it does not run.
        """
        ...

    def set_priority(self, job_id: str, priority: int, at: datetime) -> Job:
        """Raises `IllegalTransition` where it is not queued."""
        ...

    def lengths(self) -> dict[str, int]:
        """How many jobs are queued for each bench that has any."""
        ...
