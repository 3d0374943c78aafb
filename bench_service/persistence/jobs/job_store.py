"""Jobs and their events in SQL. Knows which change of state is legal; must not know which caller asks for it, or why.

Every change reads the job's row under a lock (`FOR UPDATE`; on SQLite the writing transaction itself), so of two
processes that want different ends for one job, one wins and the other gets `IllegalTransition`.
"""

import logging
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from sqlalchemy import func, select

from bench_service.model.errors import IllegalTransition, NotFound, NotUnderstood
from bench_service.model.job import FINAL, Event, Failure, Job, JobHeading, JobState
from bench_service.model.records import Idempotency, Page
from bench_service.model.search import EVERYTHING, Search
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.jobs.job_changes import append_event, found_job, move_job
from bench_service.persistence.jobs.job_rows import event_of_row, job_of_row, row_of_job, state_of_row
from bench_service.persistence.paging import page
from bench_service.persistence.searching import find_jobs
from bench_service.persistence.tables.jobs import EventRow, JobLabelRow, JobRow
from bench_service.persistence.text_search import ways_to_jobs
from procedures.core.limits import Verdict

log = logging.getLogger(__name__)


class SqlJobStore:
    """SQL implementation of `bench_service.jobs.stores.JobStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._left_out: set[str] = set()
        """Ids of jobs that were not understood and are in the log already."""

    def add(self, job: Job, idempotency: Idempotency | None = None) -> Job:
        def once() -> Job:
            with self._database.write() as session:
                known = made_before(session, idempotency, "job")
                if known is not None:
                    return job_of_row(found_job(session, known))
                remember(session, idempotency, "job", job.id, job.created_at)
                numbered = replace(job, number=(session.scalar(select(func.max(JobRow.number))) or 0) + 1)
                session.add(row_of_job(numbered))
                session.flush()  # a conflict where a concurrent transaction took the number: retried with the next one
                session.add_all(JobLabelRow(job_id=job.id, name=k, value=v) for k, v in job.labels.items())
                append_event(session, job.id, "state", job.created_at, {"state": job.state.value})
                return numbered

        return again_after_conflict(once)

    def get(self, job_id: str) -> Job:
        with self._database.read() as session:
            return job_of_row(found_job(session, job_id))

    def id_of(self, number: int) -> str:
        with self._database.read() as session:
            found = session.scalar(select(JobRow.id).where(JobRow.number == number))
        if found is None:
            raise NotFound("job", f"#{number}")
        return found

    def numbers(self, ids: Sequence[str]) -> dict[str, int]:
        query = select(JobRow.id, JobRow.number).where(JobRow.id.in_(ids))
        with self._database.read() as session:
            return {row.id: row.number for row in session.execute(query)}

    def headings(self, ids: Sequence[str]) -> dict[str, JobHeading]:
        query = select(JobRow.id, JobRow.number, JobRow.procedure).where(JobRow.id.in_(ids))
        with self._database.read() as session:
            return {row.id: JobHeading(row.number, row.procedure) for row in session.execute(query)}

    def list(
        self,
        *,
        state: JobState | None = None,
        procedure: str | None = None,
        unit: str | None = None,
        bench: str | None = None,
        search: Search = EVERYTHING,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[Job]:
        query = find_jobs(select(JobRow), search)
        if state is not None:
            query = query.where(JobRow.state == state.value)
        if procedure is not None:
            query = query.where(JobRow.procedure == procedure)
        if unit is not None:
            query = query.where(JobRow.unit == unit)
        if bench is not None:
            query = query.where(JobRow.bench == bench)
        with self._database.read() as session:
            either = None if search.text is None else ways_to_jobs(session, search.text)
            return page(session, query, JobRow.id, after, limit, self._understood, either)

    def _understood(self, row: JobRow) -> Job | None:
        """Read a job for a list; None where it is not understood, which is logged once for each job."""
        try:
            return job_of_row(row)
        except NotUnderstood as error:
            if row.id not in self._left_out:
                self._left_out.add(row.id)
                log.warning("left out of lists: %s", error)
            return None

    def counts(self, states: Collection[JobState] = tuple(JobState)) -> dict[JobState, int]:
        counted = JobRow.state.in_([state.value for state in states])
        query = select(JobRow.state, func.count()).where(counted).group_by(JobRow.state)
        with self._database.read() as session:
            found = {state: number for state, number in session.execute(query)}  # noqa: C416  rows are not tuples
        return {state: found.get(state.value, 0) for state in states}

    def has_any(self) -> bool:
        with self._database.read() as session:
            return session.scalar(select(JobRow.id).limit(1)) is not None

    def transition(
        self,
        job_id: str,
        to: JobState,
        *,
        at: datetime,
        verdict: Verdict | None = None,
        failure: Failure | None = None,
        result_id: str | None = None,
    ) -> Job:
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            if row.state != to.value:
                move_job(session, row, to, at, verdict, failure, result_id)
            return job_of_row(row)

    def interrupt(self, job_id: str, at: datetime, failure: Failure) -> None:
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            to = JobState.CANCELLED if row.cancel_requested else JobState.INTERRUPTED
            move_job(session, row, to, at, failure=failure)

    def station_done(self, job_id: str, station: int, at: datetime, data: dict[str, Any]) -> Job:
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            if row.stations_done <= station:
                row.stations_done = station + 1
                append_event(session, job_id, "station", at, {"station": station, **data})
            return job_of_row(row)

    def request_cancel(self, job_id: str, at: datetime, by: str = "", reason: str = "") -> Job:
        said = {"cancel_requested": True} | {k: v for k, v in (("by", by), ("reason", reason)) if v}
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            state = state_of_row(row)
            if state in FINAL:
                raise IllegalTransition(f"job {job_id} has ended: it is {state.value}, and cannot be cancelled")
            if state in (JobState.QUEUED, JobState.PAUSED, JobState.INTERRUPTED):
                row.cancel_requested = True
                append_event(session, job_id, "note", at, said)
                move_job(session, row, JobState.CANCELLED, at)
            elif not row.cancel_requested:
                row.cancel_requested = True
                append_event(session, job_id, "note", at, said)
        return job_of_row(row)  # after the commit: one that is not understood is cancelled all the same

    def request_pause(self, job_id: str, at: datetime) -> Job:
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            state = JobState(row.state)
            if state is JobState.RUNNING:
                if not row.pause_requested:
                    row.pause_requested = True
                    append_event(session, job_id, "note", at, {"pause_requested": True})
            elif state is not JobState.PAUSED:
                move_job(session, row, JobState.PAUSED, at)
            return job_of_row(row)

    def put_aside(self, job_id: str, at: datetime) -> Job:
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            if JobState(row.state) is JobState.RUNNING:
                wanted = row.pause_requested
                move_job(session, row, JobState.CANCELLED if row.cancel_requested else JobState.PAUSED, at)
                if not wanted and row.state == JobState.PAUSED.value:
                    move_job(session, row, JobState.QUEUED, at)
            return job_of_row(row)

    def resume(self, job_id: str, at: datetime) -> Job:
        with self._database.write() as session:
            row = found_job(session, job_id, lock=True)
            if JobState(row.state) is JobState.RUNNING and row.pause_requested:
                row.pause_requested = False
                append_event(session, job_id, "note", at, {"pause_requested": False})
                return job_of_row(row)
            job = job_of_row(row)
            if job.state is JobState.RUNNING:
                raise IllegalTransition(
                    f"job {job_id} is running and no pause was requested: there is nothing to resume"
                )
            if job.state in FINAL and not job.resumable:
                why = "" if job.failure is None else f" ({job.failure.kind}: {job.failure.message})"
                raise IllegalTransition(f"job {job_id} is {row.state}{why}; it cannot be resumed")
            move_job(session, row, JobState.QUEUED, at)
            row.not_before, row.retries_left = None, row.retries
            if row.deadline_at is not None and row.deadline_at < at:  # it would fail again at once
                append_event(session, job_id, "note", at, {"deadline_lifted": row.deadline_at.isoformat()})
                row.deadline_at = None
            return job_of_row(row)

    def cancel_requested(self, job_id: str) -> bool:
        with self._database.read() as session:
            asked = session.scalar(select(JobRow.cancel_requested).where(JobRow.id == job_id))
        if asked is None:
            raise NotFound("job", job_id)
        return asked

    def note(self, job_id: str, kind: str, at: datetime, data: dict[str, Any]) -> None:
        with self._database.write() as session:
            found_job(session, job_id, lock=True)
            append_event(session, job_id, kind, at, data)

    def events(self, job_id: str, after: int = 0, limit: int = 1000) -> tuple[Event, ...]:
        query = (
            select(EventRow)
            .where(EventRow.job_id == job_id, EventRow.sequence > after)
            .order_by(EventRow.sequence)
            .limit(limit)
        )
        with self._database.read() as session:
            events = tuple(event_of_row(row) for row in session.scalars(query))
            if not events and session.scalar(select(JobRow.id).where(JobRow.id == job_id)) is None:
                raise NotFound("job", job_id)
        return events

    def last_event(self, job_id: str) -> tuple[int, JobState]:
        newest = select(func.max(EventRow.sequence)).where(EventRow.job_id == job_id).scalar_subquery()
        with self._database.read() as session:
            row = session.execute(select(newest, JobRow.state).where(JobRow.id == job_id)).one_or_none()
        if row is None:
            raise NotFound("job", job_id)
        return row[0] or 0, JobState(row[1])

    def on_event(self, tell: Callable[[str], None]) -> None:
        self._database.on_news(tell)
