"""Searches of jobs, recordings and results as SQL, by everything but a text: `text_search` has that.

Ids sort by time, so a moment bounds the ids too: a search for an old month does not walk over everything newer.
"""

from datetime import datetime, timedelta
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Select, exists, select
from sqlalchemy.orm import InstrumentedAttribute

from bench_service.model.search import LabelSought, Search
from bench_service.persistence.tables.evidence import RecordingRow, ResultRow
from bench_service.persistence.tables.jobs import JobLabelRow, JobRow

S = TypeVar("S", bound=Select[*tuple[Any, ...]])
CLOCK_DIFFERS = timedelta(hours=1)
"""Longest time by which the moment in an id may differ from the moment that is stored with it."""


def find_jobs(query: S, search: Search) -> S:
    """Return a query of jobs restricted by a search, except for its text."""
    query = _made(query, JobRow.id, JobRow.created_at, search)
    if search.verdict is not None:
        query = query.where(JobRow.verdict == search.verdict.value)
    return query.where(*(_has_label(label, JobRow.id) for label in search.labels))


def find_recordings(query: S, search: Search) -> S:
    """Return a query of recordings restricted by a search; verdict and labels are those of the job that recorded."""
    query = _made(query, RecordingRow.id, RecordingRow.created_at, search)
    job = RecordingRow.job_id == JobRow.id
    if search.verdict is not None:
        query = query.where(exists().where(job, JobRow.verdict == search.verdict.value))
    return query.where(*(_has_label(label, RecordingRow.job_id) for label in search.labels))


def find_results(query: S, search: Search) -> S:
    """Return a query of results restricted by a search; labels are those of the job whose recordings were analysed."""
    query = _made(query, ResultRow.id, ResultRow.created_at, search)
    if search.verdict is not None:
        query = query.where(ResultRow.verdict == search.verdict.value)
    return query.where(*(_has_label(label, ResultRow.job_id) for label in search.labels))


def _made(query: S, key: InstrumentedAttribute[str], at: InstrumentedAttribute[datetime], search: Search) -> S:
    if search.since is not None:
        query = query.where(at >= search.since, key >= first_id(search.since, -CLOCK_DIFFERS))
    if search.until is not None:
        query = query.where(at < search.until, key < first_id(search.until, CLOCK_DIFFERS))
    return query


def first_id(moment: datetime, shift: timedelta = timedelta(0)) -> str:
    """Return the beginning of the ids that are made from a moment on; it sorts before all of them."""
    try:
        seconds = (moment + shift).timestamp()
    except OverflowError:  # at the ends of the calendar
        seconds = moment.timestamp()
    digits = f"{min(max(0, int(seconds * 1000)), 2**48 - 1):012x}"
    return f"{digits[:8]}-{digits[8:]}"


def _has_label(label: LabelSought, job: ColumnElement[Any] | InstrumentedAttribute[Any]) -> ColumnElement[bool]:
    """Restrict to the jobs that have a label: a walk over an index of the labels, however long the history."""
    having = select(JobLabelRow.job_id).where(JobLabelRow.name == label.name)
    return job.in_(having if label.value is None else having.where(JobLabelRow.value == label.value))
