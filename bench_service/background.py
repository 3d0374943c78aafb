"""Background threads that the process does not wait for at its end, as it would for an executor's."""

from collections.abc import Callable
from concurrent import futures
from concurrent.futures import Future
from contextvars import copy_context
from functools import partial
from queue import Full, Queue
from threading import Lock, Thread
from typing import Generic, TypeVar

T = TypeVar("T")


def in_background(name: str, work: Callable[[], T]) -> "Future[T]":
    """Start `work` in a daemon thread, and return a future with its result or its error.

    Log lines of the thread carry the caller's context.
    """
    outcome: Future[T] = Future()

    def run() -> None:
        try:
            outcome.set_result(work())
        except BaseException as failure:  # raised again where the outcome is read
            outcome.set_exception(failure)

    Thread(target=copy_context().run, args=(run,), name=name, daemon=True).start()
    return outcome


class WorkInOrder:
    """Queue of work that may hang, done piece by piece in one background thread; its length is limited. For any
    thread.
    """

    def __init__(self, name: str, most: int) -> None:
        """Set up with `most`: the number of pieces that may wait."""
        self._name = name
        self._waiting: Queue[tuple[Future[None], Callable[[], None]]] = Queue(most)
        self._starting = Lock()
        self._thread: Thread | None = None

    def add(self, work: Callable[[], None]) -> "Future[None] | None":
        """Queue a piece of work, and return a future that has its error; None where the queue is full."""
        with self._starting:
            if self._thread is None:
                self._thread = Thread(target=self._run, name=self._name, daemon=True)
                self._thread.start()
        outcome: Future[None] = Future()
        try:
            self._waiting.put_nowait((outcome, partial(copy_context().run, work)))
        except Full:
            return None
        return outcome

    def _run(self) -> None:
        while True:
            outcome, work = self._waiting.get()
            try:
                work()
                outcome.set_result(None)
            except Exception as failure:  # raised again where the outcome is read
                outcome.set_exception(failure)


class NonBlockingQuery(Generic[T]):
    """A query that may hang, repeated in a background thread so that the caller is not blocked.

    For a database that hangs: it neither answers nor refuses, and no time limit of its driver helps while the server's
    kernel still takes what is sent. A query is not started again before the one before has returned. For one thread.
    """

    def __init__(self, name: str, query: Callable[[], T]) -> None:
        self._name = name
        self._query = query
        self._running: Future[T] | None = None

    def ask(self, within_s: float) -> T | None:
        """Return the query's answer; None where it takes longer than `within_s` [s]: the next call waits for it again.

        Raises the query's own errors.
        """
        if self._running is None:
            self._running = in_background(self._name, self._query)
        running = self._running
        if not futures.wait((running,), within_s).done:
            return None
        self._running = None
        return running.result()


class BackgroundTasks:
    """Tasks by key, each in a background thread, and the results that were not collected yet. For one thread.

    Nothing survives the process: a task must be safe to start again under the same key.
    """

    def __init__(self, on_done: Callable[[], None]) -> None:
        """Set up with `on_done`, called in any thread when a task ends."""
        self._on_done = on_done
        self._tasks: dict[str, Future[str]] = {}

    def outcome(self, key: str, work: Callable[[], str]) -> str | None:
        """Return the task's result once, None while it runs; start it where it does not. Raises the task's error.

        After the result was returned, the next call starts the task again.
        """
        task = self._tasks.get(key)
        if task is None:
            self._tasks[key] = in_background(f"task {key}", work)
            self._tasks[key].add_done_callback(lambda _: self._on_done())
            return None
        if not task.done():
            return None
        del self._tasks[key]
        return task.result()

    def wait(self, seconds: float) -> None:
        """Wait for running tasks, `seconds` in all; a task that lasts longer ends with the process."""
        futures.wait(self._tasks.values(), seconds)
