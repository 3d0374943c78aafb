"""The stops of one process on their way into the books, in a thread of its own that may hang in the database."""

import logging
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from queue import Full, Queue
from threading import Lock, Thread

from bench_service.bench.stop.word import StopWord
from bench_service.model.errors import NotFound, ServiceError, StorageFailure
from bench_service.wall_clock import pause

WAITING = 200
"""So many stops may wait for the database; the bench is stopped by the first of them."""
AGAIN_S = 0.5
"""How long it waits before it tries a database again that failed [s]."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Waiting:
    bench_id: str
    word: StopWord
    entered: "Future[str | None]" = field(default_factory=Future)


class StopLedger:
    """Enters stops one after the other, again and again until each is in the books."""

    def __init__(self, enter: Callable[[str, StopWord], str | None]) -> None:
        """`enter`: enters a stop, and gives the job that it ended; raises `NotFound` for no bench, `ServiceError`."""
        self._enter = enter
        self._waiting: Queue[_Waiting] = Queue(WAITING)
        self._starting = Lock()
        self._thread: Thread | None = None
        self.failure = ""
        """Why the books are behind, as last seen; empty: they are not."""

    def enter(self, bench_id: str, word: StopWord) -> "Future[str | None]":
        """Begin to enter a stop; the future has the job that it ended once the books have it, or `NotFound`."""
        waiting = _Waiting(bench_id, word)
        with self._starting:
            if self._thread is None:
                self._thread = Thread(target=self._run, name="stop ledger", daemon=True)
                self._thread.start()
        try:
            self._waiting.put_nowait(waiting)
        except Full:
            waiting.entered.set_exception(StorageFailure(f"{WAITING} stops wait for the database already"))
        return waiting.entered

    def _run(self) -> None:
        while True:
            waiting = self._waiting.get()
            while not self._entered(waiting):
                pause(AGAIN_S)

    def _entered(self, waiting: _Waiting) -> bool:
        """Whether nothing more is to be done for it."""
        try:
            waiting.entered.set_result(self._enter(waiting.bench_id, waiting.word))
        except NotFound as unknown:
            waiting.entered.set_exception(unknown)
        except ServiceError as error:
            if str(error) != self.failure:
                log.warning("a stop of bench %s is not in the books yet: %s", waiting.bench_id, error)
            self.failure = str(error)
            return False
        except Exception as error:  # a defect must not keep the next stop out of the books
            log.exception("a stop of bench %s could not be entered", waiting.bench_id)
            waiting.entered.set_exception(error)
        self.failure = ""
        return True
