"""The dispatcher of a bench: claims the next eligible job of its queue, runs it, and recovers orphaned jobs.

The queue is the service's own jobs table. A job is claimed in one transaction (it is running from then on, and no bench
has two running jobs), and its durable workflow begins at once. Jobs orphaned by a crash are recovered whenever the
queue is read, so that no job stays running without a process that runs it:

- claimed, and the process died before its workflow was written: back into its place in the queue;
- its workflow is this engine's and unfinished: the engine resumes it by itself, and the dispatcher waits;
- its workflow is of another version, or the engine gave it up: the job is interrupted, with the reason.

A job that this version does not understand is interrupted too, and blocks no other job.

While the bench's lease is lost (the database was restarted) nothing is claimed, and the dispatcher tries to regain it.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event, Thread
from typing import Protocol

from bench_service.bench.driven import ShuttingDown
from bench_service.bench.driver import Lease
from bench_service.jobs.manual.runner import ManualRunner
from bench_service.jobs.queue import BenchQueue, QueueEntry
from bench_service.jobs.runner import JobRunner
from bench_service.jobs.stores import JobStores
from bench_service.model.errors import NotFound, NotUnderstood, ServiceError
from bench_service.model.job import Failure, Job
from bench_service.model.manual import ManualLease
from bench_service.wall_clock import monotonic_s, now

RETRY_S = 0.5
"""Time that the dispatcher waits after a failure of the database or the engine [s]."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Unfinished:
    """State of a running job's workflow in the job engine. Neither field set: it never began."""

    alive: bool = False
    """True where the engine resumes the workflow."""
    gone: Failure | None = None
    """The reason why the workflow will not continue."""


class JobEngine(Protocol):
    """The part of `bench_service.jobs.engine.Engine` that the dispatcher uses. Interface."""

    def launch(self) -> None:
        """Start working on jobs; unfinished jobs of a dead process resume. The bench's lease must be held."""
        ...

    def run(self, job: Job) -> None:
        """Run a claimed job, and block until it has ended. Raises `ShuttingDown`, and any failure that keeps it from
        running.
        """
        ...

    def unfinished(self, job: QueueEntry) -> Unfinished:
        """Return the state of a running job's workflow, for a job that another process left."""
        ...

    def shut_down(self) -> None:
        """Stop working, and wait until the running job has left the bench safe; it resumes after the next start."""
        ...


class Dispatcher:
    """Claims the jobs of one bench from its queue and runs them one after the other, in a thread of its own."""

    def __init__(
        self,
        bench_id: str,
        stores: JobStores,
        runner: JobRunner,
        engine: JobEngine,
        lease: Lease,
        poll_s: float,
        stopped: Callable[[], bool] = lambda: False,
        manual: ManualRunner | None = None,
    ) -> None:
        """Set up to look at the queue every `poll_s` seconds for jobs that other processes put there.

        `stopped`: returns whether the bench is stopped over its host's stop channel; the database may not know yet.
        `manual`: runs leases of manual mode; None: they wait.
        """
        self._stopped = stopped
        self._manual = manual
        self._bench_id = bench_id
        self._stores = stores
        self._runner = runner
        self._engine = engine
        self._lease = lease
        self._poll_s = poll_s
        self._wake = Event()
        self._ending = Event()
        self._told: tuple[str, str] | None = None
        self._running = False
        self._worked_s = monotonic_s()
        self._thread = Thread(target=self._run, name=f"dispatcher {bench_id}", daemon=True)

    def begin(self) -> None:
        """Start the thread that claims and runs jobs. The engine must be launched."""
        self._thread.start()

    def wake(self) -> None:
        """Have the thread look at the bench's queue now, and at the lease of manual mode that runs. Never waits."""
        if self._manual is not None:
            self._manual.wake()
        self._wake.set()

    def resting_s(self) -> float:
        """Time since a job ran here, or since this began [s]; 0 while one runs."""
        return 0.0 if self._running else monotonic_s() - self._worked_s

    def lease_held(self) -> bool:
        """Return whether this process holds the bench's lease now."""
        return self._lease.held()

    def shut_down(self) -> None:
        """Claim no more jobs, and end manual mode, waiting until its bench is safe. The engine ends the running job."""
        self._ending.set()
        self._wake.set()
        if self._manual is not None:
            self._manual.shut_down()

    def _run(self) -> None:
        while not self._ending.is_set():
            try:
                if not self._one():
                    self._wake.wait(self._poll_s)
                    self._wake.clear()
            except ServiceError as error:
                log.warning("bench %s cannot take its next job yet: %s", self._bench_id, error)
                self._ending.wait(RETRY_S)
            except ShuttingDown:
                return
            except Exception:  # of the engine's own database; a dispatcher that ended would strand every job
                log.exception("the dispatcher of bench %s", self._bench_id)
                self._ending.wait(RETRY_S)

    def _one(self) -> bool:
        """Claim and run the next job, or interrupt it; False where nothing was done."""
        if not self._lease.held() and not self._lease.regain():
            return False
        queue = self._stores.queue.front(self._bench_id, now())
        if queue.running is not None:
            self._settle()
            return False
        if queue.manual is not None:
            self._tell(queue)
            return self._run_manual(queue.manual)
        entry = queue.next()
        self._tell(queue)
        if entry is None or self._stopped():
            return False
        try:
            job = self._runner.claim(entry)
        except (NotUnderstood, NotFound) as error:  # its unit or a part of its record is not known
            self._interrupt(entry.id, Failure(type(error).__name__, str(error)))
            return True
        if job is None:
            return False
        self._running = True
        try:
            self._engine.run(job)
        finally:
            self._worked_s = monotonic_s()
            self._running = False
        return True

    def _run_manual(self, lease: ManualLease) -> bool:
        if self._manual is None:
            return False
        self._running = True
        try:
            return self._manual.run(lease)
        finally:
            self._worked_s = monotonic_s()
            self._running = False

    def _settle(self) -> None:
        """Recover the bench's running job where its workflow does not continue: requeue or interrupt it."""
        job = self._stores.queue.running(self._bench_id)
        if job is None or self._ending.is_set():
            return
        found = self._engine.unfinished(job)
        now_running = self._stores.queue.running(self._bench_id)
        if found.alive or now_running is None or (now_running.id, now_running.attempt) != (job.id, job.attempt):
            return  # it continues, or it ended or was requeued between the two reads
        why = self._not_understood(job.id) or found.gone
        if why is None:
            never = Failure("NeverBegan", "the service ended after it had chosen this job and before it began")
            self._stores.queue.requeue(job.id, now(), None, never, spend=False)
        else:
            self._interrupt(job.id, why)

    def _not_understood(self, job_id: str) -> Failure | None:
        """The reason why this version could not resume a job, whatever its workflow's state; None where it could."""
        try:
            self._stores.jobs.get(job_id)
        except NotUnderstood as error:
            return Failure(type(error).__name__, str(error))
        return None

    def _interrupt(self, job_id: str, why: Failure) -> None:
        log.warning("job %s is interrupted: %s: %s", job_id, why.kind, why.message)
        self._stores.jobs.interrupt(job_id, now(), why)

    def _tell(self, queue: BenchQueue) -> None:
        """Note in the events of the queue's first job why it does not start, once for each reason."""
        head: QueueEntry | None = queue.entries[0] if queue.entries else None
        held = bool(queue.stops or queue.reservations or queue.manual is not None)
        why = queue.hold(head) if head is not None and held else None
        if head is None or why is None or self._told == (head.id, why):
            return
        self._stores.jobs.note(head.id, "note", now(), {"text": why})
        self._told = (head.id, why)
