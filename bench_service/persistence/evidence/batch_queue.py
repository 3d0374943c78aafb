"""The queue of the tasks of all batches in SQL: claims, ends, and what a dead worker leaves.

A task is claimed in one transaction. On Postgres rows that another worker is just claiming are skipped, so workers do
not wait for each other; on SQLite writers queue anyway. Every change of a claimed task names its worker and attempt,
so a worker that was taken for dead changes nothing.
"""

from datetime import datetime

from sqlalchemy import exists, func, or_, select, update
from sqlalchemy.orm import Session

from bench_service.mapping import copied
from bench_service.model.batches import ClaimedTask, TaskState
from bench_service.model.job import Failure
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.batch_rows import recordings_of_tasks
from bench_service.persistence.jobs.job_rows import failure_document
from bench_service.persistence.tables.batches import BatchRow, TaskRow

WAITING, RUNNING = TaskState.WAITING.value, TaskState.RUNNING.value


class SqlBatchQueue:
    """SQL implementation of the part of `bench_service.evidence.batches.store.BatchStore` that workers use."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def waiting(self, most: int) -> int:
        found = select(TaskRow.number).where(TaskRow.state == WAITING).limit(most).subquery()
        with self._database.read() as session:
            return session.scalar(select(func.count()).select_from(found)) or 0

    def claim(self, worker: str, at: datetime) -> ClaimedTask | None:
        due = or_(TaskRow.not_before.is_(None), TaskRow.not_before <= at)
        query = (
            select(TaskRow)
            .where(TaskRow.state == WAITING, due)
            .order_by(TaskRow.priority, TaskRow.batch_id, TaskRow.number)
            .limit(1)
        )
        with self._database.read() as session:  # an idle worker takes no lock
            if session.scalar(query.with_only_columns(TaskRow.number)) is None:
                return None
        with self._database.write() as session:
            row = session.scalar(query.with_for_update(skip_locked=True))
            if row is None:
                return None
            row.state, row.worker, row.claimed_at = RUNNING, worker, at
            row.attempt += 1
            row.not_before = None
            batch = session.get_one(BatchRow, row.batch_id)
            recordings = recordings_of_tasks(session, row.batch_id, [row.number])[row.number]
            given = {"batch": row.batch_id, "number": row.number, "attempt": row.attempt}
            return copied(ClaimedTask, batch, **given, calibrations=tuple(batch.calibrations), recordings=recordings)

    def end(
        self,
        task: ClaimedTask,
        worker: str,
        state: TaskState,
        at: datetime,
        result: str | None = None,
        failure: Failure | None = None,
    ) -> bool:
        values: dict[str, object] = {
            "state": state.value,
            "ended_at": at,
            "result_id": result,
            "failure": failure_document(failure),
        }
        with self._database.write() as session:
            held = _change(session, task, worker, values)
        if held:
            self.settle(task.batch, at)
        return held

    def put_back(
        self, task: ClaimedTask, worker: str, not_before: datetime | None, why: Failure, spent: bool = True
    ) -> bool:
        with self._database.write() as session:
            batch = session.get_one(BatchRow, task.batch)
            to = WAITING if batch.cancelled_at is None else TaskState.CANCELLED.value
            attempt = task.attempt if spent else task.attempt - 1
            values: dict[str, object] = {
                "state": to,
                "not_before": not_before,
                "failure": failure_document(why),
                "attempt": attempt,
            }
            held = _change(session, task, worker, values)
        if held and to != WAITING:
            self.settle(task.batch, batch.cancelled_at)
        return held

    def claimants(self) -> tuple[str, ...]:
        query = select(TaskRow.worker).where(TaskRow.state == RUNNING).distinct()
        with self._database.read() as session:
            return tuple(session.scalars(query))

    def orphaned(self, worker: str, most_attempts: int, at: datetime) -> int:
        ended = Failure("WorkerEnded", f"its worker ended while it ran, {most_attempts} times: it is not tried again")
        again = Failure("WorkerEnded", "its worker ended while it ran")
        query = select(TaskRow).where(TaskRow.state == RUNNING, TaskRow.worker == worker)
        batches: set[str] = set()
        with self._database.write() as session:
            rows = session.scalars(query.with_for_update(skip_locked=True)).all()
            for row in rows:
                cancelled = session.get_one(BatchRow, row.batch_id).cancelled_at is not None
                over = row.attempt >= most_attempts
                row.state = TaskState.CANCELLED.value if cancelled else TaskState.FAILED.value if over else WAITING
                row.failure = failure_document(ended if over else again)
                row.ended_at = at if over or cancelled else None
                batches.add(row.batch_id)
        for batch in batches:
            self.settle(batch, at)
        return len(rows)

    def settle(self, batch_id: str, at: datetime | None) -> None:
        """Close a batch at a time where its tasks have all ended, and store their counts; do nothing while one is open.

        It runs after the commit of a task's end: of two workers that end the last two tasks at once, the later one
        finds none open.
        """
        still = exists().where(TaskRow.batch_id == batch_id, TaskRow.state.in_((WAITING, RUNNING)))
        with self._database.read() as session:
            if session.scalar(select(still)):
                return
        query = select(TaskRow.state, func.count()).where(TaskRow.batch_id == batch_id).group_by(TaskRow.state)
        with self._database.write() as session:
            row = session.scalar(select(BatchRow).where(BatchRow.id == batch_id).with_for_update())
            counts = {state: number for state, number in session.execute(query)}  # noqa: C416  rows are not tuples
            if row is not None and row.ended_at is None and not counts.keys() & {WAITING, RUNNING}:
                row.ended_at, row.final_counts = at, counts


def _change(session: Session, task: ClaimedTask, worker: str, values: dict[str, object]) -> bool:
    """Change a task that this claim still holds; False where it does not."""
    mine = (
        TaskRow.batch_id == task.batch,
        TaskRow.number == task.number,
        TaskRow.state == RUNNING,
        TaskRow.worker == worker,
        TaskRow.attempt == task.attempt,
    )
    changed = session.execute(update(TaskRow).where(*mine).values(**values).returning(TaskRow.number))
    return changed.scalar() is not None
