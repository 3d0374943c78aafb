"""Routes of jobs: submit, read, watch, cancel, and read the result."""

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import Header, Query, Response
from fastapi.responses import JSONResponse, StreamingResponse

from bench_service.access.service import require_team
from bench_service.api.access.teams import TeamOfJob
from bench_service.api.http.dependencies import (
    After,
    ClientName,
    Hub,
    IdempotencyKey,
    Limit,
    Me,
    ProvenName,
    RequestedBy,
    Service,
)
from bench_service.api.http.errors import made, problems
from bench_service.api.http.job_numbers import JobByNumber
from bench_service.api.http.queries import Searched
from bench_service.api.jobs import event_stream
from bench_service.api.jobs.schemas import (
    CancelRequest,
    EventView,
    ForeignJob,
    JobChange,
    JobPage,
    JobSubmission,
    JobView,
    NoteRequest,
    PromptAnswer,
    Reanalysis,
    Truth,
)
from bench_service.api.results import ResultPage, ResultView
from bench_service.bench.prompts import Answer
from bench_service.jobs.events.hub import EventHub
from bench_service.mapping import copied
from bench_service.model.errors import NotUnderstood
from bench_service.model.job import Job, JobState
from bench_service.model.request import JobRequest
from bench_service.routing import Routes
from bench_service.service import BenchService
from bench_service.wall_clock import now

router = Routes(prefix="/api/v1/jobs", tags=["jobs"], dependencies=[JobByNumber])

OF_A_JOB = (
    "read_job",
    "change_job",
    "cancel",
    "answer",
    "add_note",
    "pause",
    "resume",
    "events",
    "read_result",
    "read_truth",
    "analyse_again",
)
"""Names of the routes that work on an existing job."""


@router.post(
    "",
    status_code=202,
    responses={
        **problems(404, 409, 413, 507),
        **made(202, "job_id", *OF_A_JOB),
    },
)
def submit(
    body: JobSubmission,
    service: Service,
    response: Response,
    requested_by: RequestedBy,
    me: Me,
    key: IdempotencyKey = None,
) -> JobView:
    """Submit a job to the queue. The same `Idempotency-Key` with the same body gives the job of the first request.

    An operator submits approved procedures; under a reservation, a member of its team.
    """
    service.access.require_approved(me, body.procedure, lambda: service.catalogue.procedure(body.procedure).version)
    require_team(me, service.queues.team_of(body.reservation), f"reservation {body.reservation}")
    job = service.jobs.submit(copied(JobRequest, body), key, requested_by or "")
    response.headers["Location"] = f"/api/v1/jobs/{job.id}"
    return _view(service, job)


def _view(service: BenchService, job: Job) -> JobView:
    return JobView.of(job, service.queues.standing([job])[job.id], service.live.of_job(job))


@router.get("", responses=problems())
def list_jobs(
    service: Service,
    search: Searched,
    state: JobState | None = None,
    procedure: Annotated[str | None, Query(max_length=100)] = None,
    unit: Annotated[str | None, Query(max_length=100)] = None,
    bench: Annotated[str | None, Query(max_length=100)] = None,
    after: After = None,
    limit: Limit = 50,
) -> JobPage:
    """List the jobs, newest first."""
    page = service.stores.jobs.list(
        state=state, procedure=procedure, unit=unit, bench=bench, search=search, after=after, limit=limit
    )
    standing = service.queues.standing(page.items)
    items = [JobView.of(job, standing[job.id], service.live.of_job(job)) for job in page.items]
    return JobPage(items=items, next=page.next)


@router.get("/{job_id}", responses=problems(404, 409))
def read_job(job_id: str, service: Service) -> JobView:
    """Read one job: its state, its place in the queue and why it waits."""
    return _view(service, service.stores.jobs.get(job_id))


@router.patch("/{job_id}", responses=problems(404, 409, 413, 507), dependencies=[TeamOfJob])
def change_job(job_id: str, body: JobChange, service: Service) -> JobView:
    """Change the priority of a queued job, and with it its place in the queue."""
    return _view(service, service.jobs.set_priority(job_id, body.priority))


@router.post(
    "/{job_id}/cancel",
    status_code=202,
    dependencies=[TeamOfJob],
    response_model=JobView,
    responses={
        **problems(404, 409, 413, 507),
        200: {"model": ForeignJob, "description": "Noted; the job is not understood here"},
    },
)
def cancel(
    job_id: str, service: Service, client: ClientName, proven: ProvenName, body: CancelRequest | None = None
) -> JobView | JSONResponse:
    """Cancel a job: a queued one at once, a running one as soon as its bench is safe. Its recordings are kept.

    An event of the kind `note` has who cancelled it and why.
    A job that this version does not understand is cancelled too; the answer then holds only its state.
    """
    try:
        asked = body or CancelRequest.model_validate({})
        return _view(service, service.jobs.cancel(job_id, proven or asked.by or client, asked.reason))
    except NotUnderstood as error:
        _, state = service.stores.jobs.last_event(job_id)
        return JSONResponse(ForeignJob(id=job_id, state=state, waiting=str(error)).model_dump(mode="json"), 200)


