"""Queries of a running job for a stop of its bench, its own cancel, and a database that was moved."""

from collections.abc import Callable

from bench_service.bench.registry import BenchRegistry
from bench_service.jobs.stores import JobStore
from bench_service.model.errors import DatabaseMoved, StorageFailure
from bench_service.model.job import Failure


class StopQueries:
    """Asks on behalf of the jobs of one bench."""

    def __init__(self, benches: BenchRegistry, jobs: JobStore, bench_id: str, stopped: Callable[[], bool]) -> None:
        """Set up with `stopped`: whether the bench is stopped over its host's stop channel; asks no database."""
        self._benches = benches
        self._jobs = jobs
        self._bench_id = bench_id
        self._stopped = stopped

    def wanted(self, job_id: str) -> bool:
        """Return whether the job was cancelled or its bench stopped, through any process.

        A database that does not answer now, because it is restarted, counts as no stop: the recording continues. A stop
        on the bench's own host does not depend on it. One whose file was deleted or replaced takes no recording any
        more: the job is stopped.
        """
        if self._stopped():
            return True
        try:
            return self._benches.bench_stop(self._bench_id) is not None or self._jobs.cancel_requested(job_id)
        except DatabaseMoved:
            return True
        except StorageFailure:
            return False

    def moved_database(self, job_id: str) -> Failure | None:
        """The failure of a job whose database's file was deleted or replaced; None where it was not."""
        try:
            self._jobs.cancel_requested(job_id)
        except DatabaseMoved as moved:
            return Failure(type(moved).__name__, str(moved))
        except StorageFailure:
            return None
        return None
