"""The worker of a bench: the job engine, loaded and launched beside the first answers of the service.

The engine takes longer to load than everything else together. A service that is asked whether it lives can say so
meanwhile; whoever needs the engine waits for it.
"""

import logging
from collections.abc import Callable, Sequence
from threading import Event, Thread
from typing import Protocol

from bench_service.jobs.errors import NotDriving
from bench_service.jobs.job import Job
from bench_service.jobs.runner import JobRunner

log = logging.getLogger(__name__)


class JobEngine(Protocol):
    """What the worker needs of `bench_service.jobs.engine.Engine`."""

    def launch(self) -> None: ...

    def enqueue(self, job: Job) -> None: ...

    def shut_down(self) -> None: ...


class Worker:
    """Runs the jobs of one bench from `begin` to `shut_down`."""

    def __init__(self, runner: JobRunner, make_engine: Callable[[JobRunner], JobEngine]) -> None:
        self._runner = runner
        self._make_engine = make_engine
        self._engine: JobEngine | None = None
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

    def running_job(self) -> Job | None:
        """The job that drives the bench now."""
        return self._runner.running_job()

    def shut_down(self) -> None:
        """Stop working. The running job is left for the next start; the bench is made safe first."""
        if self._thread is None:
            return
        self._runner.shut_down()
        self._begun.wait()
        if self._engine is not None:
            self._engine.shut_down()

    def _begin(self, then: Sequence[Callable[[], object]]) -> None:
        try:
            engine = self._make_engine(self._runner)
            engine.launch()
            self._engine = engine
        except Exception as failure:  # said to whoever asks, see `require_engine`
            log.exception("the job engine did not start")
            self._failure = failure
        finally:
            self._begun.set()
        for work in then:
            work()
