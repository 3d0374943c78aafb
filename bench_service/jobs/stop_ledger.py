"""Enters the stops of one process into the database, in a thread of its own that may hang there."""

import logging
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from queue import Full, Queue
from threading import Lock, Thread

from bench_service.bench.stop.word import StopWord
from bench_service.model.errors import NotFound, ServiceError, StorageFailure, TooManyStops
from bench_service.wall_clock import pause

WAITING = 200
"""Maximum number of stops that wait for the database; the first one stops the bench."""
AGAIN_S = 0.5
"""Time between two attempts at a database that failed [s]."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Waiting:
    bench_id: str
    word: StopWord
    entered: "Future[str | None]" = field(default_factory=Future)


class StopLedger:
    """Thread that enters stops into the database one after the other, and retries each until the database has it."""

    def __init__(self, enter: Callable[[str, StopWord], str | None]) -> None:
        """Set up with `enter`: enters a stop, returns the job that it ended; raises `NotFound`, `ServiceError`."""
        self._enter = enter
        self._waiting: Queue[_Waiting] = Queue(WAITING)
        self._starting = Lock()
        self._thread: Thread | None = None
        self.failure = ""
        """The last reason why the database lacks a stop; empty: it lacks none."""

    def enter(self, bench_id: str, word: StopWord) -> "Future[str | None]":
        """Begin to enter a stop; the future has the job that it ended once the database has it, or `NotFound`."""
        waiting = _Waiting(bench_id, word)
        with self._starting:
            if self._thread is None:
                self._thread = Thread(target=self._run, name="stop ledger", daemon=True)
                self._thread.start()
        try:
            self._waiting.put_nowait(waiting)
        except Full:
            waiting.entered.set_exception(StorageFailure(f"{WAITING} stops are waiting for the database already"))
        return waiting.entered

    def _run(self) -> None:
        while True:
            waiting = self._waiting.get()
            while not self._entered(waiting):
                pause(AGAIN_S)

    def _entered(self, waiting: _Waiting) -> bool:
        """Enter one waiting stop; True where no retry is needed."""
        try:
            waiting.entered.set_result(self._enter(waiting.bench_id, waiting.word))
        except (NotFound, TooManyStops) as refused:
            waiting.entered.set_exception(refused)
        except ServiceError as error:
            if str(error) != self.failure:
                log.warning("a stop of bench %s is not in the database yet: %s", waiting.bench_id, error)
            self.failure = str(error)
            return False
        except Exception as error:  # a defect must not keep the next stop out of the database
            log.exception("a stop of bench %s could not be entered", waiting.bench_id)
            waiting.entered.set_exception(error)
        self.failure = ""
        return True
