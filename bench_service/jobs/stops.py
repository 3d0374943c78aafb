"""The software stop of a bench, and its release, for clients, on whichever host the bench's worker runs.

A stop goes first to the bench itself, by the stop channel of its host or by its supervisor's listener, and then into
the database. The former needs no database; the latter follows when it can.
"""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from bench_service.bench.directory import BenchDirectory
from bench_service.bench.safety import Safety, SafetyService
from bench_service.bench.stop.routes import Sent, StopRoutes
from bench_service.bench.stop.word import StopWord
from bench_service.jobs.stop_entry import StopEntry
from bench_service.jobs.stop_keys import StopKeys
from bench_service.jobs.stop_ledger import StopLedger
from bench_service.jobs.stores import JobStores
from bench_service.model.errors import NotFound, ServiceError, SeveralStops, StorageFailure
from bench_service.model.records import BenchStop
from bench_service.telemetry.audit import AuditTrail
from bench_service.wall_clock import monotonic_s, now

BOOKS_S = 1.0
"""Time that the answer to a stop waits for the database, counted from the request [s]."""


@dataclass(frozen=True)
class Stopped:
    """Outcome of a software stop: the stop, the job that it ended, the bench's safety, and why the database lacks it,
    if so.
    """

    stop: BenchStop
    job: str | None
    """Id of the running job, which is being cancelled; None where it is not known."""
    safety: Safety
    """The bench's known safety shortly after the stop."""
    books: str = ""
    """The reason why the database does not have the stop yet; empty: it has."""


class StopService:
    """Operations of clients on stops: stops benches on this host or another, and releases them."""

    def __init__(
        self,
        stores: JobStores,
        benches: BenchDirectory,
        safety: SafetyService,
        wake: Callable[[str], None],
        routes: StopRoutes,
        trail: AuditTrail,
    ) -> None:
        """Set up with `wake`, which has the dispatcher of a bench look at its queue, where it is within reach."""
        self._stores = stores
        self._benches = benches
        self._safety = safety
        self._wake = wake
        self._routes = routes
        self._entry = StopEntry(stores.benches, stores.queue, stores.jobs, trail)
        self._ledger = StopLedger(self._enter)
        self._keys = StopKeys()

    def stop(
        self,
        bench_id: str,
        reason: str,
        by: str,
        via: str = "http",
        patient: bool = True,
        key: str | None = None,
    ) -> Stopped:
        """Stop all activity of the bench, on any host, until this stop is released. Jobs in the queue wait.

        `by`: the person; `via`: the way over which it came. It waits for bench and database, for a second each at the
        most, and neither waits for the other; where it is not `patient`, for neither, but for the database where no
        bench has heard it. `key`: a request that comes again with the key that it had is the same stop (`StopKeys`).
        Raises `NotFound` for an unknown bench, and `StorageFailure` where the stop reached neither bench nor database.
        """
        books_by_s = monotonic_s() + (BOOKS_S if patient else 0.0)
        keyed = self._keys.of(bench_id, key, StopWord(reason, by, via))
        if keyed.answered:
            again = BenchStop(bench_id, keyed.word.at, reason, by=by, id=keyed.word.id)
            return Stopped(again, None, self._safety.known(bench_id))
        stopped = self._stop(bench_id, keyed.word, books_by_s, patient)
        keyed.answered = True
        return stopped

    def _stop(self, bench_id: str, word: StopWord, books_by_s: float, patient: bool) -> Stopped:
        route = self._routes.to(bench_id)
        here = route is not None and route.here
        sent = Sent(False) if route is None else route.ask(word)
        entering = self._ledger.enter(bench_id, word)
        if not sent.taken:
            # A stop that no bench has received is in the database or nowhere: the caller waits for that.
            job, books = self._entered(entering, BOOKS_S)
            if books:
                raise StorageFailure(f"{self._routes.unreached(bench_id, here)} ({books}; it is tried again)")
            safety = self._safety_now(bench_id, here, patient)
        else:
            safety = sent.safety or self._safety_now(bench_id, here, patient)
            job, books = self._entered(entering, books_by_s - monotonic_s())
            job = job or (safety.devices.job if safety.devices is not None and safety.worker is not None else None)
        return Stopped(BenchStop(bench_id, word.at, word.reason, by=word.by, id=word.id), job, safety, books)

    def _safety_now(self, bench_id: str, here: bool, patient: bool) -> Safety:
        """The safety of a bench shortly after its stop; `here`: the bench is on this host.

        It is not known where this host's files cannot be read, for want of a descriptor.
        """
        if not here:
            return self._safety.stopping_elsewhere(bench_id)
        try:
            return self._safety.stopping(bench_id, patient)
        except OSError as error:
            text = f"The stop is passed on; whether the bench is safe cannot be read here: {error}."
            return Safety(None, text, None, None, None)

    def _enter(self, bench_id: str, word: StopWord) -> str | None:
        self._benches.description(bench_id)
        job = self._entry.enter(bench_id, word)
        channel = self._routes.channel(bench_id)
        if channel is not None:
            channel.mark_booked([word.id])
        return job

    def _entered(self, entering: "Future[str | None]", within_s: float) -> tuple[str | None, str]:
        """The job that a stop ended, and the reason why the database does not have the stop yet. Raises `NotFound`."""
        try:
            return entering.result(max(within_s, 0.0)), ""
        except NotFound:
            raise
        except TimeoutError:
            return None, self._ledger.failure or "the database has not answered yet"
        except ServiceError as error:
            return None, str(error)

    def release(self, bench_id: str, stop_id: str, by: str, remark: str) -> BenchStop:
        """Release one standing stop. Once none stands the bench works again, and the jobs in its queue start.

        `by`: the person who releases it. Raises `NotFound`, `NotSafe` while the devices are not known to be safe, and
        `IllegalTransition` where another person released it before.
        """
        self._benches.description(bench_id)
        if any(stop.id == stop_id for stop in self._stores.benches.standing_stops(bench_id)):
            self._safety.require(bench_id)
        released = self._stores.benches.release_stop(bench_id, stop_id, now(), by, remark)
        channel = self._routes.channel(bench_id)
        if channel is not None:
            channel.clear([stop_id])
        self._wake(bench_id)
        return released

    def release_only(self, bench_id: str, by: str, remark: str) -> None:
        """Release the only stop that stands; without one nothing is changed.

        Raises `SeveralStops` where more than one stands, and the errors of `release`.
        """
        self._benches.description(bench_id)
        standing = self._stores.benches.standing_stops(bench_id)
        if len(standing) > 1:
            raise SeveralStops(bench_id, [(stop.id, _described(stop)) for stop in standing])
        if standing:
            self.release(bench_id, standing[0].id, by, remark)
        else:
            self._wake(bench_id)


def _described(stop: BenchStop) -> str:
    return f"{stop.at.isoformat(timespec='seconds')}{' by ' + stop.by if stop.by else ''}: {stop.reason}"
