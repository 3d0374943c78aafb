"""The context of a job: its unit and bench as they were known, stored with the job as JSON."""

from pydantic import TypeAdapter

from bench_service.model.errors import NotUnderstood
from bench_service.model.job import Job
from procedures.core.errors import DomainError
from procedures.procedure import Context

CONTEXT = TypeAdapter(Context)


def context_of(job: Job) -> Context:
    """Read a job's context back from JSON. Raises `NotUnderstood`."""
    try:
        return CONTEXT.validate_python(job.context)
    except (ValueError, DomainError) as error:
        raise NotUnderstood(job.id, job.code_version, error) from error
