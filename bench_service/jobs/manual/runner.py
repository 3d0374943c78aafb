"""Runs leases of manual mode on the bench of this process: from taking one to a bench that is safe again.

The dispatcher calls `run` where it would run a job, in its own thread, so no job starts meanwhile.
"""

import logging
from collections.abc import Callable
from threading import Event, Lock

from bench_service.bench.driven import ShuttingDown
from bench_service.bench.driver import BenchDriver
from bench_service.bench.live.values import LiveBoard
from bench_service.bench.make_safe import SafetyOutcome, end_safely, has_register, over_new_link, still_unsafe
from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.worker_time_limits import ENDING_S
from bench_service.jobs.manual.reader import LeaseReader
from bench_service.jobs.manual.session import TIME_OVER, ManualSession
from bench_service.jobs.stores import JobStores
from bench_service.model.errors import ServiceError
from bench_service.model.manual import ManualLease
from bench_service.model.records import BenchStop
from bench_service.telemetry.audit import AuditTrail, record
from bench_service.wall_clock import now
from procedures.bench import BenchNeeds
from procedures.bench.errors import BenchError, Stopped

WRITE_S = 2.0
"""Time that the end of a lease waits for its last outcomes to be written [s]."""

log = logging.getLogger(__name__)


class ManualRunner:
    """Runs leases of manual mode on the bench of this process, one at a time; the dispatcher calls it."""

    def __init__(
        self,
        stores: JobStores,
        trail: AuditTrail,
        driver: BenchDriver,
        board: LiveBoard,
        stopped: Callable[[], bool] = lambda: False,
        ending_s: float = ENDING_S,
    ) -> None:
        """Set up with `stopped`: whether the bench is stopped over its host's stop channel; asks no database.

        `ending_s`: time that a service which ends waits for a bench in manual mode to be safe [s].
        """
        self._ending_s = ending_s
        self._stores, self._trail, self._driver, self._board = stores, trail, driver, board
        self._stopped = stopped
        self._by = f"the worker, {ProcessIdentity.own()}"
        self._session: ManualSession | None = None
        self._reader: LeaseReader | None = None
        self._making_safe = Lock()
        """Held while a thread makes the bench of a lease safe: the stop guard's or the lease's own."""
        self._wake = Event()
        self._ending = Event()
        self._idle = Event()
        self._idle.set()

    def run(self, lease: ManualLease) -> bool:
        """Run an open lease to its end, or close one that no process runs any more; False: there was nothing to do.

        Raises `ShuttingDown` once the bench is safe, and `StorageFailure` before anything was commanded.
        """
        if lease.began_at is not None:
            obstacle = None if self._driver.device_state() is None else over_new_link(self._driver, self._by)
            because = f"its process, {lease.process}, ended or lost its database"
            self._ended(lease, because, None if obstacle is None else obstacle.reason)
            return True
        if not lease.live(now()) or self._stopped():
            why = "the bench is stopped" if self._stopped() else "its time had ended before it began"
            self._ended(lease, why, None)
            return True
        taken = self._stores.manual.take(lease.id, now(), str(ProcessIdentity.own()))
        if taken is None:
            return False
        self._idle.clear()
        try:
            self._hold(taken)
        finally:
            self._idle.set()
        return True

    def wake(self) -> None:
        """Have the lease read now, because a demand came or its end was requested; never waits."""
        self._wake.set()

    def stop_now(self) -> None:
        """Leave the lease and make the bench safe, whatever its own thread waits for; called by the stop guard."""
        session = self._session
        if session is None:
            return
        session.stop()
        if (reader := self._reader) is not None:
            reader.end_delivery()
        if has_register(self._driver):  # else the session's own link is the only one
            self._end_safely(session)

    def shut_down(self) -> None:
        """End the lease that runs, and wait until the bench is safe: the service is ending."""
        self._ending.set()
        session = self._session
        if session is not None:
            session.shut_down()
        self._idle.wait(self._ending_s)

    def _hold(self, lease: ManualLease) -> None:
        description = self._driver.description
        chamber = description.chamber is not None and not description.no_thermal_jobs
        try:
            bench = self._driver.open(lease.unit, None, None, BenchNeeds(temperatures=chamber, real_time=True))
        except (BenchError, ServiceError) as error:
            self._ended(lease, f"the bench could not be opened: {error}", None)
            return
        reader = LeaseReader(self._stores.manual, lease.id, self._wake)

        def stop_wanted() -> bool:
            return self._stopped() or reader.silent()

        session = ManualSession(lease, bench, stop_wanted, self._board, reader.tell, self._stopped)
        self._session, self._reader = session, reader
        if self._ending.is_set():  # set while the bench was being opened, when there was no session to end
            session.shut_down()
        log.info("bench %s is in manual mode by %s until %s: %s", lease.bench, lease.holder, lease.until, lease.reason)
        reader.begin(session)
        because, ending = "", False
        try:
            session.hold()
            because = reader.because or TIME_OVER
        except Stopped:
            because = reader.because or "the bench was stopped"
        except ShuttingDown:
            because, ending = "the service ended", True
        except (BenchError, ServiceError) as error:
            because = f"{type(error).__name__}: {error}"
        finally:
            reader.end_delivery()
            end = self._end_safely(session)
            reader.end(WRITE_S)
        detour = f"; made safe over a new link: {end.detour}" if end.detour else ""
        self._ended(lease, because + detour, None if end.obstacle is None else end.obstacle.reason)
        if ending:
            raise ShuttingDown

    def _end_safely(self, session: ManualSession) -> SafetyOutcome:
        def given_back() -> None:
            if self._session is session:
                self._session = None

        with self._making_safe:
            return end_safely(session, self._driver, self._by, given_back)

    def _ended(self, lease: ManualLease, because: str, unsafe: str | None) -> None:
        """Note the end of a lease; where the bench is not safe it is stopped. What is not noted now is closed later.

        `unsafe`: the reason of that stop, whose subject is the bench. It is noted as safe only where the devices'
        register says so now.
        """
        unsafe = still_unsafe(self._driver, self._by, "manual mode") if unsafe is None else unsafe
        log.info("manual mode of bench %s has ended: %s", lease.bench, because)
        if unsafe is not None:
            log.error("bench %s %s", lease.bench, unsafe)
            self._stores.benches.stop_bench_once(BenchStop(lease.bench, now(), unsafe, by=self._by))
        self._stores.manual.end(lease.id, now(), because, unsafe is None)
        target = f"/api/v1/benches/{lease.bench}/manual/{lease.id}"
        record(self._trail, self._by, "manual_ended", target, "noted", because=because, safe=unsafe is None)
