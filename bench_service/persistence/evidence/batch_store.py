"""Batches of analyses in SQL. Must not know how an analysis runs, or where."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import exists, insert, select, update

from bench_service.model.batches import AnalysisBatch, AnalysisTask, Selection, TaskState
from bench_service.model.errors import IllegalTransition
from bench_service.model.raw_data import GONE
from bench_service.model.records import Idempotency, Page, RecordingState
from bench_service.persistence.evidence.batch_queue import SqlBatchQueue
from bench_service.persistence.evidence.batch_rows import (
    batches_of_rows,
    found_batch,
    recordings_of_tasks,
    row_of_batch,
    task_of_row,
)
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.paging import page
from bench_service.persistence.searching import find_recordings
from bench_service.persistence.slices import in_parts
from bench_service.persistence.tables.batches import BatchRow, TaskRecordingRow, TaskRow
from bench_service.persistence.tables.evidence import RecordingRow
from bench_service.persistence.tables.jobs import JobRow
from bench_service.persistence.text_search import ways_to_recordings

_GONE = tuple(state.value for state in GONE)


class SqlBatchStore(SqlBatchQueue):
    """SQL implementation of `bench_service.evidence.batches.store.BatchStore`."""

    def select(self, selection: Selection, limit: int) -> tuple[tuple[str, str | None, str], ...]:
        query = select(RecordingRow.id, RecordingRow.job_id, RecordingRow.unit)
        complete = RecordingRow.state == RecordingState.COMPLETE.value
        query = find_recordings(query.where(complete, RecordingRow.raw.not_in(_GONE)), selection.search)
        if selection.unit is not None:
            query = query.where(RecordingRow.unit == selection.unit)
        if selection.job is not None:
            query = query.where(RecordingRow.job_id == selection.job)
        if selection.simulated is not None:
            query = query.where(RecordingRow.simulated == selection.simulated)
        if selection.procedure is not None:
            of_job = RecordingRow.job_id == JobRow.id
            query = query.where(exists().where(of_job, JobRow.procedure == selection.procedure))
        found: dict[str, tuple[str, str | None, str]] = {}
        with self._database.read() as session:
            text = selection.search.text
            ways = [query] if text is None else [query.where(way) for way in ways_to_recordings(session, text)]
            for ids in in_parts(sorted(selection.ids)) if selection.ids else [None]:
                for way in ways:
                    part = way if ids is None else way.where(RecordingRow.id.in_(ids))
                    rows = session.execute(part.order_by(RecordingRow.id).limit(limit))
                    found |= {row.id: (row.id, row.job_id, row.unit) for row in rows}
                if len(found) >= limit:
                    break
        return tuple(found[known] for known in sorted(found)[:limit])

    def add(
        self, batch: AnalysisBatch, groups: Sequence[Sequence[str]], idempotency: Idempotency | None = None
    ) -> AnalysisBatch:
        tasks = [
            {
                "batch_id": batch.id,
                "number": number,
                "state": TaskState.WAITING.value,
                "priority": batch.priority,
                "attempt": 0,
                "worker": "",
            }
            for number in range(len(groups))
        ]
        recordings = [
            {"batch_id": batch.id, "number": number, "position": position, "recording_id": recording}
            for number, group in enumerate(groups)
            for position, recording in enumerate(group)
        ]

        def once() -> AnalysisBatch:
            with self._database.write() as session:
                known = made_before(session, idempotency, "batch")
                if known is not None:
                    return batches_of_rows(session, [found_batch(session, known)])[0]
                remember(session, idempotency, "batch", batch.id, batch.created_at)
                session.add(row_of_batch(batch))
                session.flush()
                for table, rows in ((TaskRow, tasks), (TaskRecordingRow, recordings)):
                    for part in in_parts(rows):
                        session.execute(insert(table), part)
                return batches_of_rows(session, [found_batch(session, batch.id)])[0]

        return again_after_conflict(once)

    def get(self, batch_id: str) -> AnalysisBatch:
        with self._database.read() as session:
            return batches_of_rows(session, [found_batch(session, batch_id)])[0]

    def list(self, *, after: str | None = None, limit: int = 50) -> Page[AnalysisBatch]:
        with self._database.read() as session:
            rows = page(session, select(BatchRow), BatchRow.id, after, limit, lambda row: row)
            return Page(batches_of_rows(session, rows.items), rows.next)

    def tasks(
        self, batch_id: str, *, state: TaskState | None = None, after: int | None = None, limit: int = 50
    ) -> tuple[AnalysisTask, ...]:
        query = select(TaskRow).where(TaskRow.batch_id == batch_id).order_by(TaskRow.number).limit(limit)
        if state is not None:
            query = query.where(TaskRow.state == state.value)
        if after is not None:
            query = query.where(TaskRow.number > after)
        with self._database.read() as session:
            found_batch(session, batch_id)
            rows = session.scalars(query).all()
            used = recordings_of_tasks(session, batch_id, [row.number for row in rows])
            return tuple(task_of_row(row, used.get(row.number, ())) for row in rows)

    def cancel(self, batch_id: str, by: str, at: datetime) -> AnalysisBatch:
        waiting = (TaskRow.batch_id == batch_id, TaskRow.state == TaskState.WAITING.value)
        with self._database.write() as session:
            row = found_batch(session, batch_id, lock=True)
            if row.ended_at is not None:
                raise IllegalTransition(f"batch {batch_id} has ended: there is nothing left to cancel")
            if row.cancelled_at is None:
                row.cancelled_at, row.cancelled_by = at, by
            session.execute(update(TaskRow).where(*waiting).values(state=TaskState.CANCELLED.value, ended_at=at))
        self.settle(batch_id, at)
        return self.get(batch_id)

    def retry(self, batch_id: str, at: datetime) -> AnalysisBatch:
        again = (TaskState.FAILED.value, TaskState.CANCELLED.value)
        values = {"state": TaskState.WAITING.value, "attempt": 0, "ended_at": None, "failure": None, "not_before": None}
        with self._database.write() as session:
            row = found_batch(session, batch_id, lock=True)
            if row.ended_at is None:
                raise IllegalTransition(f"batch {batch_id} has not ended: cancel it first, or wait for its end")
            mine = (TaskRow.batch_id == batch_id, TaskRow.state.in_(again))
            changed = session.execute(update(TaskRow).where(*mine).values(**values).returning(TaskRow.number)).all()
            if not changed:
                raise IllegalTransition(f"batch {batch_id} has no failed or cancelled task: there is nothing to retry")
            row.ended_at, row.final_counts, row.cancelled_at, row.cancelled_by = None, None, None, ""
        return self.get(batch_id)
