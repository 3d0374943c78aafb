"""A job as a row and back. Knows the two shapes only; no transaction begins here."""

from typing import Any

from pydantic import TypeAdapter

from bench_service.model.errors import NotUnderstood
from bench_service.model.job import Event, Failure, Job, JobState
from bench_service.persistence.tables.jobs import EventRow, JobRow
from procedures.core.errors import DomainError
from procedures.core.limits import Verdict
from procedures.core.recording import Station

STATIONS = TypeAdapter(tuple[Station, ...])
FAILURE = TypeAdapter(Failure)


def row_of_job(job: Job) -> JobRow:
    """The row that keeps a job."""
    return JobRow(
        id=job.id,
        procedure=job.procedure,
        procedure_version=job.procedure_version,
        unit=job.unit,
        bench=job.bench,
        state=job.state.value,
        created_at=job.created_at,
        requested_parameters=job.requested_parameters,
        parameters=job.parameters,
        context=job.context,
        stations=STATIONS.dump_python(job.stations, mode="json"),
        duration_s=job.duration_s,
        code_version=job.code_version,
        simulated=job.simulated,
        seed=job.seed,
        priority=job.priority,
        labels=job.labels,
        verdict=job.verdict and job.verdict.value,
        stations_done=job.stations_done,
        cancel_requested=job.cancel_requested,
        pause_requested=job.pause_requested,
        attempt=job.attempt,
        deadline_at=job.deadline_at,
        queued_at=job.queued_at or job.created_at,
        not_before=job.not_before,
        retries=job.retries,
        retries_left=job.retries_left,
        reservation=job.reservation,
        requested_by=job.requested_by,
        prompt=job.prompt,
        started_at=job.started_at,
        finished_at=job.finished_at,
        result_id=job.result_id,
        failure=failure_document(job.failure),
    )


def job_of_row(row: JobRow) -> Job:
    """The job that a row keeps. Raises `NotUnderstood`."""
    try:
        return _job_of_row(row)
    except (ValueError, TypeError, DomainError) as error:
        raise NotUnderstood(row.id, row.code_version, error) from error


def state_of_row(row: JobRow) -> JobState:
    """The state that a row keeps. Raises `NotUnderstood`."""
    try:
        return JobState(row.state)
    except ValueError as error:
        raise NotUnderstood(row.id, row.code_version, error) from error


def _job_of_row(row: JobRow) -> Job:
    return Job(
        id=row.id,
        procedure=row.procedure,
        procedure_version=row.procedure_version,
        unit=row.unit,
        bench=row.bench,
        state=JobState(row.state),
        created_at=row.created_at,
        requested_parameters=row.requested_parameters,
        parameters=row.parameters,
        context=row.context,
        stations=STATIONS.validate_python(row.stations),
        duration_s=row.duration_s,
        code_version=row.code_version,
        simulated=row.simulated,
        seed=row.seed,
        priority=row.priority,
        labels=row.labels,
        verdict=None if row.verdict is None else Verdict(row.verdict),
        stations_done=row.stations_done,
        cancel_requested=row.cancel_requested,
        pause_requested=row.pause_requested,
        attempt=row.attempt,
        deadline_at=row.deadline_at,
        queued_at=row.queued_at,
        not_before=row.not_before,
        retries=row.retries,
        retries_left=row.retries_left,
        reservation=row.reservation,
        requested_by=row.requested_by,
        prompt=row.prompt,
        started_at=row.started_at,
        finished_at=row.finished_at,
        result_id=row.result_id,
        failure=None if row.failure is None else FAILURE.validate_python(row.failure),
    )


def event_of_row(row: EventRow) -> Event:
    """The event that a row keeps."""
    return Event(row.job_id, row.sequence, row.at, row.kind, row.data)


def failure_document(failure: Failure | None) -> dict[str, Any] | None:
    """Why a job failed, as JSON."""
    return None if failure is None else FAILURE.dump_python(failure, mode="json")
