"""Numbers of jobs in addresses: 123 or #123 in the place of a job's id."""

from fastapi import Depends, Request
from starlette.concurrency import run_in_threadpool

from bench_service.jobs.numbers import job_id_of
from bench_service.model.job import job_number


async def _by_number(request: Request) -> None:
    """Put the id in the place of a number, before the route reads its path. Raises `NotFound`."""
    given = request.path_params.get("job_id")
    if isinstance(given, str) and job_number(given) is not None:
        request.path_params["job_id"] = await run_in_threadpool(job_id_of, request.app.state.service.stores, given)


JobByNumber = Depends(_by_number)
"""Dependency of routes with `{job_id}`: those of a router are met before those of a route."""
