"""The queue of a bench: order, eligibility, reasons for waiting. Pure: one set of rules picks and explains.

Order: priority (smaller first), then the moment of queueing, then the id. A job that may not start yet (its bench is
stopped, its bench or unit is reserved by another holder, its retry is not due) is passed over: it blocks no other job.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Protocol

from bench_service.jobs.reservation import Reservation, Reserved
from bench_service.model.job import Failure, Job
from bench_service.model.manual import ManualLease
from bench_service.model.records import BenchStop, reasons_of

LONGEST_PAUSE_S = 300.0
"""Longest pause before a retry [s]. A retry that is due later was scheduled before the clock was set back: it is due
at once.
"""


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
    team: str = ""
    """Team of the campaign run to which the job belongs: it need not wait for what that team has reserved."""


@dataclass(frozen=True)
class Place:
    """A queued job's place in the queue: its position, the number of jobs ahead, and the reason why it waits."""

    position: int
    """Position in the queue, counted from 1."""
    ahead: int
    """Number of jobs that go before it as things stand: the running one, and those before it that may start."""
    waiting: str
    """The reason why it does not run yet, as a sentence."""


@dataclass(frozen=True)
class BenchQueue:
    """A bench's queue at one moment: the waiting jobs in order, the running job, stops, reservations, lease of manual
    mode.
    """

    bench: str
    at: datetime
    entries: tuple[QueueEntry, ...]
    """The queued jobs in order."""
    running: str | None = None
    """The job that drives the bench."""
    stops: tuple[BenchStop, ...] = ()
    """The stops that stand, oldest first."""
    reservations: tuple[Reservation, ...] = ()
    """The reservations that hold now, of the bench and of the units in the queue."""
    manual: ManualLease | None = None
    """The open lease of manual mode: no job starts before it has ended, and the bench is safe."""

    def next(self) -> QueueEntry | None:
        """Return the first job that may start now; None where none may."""
        return next((entry for entry in self.entries if self.hold(entry) is None), None)

    def hold(self, entry: QueueEntry) -> str | None:
        """Return the reason why a job may not start, apart from the running job; None where it may."""
        if self.stops:
            return f"bench {self.bench} is stopped: {reasons_of(self.stops)}"
        if (manual := self.manual) is not None:
            return (
                f"bench {self.bench} is in manual mode by {manual.holder} until {manual.until.isoformat()}: "
                f"{manual.reason}"
            )
        for reservation in self._of_others(entry):
            what = f"{reservation.kind.value} {reservation.name}"
            return f"{what} is reserved by {reservation.holder} until {reservation.until.isoformat()}"
        latest = self.at + timedelta(seconds=LONGEST_PAUSE_S)
        if entry.not_before is not None and self.at < entry.not_before:
            if entry.attempt == 1:
                return f"it starts no earlier than {entry.not_before.isoformat()}"
            if entry.not_before <= latest:
                return f"it is tried again at {entry.not_before.isoformat()}"
        return None

    def place(self, job_id: str, driven: bool) -> Place | None:
        """Return the place of a job; None where it is not in the queue. `driven`: True where a worker drives the
        bench.
        """
        return self.places(driven).get(job_id)

    def places(self, driven: bool) -> dict[str, Place]:
        """Return the places of all queued jobs by job id, in the order of the queue, in one pass. `driven`: True where
        a worker drives the bench.
        """
        places: dict[str, Place] = {}
        ahead, last = (0, "") if self.running is None else (1, self.running)
        for number, entry in enumerate(self.entries, start=1):
            hold = self.hold(entry)
            places[entry.id] = Place(number, ahead, hold or self._turn(ahead, last, driven))
            if hold is None:
                ahead, last = ahead + 1, entry.id
        return places

    def _turn(self, ahead: int, last: str, driven: bool) -> str:
        """The reason why an eligible job does not start: `ahead` jobs go before it, and `last` is the last of them."""
        if not driven:
            return f"no worker drives bench {self.bench} now"
        if ahead == 0:
            return "it is next"
        if last == self.running:
            return f"behind job {self.running}, which runs"
        return f"behind {ahead} jobs; the last of them is {last}"

    def _of_others(self, entry: QueueEntry) -> Iterator[Reservation]:
        """Reservations of the job's bench or unit by holders and teams other than those of its own reservation."""
        mine = next((r for r in self.reservations if r.id == entry.reservation), None)
        for reservation in self.reservations:
            concerned = {Reserved.BENCH: self.bench, Reserved.UNIT: entry.unit}[reservation.kind]
            same_team = bool(entry.team) and entry.team == reservation.team
            if reservation.name == concerned and not same_team and not reservation.admits(mine):
                yield reservation


class QueueStore(Protocol):
    """Store of the queues of all benches. Every method is one transaction. Interface; the SQL is in `persistence`."""

    def look(self, bench: str, at: datetime) -> BenchQueue:
        """Return the whole queue of a bench at a moment."""
        ...

    def front(self, bench: str, at: datetime) -> BenchQueue:
        """Return the queue with its first entries alone: as many as `next` needs to answer as for the whole; none while
        a job runs.
        """
        ...

    def claim(self, entry: QueueEntry, context: dict[str, Any], at: datetime) -> Job | None:
        """Claim a queued job, with its unit's current data: it is running from this moment.

        None where that is not possible any more: it left the queue, was requeued, may not start, or its bench has a
        running job (so no two jobs of one bench are ever running).
        """
        ...

    def running(self, bench: str) -> QueueEntry | None:
        """Return the running job of a bench; None where none runs."""
        ...

    def requeue(self, job_id: str, at: datetime, not_before: datetime | None, why: Failure, spend: bool) -> Job:
        """Return a running job to its place in the queue, as its next attempt, not to start before `not_before`.

        `spend`: uses up one of the job's retries. Raises `IllegalTransition` where it does not run.
        """
        ...

    def set_priority(self, job_id: str, priority: int, at: datetime) -> Job:
        """Change a queued job's priority and return the job. Raises `IllegalTransition` where it is not queued,
        `NotFound`.
        """
        ...

    def lengths(self) -> dict[str, int]:
        """Return the number of queued jobs of each bench that has any."""
        ...
