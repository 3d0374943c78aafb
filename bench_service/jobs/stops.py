"""The software stop of a bench, and its release: what a client asks for, wherever the bench's worker is."""

from collections.abc import Callable
from contextlib import suppress

from bench_service.bench.directory import BenchDirectory
from bench_service.bench.safety import Safety, SafetyService
from bench_service.jobs.stores import JobStores
from bench_service.model.errors import IllegalTransition, NotUnderstood
from bench_service.model.records import BenchStop
from bench_service.wall_clock import now


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

    def stop(self, bench_id: str, reason: str) -> tuple[str | None, Safety]:
        """Stop what the bench is doing, wherever its worker is, until it is released; the id of the job that was
        running, if any, and what is known of the bench's safety then. Jobs in the queue wait.
        """
        self._benches.description(bench_id)
        self._stores.benches.stop_bench(BenchStop(bench_id, now(), reason))
        running = self._stores.queue.running(bench_id)
        if running is not None:
            with suppress(IllegalTransition, NotUnderstood):  # it has ended this moment; or nobody here can read it
                self._stores.jobs.request_cancel(running.id, now())
        return None if running is None else running.id, self._safety.stopping(bench_id)

    def release(self, bench_id: str) -> None:
        """Let a stopped bench work again; the jobs in its queue go on. Raises `NotSafe` while it is not safe."""
        self._benches.description(bench_id)
        if self._stores.benches.bench_stop(bench_id) is not None:
            self._safety.require(bench_id)
            self._stores.benches.release_bench(bench_id)
        self._wake()
