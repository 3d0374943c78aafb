"""Stores that `jobs` needs: jobs with their events, the queues of benches, reservations, leases of manual mode.

Every method is one transaction: it commits, or it raises and nothing of it remains.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol

from bench_service.bench.stores import BenchStores
from bench_service.jobs.manual.store import ManualStore
from bench_service.jobs.queue import QueueStore
from bench_service.jobs.reservation import ReservationStore
from bench_service.model.job import Event, Failure, Job, JobHeading, JobState
from bench_service.model.records import Idempotency, Page
from bench_service.model.search import EVERYTHING, Search
from procedures.core.limits import Verdict


class JobStore(Protocol):
    """Store of jobs and their events. Every change of state appends an event in the same transaction. Interface; the
    SQL is in `persistence`.

    A job that is not understood is left out of lists; every method that gives one raises `NotUnderstood`.
    """

    def add(self, job: Job, idempotency: Idempotency | None = None) -> Job:
        """Store a new job; or, where the key is known with the same fingerprint, return the job it made.

        Raises `IdempotencyConflict`.
        """
        ...

    def get(self, job_id: str) -> Job:
        """Return one job by its id. Raises `NotFound`."""
        ...

    def id_of(self, number: int) -> str:
        """Return the id of the job with a number. Raises `NotFound`."""
        ...

    def headings(self, ids: Sequence[str]) -> dict[str, JobHeading]:
        """Return numbers and procedures of jobs by their ids; an id that no job has is left out."""
        ...

    def numbers(self, ids: Sequence[str]) -> dict[str, int]:
        """Return the numbers of jobs by their ids; an id that no job has is left out."""
        ...

    def list(
        self,
        *,
        state: JobState | None = None,
        procedure: str | None = None,
        unit: str | None = None,
        bench: str | None = None,
        search: Search = EVERYTHING,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[Job]: ...

    def counts(self, states: Collection[JobState] = tuple(JobState)) -> dict[JobState, int]:
        """Return the number of jobs in each of some states; to count ended jobs takes the longer, the longer the
        history is.
        """
        ...

    def has_any(self) -> bool:
        """Return whether the database has any job."""
        ...

    def transition(
        self,
        job_id: str,
        to: JobState,
        *,
        at: datetime,
        verdict: Verdict | None = None,
        failure: Failure | None = None,
        result_id: str | None = None,
    ) -> Job:
        """Change a job's state, with the fields that depend on it (None: as they are), and return the job; a change to
        its present state is a no-op. Raises `IllegalTransition`, `NotFound`.
        """
        ...

    def interrupt(self, job_id: str, at: datetime, failure: Failure) -> None:
        """Interrupt a job that the service cannot resume, with the reason; one to be cancelled is cancelled.

        The job is not read, so it need not be understood.
        """
        ...

    def station_done(self, job_id: str, station: int, at: datetime, data: dict[str, Any]) -> Job:
        """Store that recordings up to and including `station` (index from 0) are complete, and return the job;
        idempotent.
        """
        ...

    def request_cancel(self, job_id: str, at: datetime, by: str = "", reason: str = "") -> Job:
        """Cancel a queued job at once, a running one soon; `NotUnderstood` is raised after that.

        An event keeps author and reason.

        Raises `IllegalTransition` for one that has ended.
        """
        ...

    def cancel_requested(self, job_id: str) -> bool: ...

    def request_pause(self, job_id: str, at: datetime) -> Job:
        """Request a pause: a queued job is paused at once, a running one before its next station.

        Raises `IllegalTransition` for a job that has ended or was interrupted; for a paused one it is a no-op.
        """
        ...

    def put_aside(self, job_id: str, at: datetime) -> Job:
        """Pause a job whose bench was made safe for a pause, and return it; it is requeued where the pause was
        withdrawn.
        """
        ...

    def resume(self, job_id: str, at: datetime) -> Job:
        """Requeue a paused or interrupted job as its next attempt; withdraw a running job's pause request.

        Raises `IllegalTransition` for a job in another state.
        """
        ...

    def note(self, job_id: str, kind: str, at: datetime, data: dict[str, Any]) -> None:
        """Append an event that does not change the job's state, with `data` as its JSON. Raises `NotFound`."""
        ...

    def events(self, job_id: str, after: int = 0, limit: int = 1000) -> tuple[Event, ...]:
        """Return at most `limit` events with a sequence greater than `after`, in order. Raises `NotFound`."""
        ...

    def last_event(self, job_id: str) -> tuple[int, JobState]:
        """Sequence of the newest event, and the state that goes with it, read at one moment. Raises `NotFound`."""
        ...

    def on_event(self, tell: Callable[[str], None]) -> None:
        """Register `tell(job_id)` to be called after each commit of this process that appended an event."""
        ...


@dataclass(frozen=True)
class JobStores(BenchStores):
    """The stores that `jobs` needs, with those of `bench` and the packages below it, as one value."""

    jobs: JobStore
    queue: QueueStore
    reservations: ReservationStore
    manual: ManualStore
