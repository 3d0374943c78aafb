"""Numbers of jobs: 123 or #123 in the place of a job's id, wherever a person names a job."""

from bench_service.jobs.stores import JobStores
from bench_service.model.job import job_number


def job_id_of(stores: JobStores, text: str) -> str:
    """Return the id of a job that is named by its id or its number. Raises `NotFound` for a number that no job has."""
    number = job_number(text)
    return text if number is None else stores.jobs.id_of(number)
