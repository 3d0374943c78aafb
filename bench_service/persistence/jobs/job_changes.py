"""Changes of a job's row inside a transaction that the caller began: its state, and the event that records it."""

from datetime import datetime
from typing import Any

from sqlalchemy import bindparam, insert, select
from sqlalchemy.orm import Session

from bench_service.model.errors import IllegalTransition, NotFound
from bench_service.model.job import LEGAL, Failure, JobState
from bench_service.persistence.database import announce
from bench_service.persistence.jobs.job_rows import failure_document, state_of_row
from bench_service.persistence.tables.jobs import EventRow, JobRow
from procedures.core.limits import Verdict

_JOB = select(JobRow).where(JobRow.id == bindparam("id"))
_LOCKED_JOB = _JOB.with_for_update()
_EVENTS = EventRow.metadata.tables[EventRow.__tablename__]
_NEWEST = (
    select(_EVENTS.c.sequence, _EVENTS.c.at)
    .where(_EVENTS.c.job_id == bindparam("job"))
    .order_by(_EVENTS.c.sequence.desc())
    .limit(1)
)
_APPEND = insert(_EVENTS)
CLOCKS_DIFFER_S = 5.0
"""Difference up to which clocks of several hosts may disagree without a clock having been set back [s]."""


def found_job(session: Session, job_id: str, *, lock: bool = False) -> JobRow:
    """Return the row of a job, locked for this transaction where `lock` is true. Raises `NotFound`."""
    row = session.scalar(_LOCKED_JOB if lock else _JOB, {"id": job_id})
    if row is None:
        raise NotFound("job", job_id)
    return row


def move_job(
    session: Session,
    row: JobRow,
    to: JobState,
    at: datetime,
    verdict: Verdict | None = None,
    failure: Failure | None = None,
    result_id: str | None = None,
) -> None:
    """Change the state of a locked row and its dependent fields (None: as they are), and append an event. Raises
    `IllegalTransition`.
    """
    before = state_of_row(row)
    if to not in LEGAL[before]:
        raise IllegalTransition(f"job {row.id} is {before.value}; it cannot become {to.value}")
    if verdict is None and to is JobState.FAILED:
        verdict = Verdict.ERROR
    row.state = to.value
    row.prompt = None  # the prompt is repeated later, if it still matters
    data: dict[str, Any] = {"state": to.value, "before": before.value}
    if to is JobState.QUEUED:
        row.verdict = row.failure = row.finished_at = row.result_id = None
        row.cancel_requested = row.pause_requested = False
        row.attempt += 1
        row.queued_at = at
    elif to is JobState.RUNNING:
        row.started_at = row.started_at or at
    elif to is not JobState.PAUSED:
        row.finished_at = at
    if verdict is not None:
        row.verdict = data["verdict"] = verdict.value
    if failure is not None:
        row.failure = data["failure"] = failure_document(failure)
    if result_id is not None:
        row.result_id = data["result_id"] = result_id
    append_event(session, row.id, "state", at, data)


def append_event(session: Session, job_id: str, kind: str, at: datetime, data: dict[str, Any]) -> None:
    """Append the next event of a job whose row is locked.

    Its time is the clock's. Where that is before the event before it, the event records by how much: the order of
    events is that of their sequence.
    """
    sequence, before = session.execute(_NEWEST, {"job": job_id}).first() or (0, at)
    back_s = (before - at).total_seconds()
    if back_s > CLOCKS_DIFFER_S:
        data = {**data, "clock_set_back_s": round(back_s, 3)}
    session.execute(_APPEND, {"job_id": job_id, "sequence": sequence + 1, "at": at, "kind": kind, "data": data})
    announce(session, job_id)
