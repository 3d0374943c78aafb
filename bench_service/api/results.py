"""Routes of results: run a method on stored evidence, and read results by id."""

from dataclasses import replace
from datetime import datetime
from typing import Annotated, Any

from fastapi import Query, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field

from bench_service.api.batches import BatchView, RecordingSelection
from bench_service.api.http.dependencies import After, IdempotencyKey, Limit, RequestedBy, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.fields import NAME, Request
from bench_service.api.http.printed import PDF, PRINTED, printed
from bench_service.api.http.queries import Searched
from bench_service.evidence.analyses import AnalysisRequest
from bench_service.evidence.recomputation import Recomputation
from bench_service.jobs.numbers import job_id_of
from bench_service.mapping import copied
from bench_service.model.batches import BatchRequest, Grouping
from bench_service.model.records import StoredResult
from bench_service.routing import Routes
from bench_service.service import BenchService
from procedures.core.errors import BadParameter
from procedures.core.limits import Verdict
from procedures.core.mounting import Mounting
from procedures.core.report import Figure, Table

router = Routes(prefix="/api/v1", tags=["analyses"])


class AnalysisSubmission(Request):
    """Request to run a method: its name, its evidence and its parameters."""

    method: str = NAME
    recordings: list[str] = Field(default_factory=list[str], max_length=1000)
    calibrations: list[str] = Field(default_factory=list[str], max_length=1000)
    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])
    unit: str | None = Field(
        None, max_length=100, description="Serial of the unit; null: that of the evidence. Needed without evidence"
    )
    selection: RecordingSelection | None = Field(
        None, description="Instead of `recordings`: a query; a batch with one task for each group is queued (202)"
    )
    each: Grouping = Field(Grouping.RECORDING, description="With `selection`: recordings that are analysed together")
    priority: int = Field(10, ge=0, le=100, description="With `selection`: among batches, smaller runs first")


class Lineage(BaseModel):
    """The lineage of a result: the recordings, calibrations and code that made it."""

    recordings: list[dict[str, str]] = Field(description="id and content hash of each recording, in order")
    calibrations: list[str]
    corrections: list[str] = Field(description="Ids of the correction sets that were applied")
    parameters: dict[str, Any]
    code_version: str
    simulated: bool
    seed: int | None
    job: str | None
    mounting: Mounting | None = Field(description="Mounting of the unit whose azimuth counts; null: the bench's own")

    @classmethod
    def of(cls, result: StoredResult) -> "Lineage":
        """Return the lineage of a stored result in its HTTP form."""
        recordings = [{"id": i, "content_hash": h} for i, h in result.recordings]
        return copied(cls, result, recordings=recordings, job=result.job_id, mounting=result.context.get("mounting"))


class ResultView(BaseModel):
    """A result: the document of its procedure or method, and its lineage."""

    id: str
    kind: str
    name: str
    version: str
    unit: str | None
    verdict: Verdict
    created_at: datetime
    document: dict[str, Any]
    lineage: Lineage
    page: str

    @classmethod
    def of(cls, result: StoredResult) -> "ResultView":
        return copied(cls, result, lineage=Lineage.of(result), page=f"/results/{result.id}")


class ReportSection(BaseModel):
    """A section of a report: a table or a figure, the other is null."""

    table: Table | None
    figure: Figure | None


class ReportView(BaseModel):
    """A result as people read it, in the order in which they meet it."""

    summary: str
    sections: list[ReportSection]


class ResultPage(BaseModel):
    """One page of results, newest first."""

    items: list[ResultView]
    next: str | None


@router.post(
    "/analyses",
    status_code=201,
    response_model=ResultView,
    responses={
        **problems(404, 409, 413, 507),
        **made(201, "result_id", "read_result_by_id"),
        202: {"model": BatchView, "description": "With `selection`: the batch is queued"},
    },
)
def run_method(
    body: AnalysisSubmission,
    service: Service,
    response: Response,
    requested_by: RequestedBy,
    key: IdempotencyKey = None,
) -> ResultView | JSONResponse:
    """Run a method on given recordings or calibrations of one unit; with a selection, queue a batch of analyses.

    The tasks of a batch run in processes of their own, here or on other machines, and give way to jobs on benches. A
    task takes the stored result of the same content (recordings by their hashes, method, version, parameters,
    calibrations, the unit's record) where there is one. Too many waiting tasks are refused with 503 and `Retry-After`.
    """
    if body.selection is not None:
        return _queued(body, body.selection, service, requested_by or "", key)
    given = {"recordings": tuple(body.recordings), "calibrations": tuple(body.calibrations)}
    request = copied(AnalysisRequest, body, **given)
    result = service.analyses.run_method(request, key)
    response.headers["Location"] = f"/api/v1/results/{result.id}"
    return ResultView.of(result)


def _queued(
    body: AnalysisSubmission, selection: RecordingSelection, service: BenchService, by: str, key: str | None
) -> JSONResponse:
    if body.recordings:
        raise BadParameter("recordings", body.recordings[0], "either recordings or a selection (selection.ids)")
    if body.unit is not None:
        raise BadParameter("unit", body.unit, "none: a batch takes the unit of each recording")
    query = selection.query()
    if query.job is not None:
        query = replace(query, job=job_id_of(service.stores, query.job))
    wanted = copied(BatchRequest, body, selection=query, calibrations=tuple(body.calibrations))
    batch = service.batches.submit(wanted, by, key)
    view = BatchView.of(batch).model_dump(mode="json")
    return JSONResponse(view, 202, {"Location": f"/api/v1/analyses/batches/{batch.id}"})


@router.get("/results", responses=problems())
def list_results(
    service: Service,
    search: Searched,
    unit: Annotated[str | None, Query(max_length=100)] = None,
    name: Annotated[str | None, Query(max_length=100, description="Name of the procedure or method")] = None,
    after: After = None,
    limit: Limit = 50,
) -> ResultPage:
    """List the results, newest first."""
    page = service.stores.results.list(unit=unit, name=name, search=search, after=after, limit=limit)
    return ResultPage(items=[ResultView.of(result) for result in page.items], next=page.next)


@router.get("/results/{result_id}/report", responses=problems(404))
def read_report(result_id: str, service: Service) -> ReportView:
    """Read a result's report for people: its tables and figures as data."""
    report = service.catalogue.report(service.stores.results.get(result_id))
    sections = [
        ReportSection(table=None, figure=section)
        if isinstance(section, Figure)
        else ReportSection(table=section, figure=None)
        for section in report.sections
    ]
    return ReportView(summary=report.summary, sections=sections)


@router.get("/results/{result_id}/report.pdf", response_class=Response, responses={**problems(404), **PDF})
async def read_printed_report(result_id: str, service: Service) -> Response:
    """Read a result's report as PDF/A-3, with the result attached as JSON. Refused with 503 where too many wait."""
    return printed(await PRINTED.run(service.reports.of_result, result_id), f"{result_id}.pdf")


@router.post("/results/{result_id}/recomputation", responses=problems(404, 409, 507))
def recompute(result_id: str, service: Service) -> Recomputation:
    """Hash a result's stored samples and compute it again with the code of now; nothing is stored."""
    return service.recomputations.recomputed(result_id)


@router.get("/results/{result_id}", responses=problems(404))
def read_result_by_id(result_id: str, service: Service) -> ResultView:
    """Read one result with its lineage."""
    return ResultView.of(service.stores.results.get(result_id))
