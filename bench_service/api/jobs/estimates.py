"""Route of a job's estimates so far: Allan deviation and bias of the dwell, coefficients after each station."""

from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import problems
from bench_service.api.http.job_numbers import JobByNumber
from bench_service.evidence.so_far.documents import JobEstimates
from bench_service.routing import Routes

router = Routes(prefix="/api/v1/jobs", tags=["jobs"], dependencies=[JobByNumber])


@router.get("/{job_id}/estimates", responses=problems(404))
def read_estimates(job_id: str, service: Service) -> JobEstimates:
    """Estimate from what a job has recorded so far, in another process than the one that drives its bench.

    A recording is stored in chunks of some minutes, so a dwell has its first estimates after the first of them. Asked
    for by many, they are worked out once in two seconds.
    """
    return service.estimates.of_job(job_id)
