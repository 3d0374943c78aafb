"""The runner of a process: claims tasks of batches and has them computed, a few at a time; it needs no bench.

A worker has a name, and a lease on it that falls with its process. Whoever claims tasks also looks for names whose
lease nobody holds: their tasks go back into the queue at once, whichever machine they ran on. A task that a worker
computed and did not note is claimed again and finds its result by its content, so nothing is lost and nothing is stored
twice.
"""

import logging
from collections.abc import Callable
from contextlib import suppress
from datetime import timedelta
from threading import Event, Lock, Thread, get_ident
from typing import Protocol

from bench_service.evidence.admission import SPARE_BYTES, available_bytes
from bench_service.evidence.analyses import AnalysisRequest, AnalysisService
from bench_service.evidence.batches.store import BatchStore
from bench_service.model.batches import ClaimedTask, TaskState
from bench_service.model.errors import Overloaded, ServiceError, StorageFailure, StorageFull, UnfitValue
from bench_service.model.job import Failure
from bench_service.telemetry.defects import described
from bench_service.wall_clock import monotonic_s, now
from procedures.core.errors import DomainError

MOST_ATTEMPTS = 4
"""Number of claims after which a task has failed, where a transient failure or the end of its worker ended each."""
RETRY_PAUSES_S = (2.0, 10.0, 60.0)
"""Pause before the second, third, fourth attempt after a failure that may pass [s]."""
LOOK_S = 1.0
"""Interval at which an idle worker looks for tasks that other processes queued [s]."""
LEAVE_S = 2.0
"""Time that the tasks under way get when their worker is ended in order [s]."""
REST_S = 60.0
"""Time without a task after which the processes of analysis are ended [s]."""
ORPHANS_S = 3.0
"""Interval at which a worker looks for tasks of dead workers [s]."""
PASSING = (Overloaded, StorageFailure, StorageFull)
"""Failures that may pass: the database was away, its disk full, a process of analysis was killed."""

log = logging.getLogger(__name__)


class WorkerName(Protocol):
    """A worker's name, with the lease on it that this process holds. Interface."""

    @property
    def name(self) -> str:
        """The name that this process holds."""
        ...

    def held(self) -> bool:
        """Return whether this process still holds the lease of its name."""
        ...

    def release(self) -> None:
        """Give the name back."""
        ...


class WorkerNames(Protocol):
    """Names of workers, each held by one process at most. Interface; see `persistence/evidence/worker_names.py`."""

    def take(self) -> WorkerName:
        """Take the first name that no process holds, and return it. Raises `Overloaded` where all are taken,
        `StorageFailure`.
        """
        ...

    def alive(self, name: str) -> bool:
        """Return whether a process holds the name."""
        ...


Compute = Callable[[AnalysisRequest], tuple[str, bool]]
"""Computes an analysis: the id of its result, and whether a stored one was taken. Raises its refusals."""


