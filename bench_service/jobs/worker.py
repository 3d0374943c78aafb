"""The worker of a bench: its dispatcher, and the job engine, which is launched while the service already answers.

The engine takes longer to load than everything else together. Until then the service answers liveness checks, and
submitted jobs wait in the queue.
"""

import logging
from collections.abc import Callable, Sequence
from threading import Event, Lock, Thread
from typing import Protocol

from bench_service.jobs.dispatcher import JobEngine
from bench_service.jobs.runner import JobRunner
from bench_service.model.errors import NotDriving, ServiceError
from bench_service.model.job import Job

START_S = 60.0
"""Time that the engine may take to start [s]; loaded from a slow disk by a busy machine it takes ten."""
REST_S = 1.0
"""Time without a job after which work that can wait is done [s]: it would hold the interpreter against a job."""
LOOK_S = 0.1
"""Interval between checks whether a job runs, while such work waits [s]."""
LEAVE_S = 10.0
"""Time that a service that ends waits for an engine that is still starting [s]."""

log = logging.getLogger(__name__)


class JobDispatcher(Protocol):
    """The part of `bench_service.jobs.dispatcher.Dispatcher` that the worker uses. Interface."""

    def begin(self) -> None: ...

    def wake(self) -> None: ...

    def resting_s(self) -> float: ...

    def lease_held(self) -> bool: ...

    def shut_down(self) -> None: ...


class Worker:
    """Runs the jobs of one bench from `begin` to `shut_down`: launches the job engine, then the dispatcher."""

    def __init__(
        self,
        runner: JobRunner,
        make_engine: Callable[[JobRunner], JobEngine],
        make_dispatcher: Callable[[JobRunner, JobEngine], JobDispatcher],
    ) -> None:
        self._runner = runner
        self._make_engine = make_engine
        self._make_dispatcher = make_dispatcher
        self._engine: JobEngine | None = None
        self._dispatcher: JobDispatcher | None = None
        self._failure: str | None = None
        self._begun = Event()
        self._ending = Event()
        self._deciding = Lock()
        self._thread: Thread | None = None
        self._at_failure: Callable[[], object] = lambda: None

    def at_failed_start(self, then: Callable[[], object]) -> None:
        """Have `then` called, in another thread, where the engine does not start. Call before `begin`."""
        self._at_failure = then

    def begin(self, then: Sequence[Callable[[], object]]) -> None:
        """Load and launch the engine in a thread of its own, then run the work that can wait.

        Each piece of that work begins when no job has run for `REST_S`.
        """
        self._thread = Thread(target=self._begin, args=(then,), name="worker", daemon=True)
        self._thread.start()
        Thread(target=self._give_up, name="engine's launch limit", daemon=True).start()

    def require_engine(self) -> JobEngine:
        """Wait until the engine runs, and return it. Raises `NotDriving` with the reason where it did not start."""
        self._begun.wait()
        if self._engine is None:
            raise NotDriving(self._failure)
        return self._engine

    def failed_start(self) -> NotDriving | None:
        """Return the reason why the engine did not start; None where it runs, or may yet."""
        return None if self._failure is None else NotDriving(self._failure)

    def troubles(self) -> list[str]:
        """Return the reasons why a job could not start on this bench now, a sentence each; waits for the engine after a
        start.
        """
        try:
            self.require_engine()
        except NotDriving as reason:
            return [str(reason)]
        if self._dispatcher is not None and not self._dispatcher.lease_held():
            return ["the bench's lease is lost: another process may drive it"]
        return []

    def wake(self) -> None:
        """Have the dispatcher look at the queue now, because a job was queued or a bench released."""
        if self._dispatcher is not None:
            self._dispatcher.wake()

    def running_job(self) -> Job | None:
        """Return the job whose session is open in this process; None where there is none."""
        return self._runner.running_job()

    def shut_down(self) -> None:
        """Stop the bench's worker, and wait until the bench is safe. The running job resumes after the next start."""
        if self._thread is None:
            return
        self._ending.set()
        self._runner.shut_down()
        if not self._begun.wait(LEAVE_S):
            self._fail("the service ended before its job engine had started")
        if self._dispatcher is not None:
            self._dispatcher.shut_down()
        if self._engine is not None:
            self._engine.shut_down()

    def _begin(self, then: Sequence[Callable[[], object]]) -> None:
        try:
            engine = self._make_engine(self._runner)
            engine.launch()
            dispatcher = self._make_dispatcher(self._runner, engine)
        except Exception as failure:  # reported to callers of `require_engine`
            log.debug("the job engine did not start", exc_info=failure)
            self._fail(f"the job engine did not start: {_sentence(failure)}")
            return
        with self._deciding:
            late = self._begun.is_set()
            if not late:
                dispatcher.begin()
                self._dispatcher, self._engine = dispatcher, engine
                self._begun.set()
        if late:
            engine.shut_down()
            return
        for work in then:
            while dispatcher.resting_s() < REST_S:
                if self._ending.wait(LOOK_S):
                    return
            work()

    def _give_up(self) -> None:
        if not self._begun.wait(START_S):
            self._fail(f"the job engine did not start within {START_S:g} s")

    def _fail(self, why: str) -> None:
        with self._deciding:
            if self._begun.is_set():
                return
            self._failure = why
            self._begun.set()
        self._at_failure()


def _sentence(failure: Exception) -> str:
    """A failure in one line: the message of a service error; of any other error its class and message."""
    words = " ".join(str(failure).split())
    return words if isinstance(failure, ServiceError) else f"{type(failure).__name__}: {words}"