@router.post("/{job_id}/pause", status_code=202, responses=problems(404, 409, 507), dependencies=[TeamOfJob])
def pause(job_id: str, service: Service) -> JobView:
    """Pause a job: a queued one at once, a running one before its next station. The bench is then safe and free."""
    return _view(service, service.jobs.pause(job_id))


@router.post("/{job_id}/answer", status_code=202, responses=problems(404, 409, 413, 507), dependencies=[TeamOfJob])
def answer(job_id: str, body: PromptAnswer, service: Service, requested_by: RequestedBy) -> JobView:
    """Confirm that the person at the bench did what the job's prompt asks (`prompt`), or decline it."""
    said = Answer(body.done, body.remark, requested_by or "")
    return _view(service, service.stores.prompts.answer(job_id, body.prompt, said, now()))


@router.post("/{job_id}/notes", status_code=201, responses=problems(404, 409, 413, 507), dependencies=[TeamOfJob])
def add_note(job_id: str, body: NoteRequest, service: Service, client: ClientName, proven: ProvenName) -> EventView:
    """Add a person's remark to a job: an event of the kind `note`, with its author."""
    said = {"text": body.text, "by": proven or body.by or client}
    service.stores.jobs.note(job_id, "note", now(), said)
    last, _ = service.stores.jobs.last_event(job_id)
    return EventView.of(service.stores.jobs.events(job_id, last - 1)[0])


@router.post("/{job_id}/resume", status_code=202, responses=problems(404, 409, 507), dependencies=[TeamOfJob])
def resume(job_id: str, service: Service) -> JobView:
    """Resume a paused, interrupted or resumable failed job: it is queued again and does the stations that remain."""
    return _view(service, service.jobs.resume(job_id))


@router.get(
    "/{job_id}/events",
    response_class=StreamingResponse,
    responses={**problems(404, 409), **event_stream.DOCUMENTED},
)
async def events(
    job_id: str,
    hub: Hub,
    last_event_id: Annotated[int, Header(alias="Last-Event-ID", ge=0, le=2**31)] = 0,
) -> StreamingResponse:
    """Stream the job's events as server-sent events, from after `Last-Event-ID`, until it has ended."""
    await hub.require(job_id)
    told = _told(hub, job_id, last_event_id)
    return StreamingResponse(told, media_type="text/event-stream", headers=event_stream.HEADERS)


async def _told(hub: EventHub, job_id: str, after: int) -> AsyncIterator[bytes]:
    yield event_stream.HEAD
    async for frame in hub.follow(job_id, after):
        yield frame


@router.get("/{job_id}/result", responses={**problems(404, 409), 304: {"description": "Not modified"}})
def read_result(
    job_id: str,
    service: Service,
    response: Response,
    if_none_match: Annotated[str | None, Header(max_length=200)] = None,
) -> ResultView:
    """Read the result that gave the job its verdict. It never changes, so an ETag saves reading it twice."""
    result = service.jobs.result_of(job_id)
    etag = f'"{result.id}"'
    if if_none_match == etag:
        return Response(status_code=304, headers={"ETag": etag})  # pyright: ignore[reportReturnType]
    response.headers["ETag"] = etag
    return ResultView.of(result)


@router.get("/{job_id}/truth", responses=problems(404, 409))
def read_truth(job_id: str, service: Service) -> Truth:
    """Read the true values of the simulated unit in this job; 404 on a real bench."""
    return Truth(job=job_id, triads=list(service.jobs.truth(job_id)))


@router.post("/{job_id}/analyses", status_code=201, responses=problems(404, 409, 413, 507))
def analyse_again(
    job_id: str, body: Reanalysis, service: Service, response: Response, key: IdempotencyKey = None
) -> ResultView:
    """Analyse the job's recordings with other parameters. No bench is needed; the first result stays."""
    result = service.analyses.analyse_again(job_id, body.parameters, key)
    response.headers["Location"] = f"/api/v1/results/{result.id}"
    return ResultView.of(result)


@router.get("/{job_id}/analyses", responses=problems(404, 409))
def list_analyses(job_id: str, service: Service, after: After = None, limit: Limit = 50) -> ResultPage:
    """List every result of the job's recordings taken as a whole, newest first."""
    service.stores.jobs.get(job_id)
    page = service.stores.results.list(job_id=job_id, after=after, limit=limit)
    return ResultPage(items=[ResultView.of(result) for result in page.items], next=page.next)
