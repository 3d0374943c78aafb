"""Reads a lease that runs and writes what becomes of its demands, in a thread of its own.

A database that hangs holds neither the bench nor the end of the lease's time. After `HANGS_S` without an answer of it
the lease ends; so it does where no process that answers clients has given a sign of life for `LEASE_SILENT_S`.
"""

import logging
from queue import SimpleQueue
from threading import Event, Lock, Thread

from bench_service.bench.driven import HANGS_S
from bench_service.jobs.manual.presence import LEASE_SILENT_S
from bench_service.jobs.manual.session import ManualSession
from bench_service.jobs.manual.store import LeaseNews, ManualStore
from bench_service.model.errors import ServiceError
from bench_service.model.manual import Answer, DemandState, ManualDemand
from bench_service.wall_clock import monotonic_s, now

LOOK_S = 0.2
"""Interval between two looks at the lease where nobody wakes this process [s]."""

log = logging.getLogger(__name__)


class LeaseReader:
    """Thread that reads the demands of one lease from the database for a session, and writes their outcomes back, until
    `end`.
    """

    def __init__(self, store: ManualStore, lease_id: str, wake: Event) -> None:
        self._store, self._lease_id, self._wake = store, lease_id, wake
        self._told: SimpleQueue[tuple[ManualDemand, DemandState, Answer]] = SimpleQueue()
        self._unwritten: tuple[ManualDemand, DemandState, Answer] | None = None
        self._over = Event()
        self._delivery = Lock()
        """Held while demands are given to the session, and while that is ended."""
        self._delivering = True
        self._answered_s = self._heard_s = monotonic_s()
        self._heard = -1
        self._thread: Thread | None = None
        self.because = ""
        """The reason why the lease has to end; empty: it continues."""

    def begin(self, session: ManualSession) -> None:
        """Start the thread, which gives demands to this session."""
        self._thread = Thread(target=self._run, args=(session,), name="manual lease", daemon=True)
        self._thread.start()

    def tell(self, demand: ManualDemand, state: DemandState, answer: Answer) -> None:
        """Queue the outcome of a demand for writing; never waits."""
        self._told.put((demand, state, answer))
        self._wake.set()

    def silent(self) -> bool:
        """Return whether the database has not answered for so long that the lease ends; `because` then has the
        reason.
        """
        if monotonic_s() - self._answered_s <= HANGS_S:
            return False
        self.because = self.because or f"the database has not answered for {HANGS_S:g} s"
        return True

    def end_delivery(self) -> None:
        """Give the session no demand from here on; outcomes are still written. A later call does nothing."""
        with self._delivery:
            self._delivering = False

    def end(self, within_s: float) -> None:
        """Write the last outcomes, and end the thread; what is not written in time is left to the end of the lease."""
        self._over.set()
        self._wake.set()
        if self._thread is not None:
            self._thread.join(within_s)

    def _run(self, session: ManualSession) -> None:
        while True:
            last = self._over.is_set()
            try:
                self._write()
                if last:
                    return
                news = self._store.news(self._lease_id)
                self._answered_s = monotonic_s()
                self._look(session, news)
            except ServiceError as error:
                log.warning("manual lease %s: %s", self._lease_id, error)
                if last:
                    return
            except Exception:  # of whatever kind: a reader that ended would see neither a stop nor the lease's end
                log.exception("manual lease %s", self._lease_id)
                if last:
                    return
            self._wake.wait(LOOK_S)
            self._wake.clear()

    def _write(self) -> None:
        while self._unwritten is not None or not self._told.empty():
            self._unwritten = self._unwritten or self._told.get()
            demand, state, answer = self._unwritten
            self._store.answer(demand.id, state, answer, now())
            self._unwritten = None

    def _look(self, session: ManualSession, news: LeaseNews) -> None:
        if news.lease.heard != self._heard:
            self._heard, self._heard_s = news.lease.heard, monotonic_s()
        if news.stopped:
            self.because = f"the bench was stopped: {news.stopped}"
        elif news.lease.end_asked:
            self.because = f"ended by {news.lease.end_asked}"
        elif monotonic_s() - self._heard_s > LEASE_SILENT_S:
            self.because = f"no process that serves clients has given a heartbeat for {LEASE_SILENT_S:g} s"
        if self.because:
            session.leave(self.because)
            return
        session.expires(news.lease)
        with self._delivery:
            for demand in news.demands if self._delivering else ():
                session.demand(demand)
