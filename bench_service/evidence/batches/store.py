"""Interface of the store of batches of analyses and their tasks. Every method is one transaction."""

from collections.abc import Sequence
from datetime import datetime
from typing import Protocol

from bench_service.model.batches import AnalysisBatch, AnalysisTask, ClaimedTask, Selection, TaskState
from bench_service.model.job import Failure
from bench_service.model.records import Idempotency, Page


class BatchStore(Protocol):
    """Store of batches, and the queue of their tasks. Interface; the SQL is in `persistence`."""

    def select(self, selection: Selection, limit: int) -> tuple[tuple[str, str | None, str], ...]:
        """Return (id, job, unit) of at most `limit` complete recordings of a selection, oldest first."""
        ...

    def add(
        self, batch: AnalysisBatch, groups: Sequence[Sequence[str]], idempotency: Idempotency | None = None
    ) -> AnalysisBatch:
        """Add a batch with one waiting task for each group of recordings.

        Raises `IdempotencyConflict`; a known key with the same fingerprint returns the first batch.
        """
        ...

    def get(self, batch_id: str) -> AnalysisBatch:
        """Return one batch with its counts. Raises `NotFound`."""
        ...

    def list(self, *, after: str | None = None, limit: int = 50) -> Page[AnalysisBatch]: ...

    def tasks(
        self, batch_id: str, *, state: TaskState | None = None, after: int | None = None, limit: int = 50
    ) -> tuple[AnalysisTask, ...]:
        """Return at most `limit` tasks of a batch in the order of their numbers, those after the number `after`, in
        that `state` (None: any). Raises `NotFound`.
        """
        ...

    def waiting(self, most: int) -> int:
        """Return the number of waiting tasks of all batches, counted up to `most`."""
        ...

    def claim(self, worker: str, at: datetime) -> ClaimedTask | None:
        """Claim the next due task for a worker and return it; None where none is due. No task is ever claimed by two
        workers.
        """
        ...

    def end(
        self,
        task: ClaimedTask,
        worker: str,
        state: TaskState,
        at: datetime,
        result: str | None = None,
        failure: Failure | None = None,
    ) -> bool:
        """Store the end of a claimed task; return False where the claim was lost meanwhile, and nothing is changed.
        `result`: id of the result that the task gave; `failure`: why it gave none.
        """
        ...

    def put_back(
        self, task: ClaimedTask, worker: str, not_before: datetime | None, why: Failure, spent: bool = True
    ) -> bool:
        """Put a claimed task back into its place in the queue; False where the claim was lost meanwhile.

        `not_before`: earliest time of the next attempt, None: at once. `spent`: whether this attempt counts. A task of
        a cancelled batch is cancelled.
        """
        ...

    def claimants(self) -> tuple[str, ...]:
        """Return the names of the workers that have running tasks."""
        ...

    def orphaned(self, worker: str, most_attempts: int, at: datetime) -> int:
        """Put all running tasks of a dead worker back, and return their number; one that was claimed `most_attempts`
        times fails.
        """
        ...

    def cancel(self, batch_id: str, by: str, at: datetime) -> AnalysisBatch:
        """Cancel every waiting task of a batch and return it; running ones end by themselves. Raises `NotFound`,
        `IllegalTransition` for a batch that has ended.
        """
        ...

    def retry(self, batch_id: str, at: datetime) -> AnalysisBatch:
        """Queue the failed and cancelled tasks of an ended batch again, and return it. Raises `NotFound`,
        `IllegalTransition`.
        """
        ...
