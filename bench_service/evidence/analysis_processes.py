"""Analyses in processes of their own, beside the one that drives a bench and the one that answers a stop.

A few processes at a low priority, each with a connection of its own to the database. What an analysis refuses is the
same error here; one that is cut off, because its process died, may be asked for again.
"""

import contextlib
import multiprocessing
import os
import signal
import traceback
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from threading import BoundedSemaphore, Lock, Thread
from typing import Any

from bench_service.model.errors import Overloaded, ServiceError, StorageFailure
from procedures.core.errors import DomainError

AT_ONCE = 2
"""Analyses that are worked out at one time."""
NICENESS = 10
"""By so much they give way to whoever drives a bench or answers."""

WAITING = 16
"""So many analyses may be worked out or wait at one time; each holds a thread of the service."""

Run = Callable[[str, tuple[Any, ...]], str]
"""Works out an analysis by its name and arguments, and gives the id of its stored result."""


@dataclass(frozen=True)
class Refusal:
    """An error on its way to another process: errors with arguments of their own cannot be pickled as they are."""

    kind: type[Exception]
    arguments: tuple[Any, ...]
    fields: dict[str, Any]

    @classmethod
    def of(cls, error: Exception) -> "Refusal":
        """Everything that an error is made of."""
        return cls(type(error), error.args, dict(vars(error)))

    def error(self) -> Exception:
        """The error that it was."""
        made = self.kind.__new__(self.kind)
        made.args = self.arguments
        vars(made).update(self.fields)
        return made


class AnalysisProcesses:
    """The processes of one service, begun with the first analysis. For any thread."""

    def __init__(self, open_run: Callable[..., Run], *arguments: Any) -> None:
        """`open_run`: called with `arguments` in each new process, a function of a module that both can import."""
        self._open_run = open_run
        self._arguments = arguments
        self._mutex = Lock()
        self._places = BoundedSemaphore(WAITING)
        self._pool: ProcessPoolExecutor | None = None

    def result(self, name: str, *arguments: Any) -> str:
        """The id of the result of an analysis. Raises what the analysis raises, `StorageFailure` where it is cut off,
        and `Overloaded` where too many are waited for already.
        """
        if not self._places.acquire(blocking=False):
            raise Overloaded(f"{WAITING} analyses are worked out or wait already: ask again later")
        try:
            found = self._submit(name, arguments).result()
        except BrokenProcessPool as broken:
            with self._mutex:
                self._pool = None
            raise StorageFailure("the process of this analysis ended before it was done: ask again") from broken
        finally:
            self._places.release()
        if isinstance(found, Refusal):
            raise found.error()
        return found

    def close(self) -> None:
        """End the processes; an analysis that is under way is cut off."""
        with self._mutex:
            pool, self._pool = self._pool, None
        if pool is not None:
            processes = list(getattr(pool, "_processes", {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.terminate()

    def _submit(self, name: str, arguments: tuple[Any, ...]) -> "Future[str | Refusal]":
        with self._mutex:
            if self._pool is None:
                context = multiprocessing.get_context("spawn")
                given = (self._open_run, self._arguments)
                self._pool = ProcessPoolExecutor(AT_ONCE, context, _begin, given)
            return self._pool.submit(_work, name, arguments)


_run: list[Run] = []


def _begin(open_run: Callable[..., Run], arguments: tuple[Any, ...]) -> None:
    """In a new process: give way to others, leave an interrupt to the service, and open what analyses need."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.nice(NICENESS)
    Thread(target=_end_with_the_service, name="end with the service", daemon=True).start()
    _run.append(open_run(*arguments))


def _work(name: str, arguments: tuple[Any, ...]) -> str | Refusal:
    try:
        return _run[0](name, arguments)
    except (DomainError, ServiceError) as refused:
        return Refusal.of(refused)
    except Exception as defect:
        return Refusal.of(RuntimeError("".join(traceback.format_exception(defect))))


def _end_with_the_service() -> None:
    """A service that was killed ends nothing: its processes must notice."""
    service = multiprocessing.parent_process()
    if service is not None:
        service.join()
        os._exit(1)
