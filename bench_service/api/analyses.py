"""Results: methods run on stored evidence, and every result by its id."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from bench_service.api.dependencies import After, IdempotencyKey, Limit, Service
from bench_service.api.errors import made, problems
from bench_service.api.requests import AnalysisSubmission
from bench_service.api.schemas import ResultPage, ResultView
from bench_service.jobs.analyses import AnalysisRequest

router = APIRouter(prefix="/api/v1", tags=["analyses"])


@router.post(
    "/analyses",
    status_code=201,
    responses={**problems(404, 409, 413, 507), **made(201, "result_id", "read_result_by_id")},
)
def run_method(
    body: AnalysisSubmission, service: Service, response: Response, key: IdempotencyKey = None
) -> ResultView:
    """Run a method on given recordings or calibrations of one unit."""
    request = AnalysisRequest(body.method, tuple(body.recordings), tuple(body.calibrations), body.parameters)
    result = service.analyses.run_method(request, key)
    response.headers["Location"] = f"/api/v1/results/{result.id}"
    return ResultView.of(result)


@router.get("/results", responses=problems())
def list_results(
    service: Service, unit: Annotated[str | None, Query(max_length=100)] = None, after: After = None, limit: Limit = 50
) -> ResultPage:
    """Results, newest first."""
    page = service.stores.results.list(unit=unit, after=after, limit=limit)
    return ResultPage(items=[ResultView.of(result) for result in page.items], next=page.next)


@router.get("/results/{result_id}", responses=problems(404))
def read_result_by_id(result_id: str, service: Service) -> ResultView:
    """One result with its lineage."""
    return ResultView.of(service.stores.results.get(result_id))
