"""The worker of a bench: the job engine, loaded and launched beside the service's first answers, and its dispatcher.

The engine takes longer to load than everything else together. A service that is asked whether it lives can say so
meanwhile; jobs that are submitted meanwhile wait in the queue.
"""

import logging
from collections.abc import Callable, Sequence
from threading import Event, Thread
from typing import Protocol

from bench_service.jobs.dispatcher import JobEngine
from bench_service.jobs.runner import JobRunner
from bench_service.model.errors import NotDriving
from bench_service.model.job import Job

log = logging.getLogger(__name__)


class JobDispatcher(Protocol):
    """What the worker needs of `bench_service.jobs.dispatcher.Dispatcher`."""

    def begin(self) -> None: ...

    def wake(self) -> None: ...

    def lease_held(self) -> bool: ...

    def shut_down(self) -> None: ...


class Worker:
    """Runs the jobs of one bench from `begin` to `shut_down`."""

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
        self._failure: Exception | None = None
        self._begun = Event()
        self._thread: Thread | None = None

    def begin(self, then: Sequence[Callable[[], object]]) -> None:
        """Load and launch the engine in a thread of its own, then do what can wait."""
        self._thread = Thread(target=self._begin, args=(then,), name="worker", daemon=True)
        self._thread.start()

    def require_engine(self) -> JobEngine:
        """The engine, once it runs. Raises `NotDriving` with the reason where it did not start."""
        self._begun.wait()
        if self._engine is None:
            raise NotDriving(f"the job engine did not start: {self._failure}")
        return self._engine

    def troubles(self) -> list[str]:
        """Why a job could not start on this bench now; waits for the engine after a start."""
        try:
            self.require_engine()
        except NotDriving as reason:
            return [str(reason)]
        if self._dispatcher is not None and not self._dispatcher.lease_held():
            return ["the bench's lease is lost: another process may drive it"]
        return []

    def wake(self) -> None:
        """There may be something to do: a job was queued, a bench released."""
        if self._dispatcher is not None:
            self._dispatcher.wake()

    def running_job(self) -> Job | None:
        """The job whose bench is open in this process."""
        return self._runner.running_job()

    def shut_down(self) -> None:
        """Stop working. The running job is left for the next start; the bench is made safe first."""
        if self._thread is None:
            return
        self._runner.shut_down()
        self._begun.wait()
        if self._dispatcher is not None:
            self._dispatcher.shut_down()
        if self._engine is not None:
            self._engine.shut_down()

    def _begin(self, then: Sequence[Callable[[], object]]) -> None:
        try:
            engine = self._make_engine(self._runner)
            engine.launch()
            self._dispatcher = self._make_dispatcher(self._runner, engine)
            self._dispatcher.begin()
            self._engine = engine
        except Exception as failure:  # said to whoever asks, see `require_engine`
            log.exception("the job engine did not start")
            self._failure = failure
        finally:
            self._begun.set()
        for work in then:
            work()
