"""Batches of analyses and their tasks as rows and back. Knows the shapes only; no transaction begins here."""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from bench_service.mapping import copied
from bench_service.model.batches import AnalysisBatch, AnalysisTask, Grouping, TaskState
from bench_service.model.errors import NotFound
from bench_service.persistence.jobs.job_rows import FAILURE
from bench_service.persistence.tables.batches import BatchRow, TaskRecordingRow, TaskRow


def row_of_batch(batch: AnalysisBatch) -> BatchRow:
    """Convert a batch to its row."""
    return copied(BatchRow, batch, calibrations=list(batch.calibrations), each=batch.each.value, final_counts=None)


def batches_of_rows(session: Session, rows: Sequence[BatchRow]) -> tuple[AnalysisBatch, ...]:
    """Convert rows to their batches; tasks are counted for those alone that have not ended."""
    live = [row.id for row in rows if row.final_counts is None]
    counted: dict[str, dict[TaskState, int]] = {}
    if live:
        query = select(TaskRow.batch_id, TaskRow.state, func.count()).where(TaskRow.batch_id.in_(live))
        for batch, state, number in session.execute(query.group_by(TaskRow.batch_id, TaskRow.state)):
            counted.setdefault(batch, {})[TaskState(state)] = number
    return tuple(_batch(row, counted.get(row.id, {})) for row in rows)


def _batch(row: BatchRow, live: Mapping[TaskState, int]) -> AnalysisBatch:
    counts = live if row.final_counts is None else {TaskState(k): v for k, v in row.final_counts.items()}
    return copied(AnalysisBatch, row, calibrations=tuple(row.calibrations), each=Grouping(row.each), counts=counts)


def found_batch(session: Session, batch_id: str, *, lock: bool = False) -> BatchRow:
    """Return the row of a batch, locked for this transaction where `lock` is true. Raises `NotFound`."""
    query = select(BatchRow).where(BatchRow.id == batch_id)
    row = session.scalar(query.with_for_update() if lock else query)
    if row is None:
        raise NotFound("batch of analyses", batch_id)
    return row


def recordings_of_tasks(session: Session, batch_id: str, numbers: Sequence[int]) -> dict[int, tuple[str, ...]]:
    """Return, by the number of a task, the ids of its recordings in the order of their positions."""
    query = (
        select(TaskRecordingRow.number, TaskRecordingRow.recording_id)
        .where(TaskRecordingRow.batch_id == batch_id, TaskRecordingRow.number.in_(numbers))
        .order_by(TaskRecordingRow.number, TaskRecordingRow.position)
    )
    found: dict[int, list[str]] = {}
    for number, recording in session.execute(query):
        found.setdefault(number, []).append(recording)
    return {number: tuple(ids) for number, ids in found.items()}


def task_of_row(row: TaskRow, recordings: tuple[str, ...]) -> AnalysisTask:
    """Convert a row to its task."""
    given: dict[str, Any] = {"batch": row.batch_id, "result": row.result_id, "state": TaskState(row.state)}
    failure = None if row.failure is None else FAILURE.validate_python(row.failure)
    return copied(AnalysisTask, row, **given, recordings=recordings, failure=failure)