class BatchRunner:
    """Claims and runs tasks of batches in `at_once` threads, each of which waits for one computation."""

    def __init__(
        self,
        batches: BatchStore,
        names: WorkerNames,
        compute: Compute,
        at_once: int,
        resumes: bool = True,
        rest: Callable[[], object] = lambda: None,
        look_s: float = LOOK_S,
    ) -> None:
        """Set up with `resumes`: False where it begins only once this process itself has queued a batch.

        `rest`: called once no task has run for `REST_S`, for example to end idle processes.
        """
        self._batches = batches
        self._names = names
        self._compute = compute
        self._at_once = at_once
        self.resumes = resumes
        self._rest = rest
        self._look_s = look_s
        self._wake = Event()
        self._ending = Event()
        self._mutex = Lock()
        self._name: WorkerName | None = None
        self._threads: list[Thread] = []
        self._looked_s: float | None = None
        self._under_way: dict[int, ClaimedTask] = {}
        """Claimed tasks by the thread that runs them."""
        self._rested_s: float | None = None
        """Time of the last task's end; None while there is nothing to rest from."""

    def begin(self) -> None:
        """Start the threads that claim tasks; a second call does nothing."""
        with self._mutex:
            if self._threads or self._ending.is_set():
                return
            self._threads = [
                Thread(target=self._run, name=f"analyses {number}", daemon=True) for number in range(self._at_once)
            ]
        for thread in self._threads:
            thread.start()

    def wake(self) -> None:
        """Have the threads look for tasks now; starts them where they have not been started."""
        self.begin()
        self._wake.set()

    def end(self, within_s: float = LEAVE_S) -> None:
        """Claim no more tasks, and wait for those under way, within a limit; what is not done in time goes back into
        the queue.
        """
        self._ending.set()
        self._wake.set()
        deadline = monotonic_s() + within_s
        for thread in self._threads:
            thread.join(max(0.0, deadline - monotonic_s()))
        with self._mutex:
            name, left = self._name, list(self._under_way.values())
        if name is None:
            return
        ended = Failure("WorkerEnded", "its worker was ended in order while it ran")
        with suppress(ServiceError):  # else another worker finds that the name is free
            for task in left:
                self._batches.put_back(task, name.name, None, ended, spent=False)
        name.release()

    def _run(self) -> None:
        while not self._ending.is_set():
            try:
                if not self._one():
                    self._rest_if_idle()
                    self._wake.wait(self._look_s)
                    self._wake.clear()
            except ServiceError as error:
                log.warning("no task can be claimed yet: %s", error)
                self._ending.wait(self._look_s)
            except Exception:  # a thread that ended would leave its place empty for good
                log.exception("the runner of analyses")
                self._ending.wait(self._look_s)

    def _one(self) -> bool:
        """Claim and run the next task; False where there is none, or no memory for it."""
        name = self._own_name()
        self._put_orphans_back(name)
        free = available_bytes()
        if free is not None and free < SPARE_BYTES:
            return False
        task = self._batches.claim(name, now())
        if task is None:
            return False
        with self._mutex:
            self._under_way[get_ident()] = task
        try:
            self._finish(task, name)
        finally:
            with self._mutex:
                del self._under_way[get_ident()]
                self._rested_s = monotonic_s()
        return True

    def _finish(self, task: ClaimedTask, name: str) -> None:
        state, result, failure = self._outcome(task)
        if failure is not None and state is TaskState.WAITING:
            due = now() + timedelta(seconds=RETRY_PAUSES_S[min(task.attempt, len(RETRY_PAUSES_S)) - 1])
            self._persist(lambda: self._batches.put_back(task, name, due, failure))
        else:
            self._persist(lambda: self._batches.end(task, name, state, now(), result, failure))

    def _outcome(self, task: ClaimedTask) -> tuple[TaskState, str | None, Failure | None]:
        request = AnalysisRequest(task.method, task.recordings, task.calibrations, task.parameters)
        try:
            result, taken = self._compute(request)
        except UnfitValue as refused:
            return TaskState.FAILED, None, Failure(type(refused).__name__, str(refused))
        except PASSING as passing:
            again = task.attempt < MOST_ATTEMPTS
            failure = Failure(type(passing).__name__, str(passing))
            return TaskState.WAITING if again else TaskState.FAILED, None, failure
        except (DomainError, ServiceError) as refused:
            return TaskState.FAILED, None, Failure(type(refused).__name__, str(refused))
        except Exception as defect:
            log.exception("task %d of batch %s", task.number, task.batch)
            return TaskState.FAILED, None, Failure("InternalError", described(defect))
        return TaskState.REUSED if taken else TaskState.DONE, result, None

    def _persist(self, note: Callable[[], bool]) -> None:
        """Write a task's end, again while the database is away; what cannot be written falls with this worker's name.

        While it is tried this thread claims nothing.
        """
        while True:
            try:
                if not note():
                    log.warning("another worker has claimed a task of this worker meanwhile: the result is kept")
                return
            except ServiceError as error:
                log.warning("the end of a task cannot be written yet: %s", error)
            if self._ending.wait(self._look_s):
                return

    def _rest_if_idle(self) -> None:
        with self._mutex:
            since = self._rested_s
            if self._under_way or since is None or monotonic_s() - since < REST_S:
                return
            self._rested_s = None
            self._rest()

    def _own_name(self) -> str:
        """This worker's name; a new one where its lease was lost with the database. Its old tasks are put back."""
        with self._mutex:
            if self._name is not None and not self._name.held():
                self._name.release()
                self._name = None
            if self._name is None:
                self._name = self._names.take()
                self._batches.orphaned(self._name.name, MOST_ATTEMPTS, now())
            return self._name.name

    def _put_orphans_back(self, own: str) -> None:
        with self._mutex:
            if self._looked_s is not None and monotonic_s() - self._looked_s < ORPHANS_S:
                return
            self._looked_s = monotonic_s()
        for name in self._batches.claimants():
            if name != own and not self._names.alive(name):
                number = self._batches.orphaned(name, MOST_ATTEMPTS, now())
                log.warning("worker %s ended: %d of its analyses are put back", name, number)


RunnerMaker = Callable[[BatchStore, AnalysisService], BatchRunner]
"""Builds the runner of a service's process."""
