"""Signs of life of the processes that answer clients, for the leases of manual mode that are open.

An operator whose service is gone can command nothing, and a table that turns at a rate would keep turning: where no
service counts up a lease's `heard`, the worker ends it (`bench_service.jobs.manual.reader`).
"""

import logging
from threading import Event, Thread

from bench_service.jobs.manual.store import ManualStore
from bench_service.model.errors import ServiceError

BEAT_S = 5.0
"""Interval between two signs of life [s]."""
LEASE_SILENT_S = 20.0
"""Time without one after which a lease ends [s]: several beats of a database that is busy."""

log = logging.getLogger(__name__)


class Presence:
    """Thread of a process that answers clients: writes its heartbeat into every open lease of manual mode, each
    `BEAT_S`.
    """

    def __init__(self, store: ManualStore, beat_s: float = BEAT_S) -> None:
        self._store, self._beat_s = store, beat_s
        self._ending = Event()
        self._thread = Thread(target=self._run, name="manual presence", daemon=True)

    def begin(self) -> None:
        """Start the thread of heartbeats."""
        self._thread.start()

    def end(self) -> None:
        """Stop the thread and wait for it, if it was started."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while not self._ending.wait(self._beat_s):
            try:
                self._store.hear()
            except ServiceError as error:
                log.debug("no heartbeat for manual mode: %s", error)
