"""Queues of benches in SQL. Knows rows and locks; `bench_service.jobs.queue` decides which job may start."""

from dataclasses import replace
from datetime import datetime
from typing import Any

from sqlalchemy import bindparam, func, select, tuple_
from sqlalchemy.orm import Session

from bench_service.jobs.queue import BenchQueue, QueueEntry
from bench_service.mapping import copied
from bench_service.model.errors import IllegalTransition
from bench_service.model.job import Failure, Job, JobState
from bench_service.persistence.bench.registry_store import standing_stops
from bench_service.persistence.database import Database
from bench_service.persistence.jobs.job_changes import append_event, found_job, move_job
from bench_service.persistence.jobs.job_rows import failure_document, job_of_row
from bench_service.persistence.jobs.manual_store import open_lease
from bench_service.persistence.jobs.reservation_store import active_reservations, reservation_of_row
from bench_service.persistence.tables.columns import columns
from bench_service.persistence.tables.jobs import JobRow, ReservationRow

QUEUED, RUNNING = JobState.QUEUED.value, JobState.RUNNING.value
FIRST_PAGE, LONGER = 20, 4
"""Number of entries read to find the one that starts next, and the factor of its growth while none may start."""

_ORDER = (JobRow.priority, JobRow.queued_at, JobRow.id)
_ENTRY = columns(JobRow, QueueEntry)
_OF_BENCH = JobRow.bench == bindparam("bench")
_OPEN_JOBS = select(*_ENTRY, JobRow.state).where(_OF_BENCH, JobRow.state.in_((QUEUED, RUNNING))).order_by(*_ORDER)
"""The bench's waiting jobs in the order of the queue, and the running one."""
_FRONT = select(*_ENTRY).where(_OF_BENCH, JobRow.state == QUEUED).order_by(*_ORDER).limit(bindparam("limit"))
_FURTHER = _FRONT.where(tuple_(*_ORDER) > tuple_(*(bindparam(f"last_{c.key}", type_=c.type) for c in _ORDER)))
"""The next page of waiting jobs: read in the order of an index, so no other rows are touched."""
_RUNNING = select(*_ENTRY).where(_OF_BENCH, JobRow.state == RUNNING).order_by(JobRow.id).limit(1)


class SqlQueueStore:
    """SQL implementation of `bench_service.jobs.queue.QueueStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def look(self, bench: str, at: datetime) -> BenchQueue:
        with self._database.read() as session:
            return _look(session, bench, at)

    def front(self, bench: str, at: datetime) -> BenchQueue:
        with self._database.read() as session:
            running = _running(session, bench)
            first = () if running is not None else _entries(session, bench, FIRST_PAGE)
            queue = _queue(session, bench, at, first, running)
            wanted = FIRST_PAGE
            while len(queue.entries) == wanted and not queue.stops and queue.next() is None:
                more = _entries(session, bench, wanted * (LONGER - 1), queue.entries[-1])
                queue, wanted = replace(queue, entries=queue.entries + more), wanted * LONGER
            return queue

    def claim(self, entry: QueueEntry, context: dict[str, Any], at: datetime) -> Job | None:
        with self._database.write() as session:
            row = found_job(session, entry.id, lock=True)
            self._database.turn_at_bench(session, row.bench)
            current = copied(QueueEntry, row)
            if row.state != QUEUED or current.attempt != entry.attempt or _running(session, row.bench) is not None:
                return None
            if _queue(session, row.bench, at, (current,)).next() is None:
                return None
            row.context = context
            row.not_before = None
            if row.reservation is not None:
                _note_ended_reservation(session, row, at)
            move_job(session, row, JobState.RUNNING, at)
            return job_of_row(row)

    def running(self, bench: str) -> QueueEntry | None:
        with self._database.read() as session:
            row = session.execute(_RUNNING, {"bench": bench}).first()
            return None if row is None else QueueEntry(*row)

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
    entries = tuple(QueueEntry(*row[:-1]) for row in rows if row.state == QUEUED)
    return _queue(session, bench, at, entries, running)


def _queue(
    session: Session, bench: str, at: datetime, entries: tuple[QueueEntry, ...], running: str | None = None
) -> BenchQueue:
    """Combine these entries with everything that may keep them from starting."""
    manual = open_lease(session, bench)
    if not entries:
        return BenchQueue(bench, at, (), running, manual=manual)
    stops, reservations = standing_stops(session, bench), active_reservations(session, at)
    return BenchQueue(bench, at, entries, running, stops, reservations, manual)


def _running(session: Session, bench: str) -> str | None:
    """Return the id of the job that drives a bench."""
    return session.scalar(_RUNNING, {"bench": bench})


def _entries(session: Session, bench: str, limit: int, after: QueueEntry | None = None) -> tuple[QueueEntry, ...]:
    """Read the first entries that wait for a bench, or those that follow one of them."""
    asked: dict[str, Any] = {"bench": bench, "limit": limit}
    if after is not None:
        asked |= {"last_priority": after.priority, "last_queued_at": after.queued_at, "last_id": after.id}
    return tuple(QueueEntry(*row) for row in session.execute(_FRONT if after is None else _FURTHER, asked))


def _note_ended_reservation(session: Session, row: JobRow, at: datetime) -> None:
    """Append a note to a job whose reservation ended before its turn; the job runs all the same."""
    kept = session.get(ReservationRow, row.reservation)
    if kept is None or not reservation_of_row(kept).active(at):
        over = "" if kept is None else f" at {reservation_of_row(kept).over_at.isoformat()}"
        text = f"reservation {row.reservation} ended{over}, before this job's turn: it runs as an ordinary job"
        append_event(session, row.id, "note", at, {"text": text})
