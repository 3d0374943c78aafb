"""The software stop of a bench, and its release: what a client asks for, wherever the bench's worker is."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from bench_service.bench.directory import BenchDirectory
from bench_service.bench.safety import Safety, SafetyService
from bench_service.jobs.stores import JobStores
from bench_service.model.errors import IllegalTransition, NotUnderstood, SeveralStops
from bench_service.model.records import BenchStop
from bench_service.wall_clock import now


@dataclass(frozen=True)
class Stopped:
    """The outcome of a stop."""

    stop: BenchStop
    job: str | None
    """Id of the job that was running, which is being cancelled."""
    safety: Safety
    """What is known of the bench's safety shortly after the stop."""


class StopService:
    """Stops benches and releases them."""

    def __init__(
        self, stores: JobStores, benches: BenchDirectory, safety: SafetyService, wake: Callable[[], None]
    ) -> None:
        """`wake`: has this process's dispatcher look at its queue."""
        self._stores = stores
        self._benches = benches
        self._safety = safety
        self._wake = wake

    def stop(self, bench_id: str, reason: str, by: str) -> Stopped:
        """Stop what the bench is doing, wherever its worker is, until this stop is released. Jobs in the queue wait.

        `by`: who stops it. Raises `NotFound`, `StorageFull`, `StorageFailure`.
        """
        self._benches.description(bench_id)
        stop = BenchStop(bench_id, now(), reason, by=by)
        self._stores.benches.stop_bench(stop)
        running = self._stores.queue.running(bench_id)
        if running is not None:
            with suppress(IllegalTransition, NotUnderstood):  # it has ended this moment; or nobody here can read it
                self._stores.jobs.request_cancel(running.id, now())
        return Stopped(stop, None if running is None else running.id, self._safety.stopping(bench_id))

    def release(self, bench_id: str, stop_id: str, by: str, remark: str) -> BenchStop:
        """Release one stop. The bench works again, and the jobs in its queue go on, once no stop stands.

        `by`: who releases it. Raises `NotFound`, `NotSafe` while the devices are not known to be safe, and
        `IllegalTransition` where another person released it before.
        """
        self._benches.description(bench_id)
        if any(stop.id == stop_id for stop in self._stores.benches.standing_stops(bench_id)):
            self._safety.require(bench_id)
        released = self._stores.benches.release_stop(bench_id, stop_id, now(), by, remark)
        self._wake()
        return released

    def release_only(self, bench_id: str, by: str, remark: str) -> None:
        """Release the only stop that stands; nothing where none does.

        Raises `SeveralStops` where more than one stands, and what `release` raises.
        """
        self._benches.description(bench_id)
        standing = self._stores.benches.standing_stops(bench_id)
        if len(standing) > 1:
            raise SeveralStops(bench_id, [(stop.id, _described(stop)) for stop in standing])
        if standing:
            self.release(bench_id, standing[0].id, by, remark)
        else:
            self._wake()


def _described(stop: BenchStop) -> str:
    return f"{stop.at.isoformat(timespec='seconds')}{' by ' + stop.by if stop.by else ''}: {stop.reason}"
