"""A job as a row and back. Knows the two shapes only; no transaction begins here."""

from typing import Any

from pydantic import TypeAdapter

from bench_service.mapping import copied
from bench_service.model.errors import NotUnderstood
from bench_service.model.job import Event, Failure, Job, JobState
from bench_service.persistence.tables.jobs import EventRow, JobRow
from procedures.core.errors import DomainError
from procedures.core.limits import Verdict
from procedures.core.recording import Station

STATIONS = TypeAdapter(tuple[Station, ...])
FAILURE = TypeAdapter(Failure)


def row_of_job(job: Job) -> JobRow:
    """Convert a job to its row."""
    return copied(
        JobRow,
        job,
        state=job.state.value,
        stations=STATIONS.dump_python(job.stations, mode="json"),
        verdict=job.verdict and job.verdict.value,
        queued_at=job.queued_at or job.created_at,
        failure=failure_document(job.failure),
    )


def job_of_row(row: JobRow) -> Job:
    """Convert a row to its job. Raises `NotUnderstood` where another version wrote it in a form that this one cannot
    read.
    """
    try:
        return copied(
            Job,
            row,
            state=JobState(row.state),
            stations=STATIONS.validate_python(row.stations),
            verdict=None if row.verdict is None else Verdict(row.verdict),
            failure=None if row.failure is None else FAILURE.validate_python(row.failure),
        )
    except (ValueError, TypeError, DomainError) as error:
        raise NotUnderstood(row.id, row.code_version, error) from error


def state_of_row(row: JobRow) -> JobState:
    """Read the state from a row. Raises `NotUnderstood`."""
    try:
        return JobState(row.state)
    except ValueError as error:
        raise NotUnderstood(row.id, row.code_version, error) from error


def event_of_row(row: EventRow) -> Event:
    """Convert a row to its event."""
    return copied(Event, row)


def failure_document(failure: Failure | None) -> dict[str, Any] | None:
    """Return the failure of a job as a JSON object; None for no failure."""
    return None if failure is None else FAILURE.dump_python(failure, mode="json")
