"""The queues of benches in SQL. Knows rows and locks; who may start is said by `bench_service.jobs.queue`."""

from datetime import datetime
from typing import Any

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session

from bench_service.jobs.errors import IllegalTransition
from bench_service.jobs.job import Failure, Job, JobState
from bench_service.jobs.queue import BenchQueue, QueueEntry
from bench_service.jobs.stored import BenchStop
from bench_service.persistence.database import Database
from bench_service.persistence.job_changes import append_event, found_job, move_job
from bench_service.persistence.job_rows import failure_document, job_of_row
from bench_service.persistence.reservation_store import active_reservations, reservation_of_row
from bench_service.persistence.tables import BenchStopRow, JobRow
from bench_service.persistence.tables_around_jobs import ReservationRow

QUEUED, RUNNING = JobState.QUEUED.value, JobState.RUNNING.value
_QUEUED_AT = func.coalesce(JobRow.queued_at, JobRow.created_at)
_OPEN_JOBS = (
    select(
        JobRow.id,
        JobRow.unit,
        JobRow.priority,
        _QUEUED_AT,
        JobRow.attempt,
        JobRow.not_before,
        JobRow.reservation,
        JobRow.state,
        BenchStopRow.at.label("stopped_at"),
        BenchStopRow.reason,
    )
    .outerjoin(BenchStopRow, BenchStopRow.bench == JobRow.bench)
    .where(JobRow.bench == bindparam("bench"), JobRow.state.in_((QUEUED, RUNNING)))
    .order_by(JobRow.priority, _QUEUED_AT, JobRow.id)
)
"""Those that wait, in the order of the queue, and the one that runs; each with the stop of its bench."""


class SqlQueueStore:
    """`bench_service.jobs.queue.QueueStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def look(self, bench: str, at: datetime) -> BenchQueue:
        with self._database.read() as session:
            return _look(session, bench, at)

    def claim(self, entry: QueueEntry, context: dict[str, Any], at: datetime) -> Job | None:
        with self._database.write() as session:
            row = found_job(session, entry.job, lock=True)
            self._database.one_at_a_time(session, f"claim a job of bench {row.bench}")
            queue = _look(session, row.bench, at)
            current = next((e for e in queue.entries if e.job == entry.job and e.attempt == entry.attempt), None)
            if current is None or queue.running is not None or queue.hold(current) is not None:
                return None
            row.context = context
            row.not_before = None
            if row.reservation is not None:
                _note_ended_reservation(session, row, at)
            move_job(session, row, JobState.RUNNING, at)
            return job_of_row(row)

    def running(self, bench: str) -> Job | None:
        query = select(JobRow).where(JobRow.bench == bench, JobRow.state == RUNNING).order_by(JobRow.id)
        with self._database.read() as session:
            row = session.scalars(query.limit(1)).first()
            return None if row is None else job_of_row(row)

    def requeue(self, job_id: str, at: datetime, not_before: datetime | None, why: Failure, spend: bool) -> Job:
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            if row.state != RUNNING:
                raise IllegalTransition(f"job {job_id} is {row.state}; only a running one goes back into the queue")
            if row.cancel_requested or row.pause_requested:  # a person's wish goes before
                move_job(session, row, JobState.CANCELLED if row.cancel_requested else JobState.PAUSED, at)
                return job_of_row(row)
            queued_at = row.queued_at
            move_job(session, row, JobState.QUEUED, at)
            row.queued_at, row.not_before = queued_at, not_before
            row.retries_left -= 1 if spend else 0
            data: dict[str, Any] = {"again_because": failure_document(why), "retries_left": row.retries_left}
            if not_before is not None:
                data["not_before"] = not_before.isoformat()
            append_event(session, job_id, "note", at, data)
            return job_of_row(row)

    def set_priority(self, job_id: str, priority: int, at: datetime) -> Job:
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            if row.state != QUEUED:
                raise IllegalTransition(f"job {job_id} is {row.state}; only a queued one has a place that can change")
            if row.priority != priority:
                append_event(session, job_id, "note", at, {"priority": priority, "before": row.priority})
                row.priority = priority
            return job_of_row(row)

    def lengths(self) -> dict[str, int]:
        query = select(JobRow.bench, func.count()).where(JobRow.state == QUEUED).group_by(JobRow.bench)
        with self._database.read() as session:
            return {bench: number for bench, number in session.execute(query)}  # noqa: C416  rows are not tuples


def _look(session: Session, bench: str, at: datetime) -> BenchQueue:
    rows = session.execute(_OPEN_JOBS, {"bench": bench}).all()
    running = min((row.id for row in rows if row.state == RUNNING), default=None)
    entries = tuple(QueueEntry(*row[:7]) for row in rows if row.state == QUEUED)
    if not entries:
        return BenchQueue(bench, at, (), running)
    stop = None if rows[0].stopped_at is None else BenchStop(bench, rows[0].stopped_at, rows[0].reason)
    return BenchQueue(bench, at, entries, running, stop, active_reservations(session, at))


def _note_ended_reservation(session: Session, row: JobRow, at: datetime) -> None:
    """A job whose reservation ended before its turn runs all the same, and says so."""
    kept = session.get(ReservationRow, row.reservation)
    if kept is None or not reservation_of_row(kept).active(at):
        over = "" if kept is None else f" at {reservation_of_row(kept).over_at.isoformat()}"
        text = f"reservation {row.reservation} ended{over}, before this job's turn: it runs as an ordinary job"
        append_event(session, row.id, "note", at, {"text": text})
