"""Analyses and drawings in separate processes, so that the one that drives a bench and answers a stop stays free.

A few processes at a low priority, which end without work for a while. A refusal by the work is raised here as the same
error; work that is cut off, because its process died, may be requested again.
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
from threading import BoundedSemaphore, Lock, Thread, Timer
from typing import Any

from bench_service.model.errors import Overloaded, ServiceError, StorageFailure
from procedures.core.errors import DomainError

AT_ONCE = 2
"""Number of processes, and so of pieces of work at one time."""
NICENESS = 10
"""Niceness of these processes: they give way to driving a bench and to answering requests."""

IDLE_S = 300.0
"""Time without work after which the processes end [s, real time]: a person who reads results asks again before that."""
WAITING = 16
"""Maximum number of pieces of work under way or waiting; each holds a thread of the service."""

Run = Callable[[str, tuple[Any, ...]], str]
"""Runs a piece of work by its name and arguments, and returns a text: the id of a stored result, or a drawing."""


@dataclass(frozen=True)
class Refusal:
    """An error in picklable parts, on its way to another process: errors with arguments of their own cannot be pickled
    as they are.
    """

    kind: type[Exception]
    arguments: tuple[Any, ...]
    fields: dict[str, Any]

    @classmethod
    def of(cls, error: Exception) -> "Refusal":
        """Return the picklable parts of an error."""
        return cls(type(error), error.args, dict(vars(error)))

    def error(self) -> Exception:
        """Return the original error, rebuilt from its parts."""
        made = self.kind.__new__(self.kind)
        made.args = self.arguments
        vars(made).update(self.fields)
        return made


class WorkProcesses:
    """Worker processes of one service, begun with the first piece of work. For any thread."""

    def __init__(
        self,
        open_run: Callable[..., Run],
        *arguments: Any,
        at_once: int = AT_ONCE,
        waiting: int = WAITING,
        idle_s: float = IDLE_S,
    ) -> None:
        """Set up with `open_run`, called with `arguments` in each new process: an importable module's function."""
        self._at_once = at_once
        self._waiting = waiting
        self._open_run = open_run
        self._arguments = arguments
        self._mutex = Lock()
        self._places = BoundedSemaphore(waiting)
        self._pool: ProcessPoolExecutor | None = None
        self._idle_s = idle_s
        self._under_way = 0
        self._timer: Timer | None = None

    def begin(self) -> None:
        """Begin the processes before the first piece of work is there; does not wait for them."""
        with self._mutex:
            if self._pool is None:
                self._begun().submit(_nothing)
                self._time_idleness()

    def result(self, name: str, *arguments: Any) -> str:
        """Run a piece of work in a process, wait for it, and return its text. Raises its errors, `StorageFailure` where
        it is cut off, and `Overloaded` where too much work is waiting already.
        """
        if not self._places.acquire(blocking=False):
            raise Overloaded(f"{self._waiting} such requests are running or waiting already: try again later")
        try:
            found = self._submit(name, arguments).result()
        except BrokenProcessPool as broken:
            with self._mutex:
                self._pool = None
            raise StorageFailure("the process that did this work ended before it had finished: try again") from broken
        finally:
            self._over()
            self._places.release()
        if isinstance(found, Refusal):
            raise found.error()
        return found

    def close(self) -> None:
        """End the worker processes; work that is under way is cut off."""
        with self._mutex:
            pool, self._pool = self._pool, None
            self._cancel_timer()
        if pool is not None:
            processes = list(getattr(pool, "_processes", {}).values())
            for process in processes:
                process.terminate()
            pool.shutdown(wait=True, cancel_futures=True)

    def _submit(self, name: str, arguments: tuple[Any, ...]) -> "Future[str | Refusal]":
        with self._mutex:
            self._under_way += 1
            self._cancel_timer()
            return self._begun().submit(_work, name, arguments)

    def _begun(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            given = (self._open_run, self._arguments)
            self._pool = ProcessPoolExecutor(self._at_once, context, _begin, given)
        return self._pool

    def _over(self) -> None:
        """Note the end of a piece of work; the last one begins the time without work."""
        with self._mutex:
            self._under_way -= 1
            if self._under_way == 0 and self._pool is not None:
                self._time_idleness()

    def _time_idleness(self) -> None:
        self._cancel_timer()
        self._timer = Timer(self._idle_s, self._end_if_idle)
        self._timer.daemon = True
        self._timer.start()

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _end_if_idle(self) -> None:
        with self._mutex:
            if self._under_way:
                return
            pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown()


@dataclass(frozen=True)
class WorkApart:
    """The work processes of a service: those for analyses, and those for printed reports."""

    analyses: WorkProcesses
    printing: WorkProcesses


_run: list[Run] = []


def _begin(open_run: Callable[..., Run], arguments: tuple[Any, ...]) -> None:
    """Set up a new process: leave interrupts to the service, open what the work needs, then lower the priority."""
    begin_process()
    _run.append(open_run(*arguments))
    with contextlib.suppress(OSError):  # only now: a client waits for the first piece of work
        os.nice(NICENESS)


def begin_process() -> None:
    """Set up a new process of the service: it leaves interrupts to the service, and ends with it."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    Thread(target=_end_with_the_service, name="end with the service", daemon=True).start()


def _nothing() -> None:
    """No piece of work: a process begins for it."""


def _work(name: str, arguments: tuple[Any, ...]) -> str | Refusal:
    try:
        return _run[0](name, arguments)
    except (DomainError, ServiceError) as refused:
        return Refusal.of(refused)
    except Exception as defect:
        return Refusal.of(RuntimeError("".join(traceback.format_exception(defect))))


def _end_with_the_service() -> None:
    """End this process with the service: one that was killed does not end its processes itself."""
    service = multiprocessing.parent_process()
    if service is not None:
        service.join()
        os._exit(1)
