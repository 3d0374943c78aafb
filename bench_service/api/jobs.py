"""Jobs: submit, read, watch, cancel, and what came out."""

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from bench_service.api.dependencies import After, IdempotencyKey, Limit, Service
from bench_service.api.errors import made, problems
from bench_service.api.job_schemas import EventView, JobPage, JobView
from bench_service.api.requests import JobChange, JobSubmission, Reanalysis
from bench_service.api.schemas import ResultPage, ResultView, Truth
from bench_service.jobs.job import FINAL, Job, JobState
from bench_service.jobs.request import JobRequest
from bench_service.jobs.service import BenchService
from bench_service.wall_clock import pause_async

router = APIRouter(prefix="/api/v1/jobs", tags=["jobs"])

WATCH_S = 0.1
"""How often a listener's job is looked at for new events."""
HEARTBEAT_S = 15.0
"""A comment line at least this often, so that proxies keep the connection."""
EVENT_STREAM: dict[int | str, dict[str, object]] = {
    200: {
        "description": "Server-sent events; `id` is the sequence, `event` the kind, `data` an EventView",
        "content": {"text/event-stream": {"schema": {"type": "string"}}},
    }
}


OF_A_JOB = (
    "read_job",
    "change_job",
    "cancel",
    "pause",
    "resume",
    "events",
    "read_result",
    "read_truth",
    "analyse_again",
)
"""What can be asked of a job once there is one."""


@router.post(
    "",
    status_code=202,
    responses={
        **problems(404, 409, 507),
        **made(
            202,
            "job_id",
            "read_job",
            "change_job",
            "cancel",
            "pause",
            "resume",
            "events",
            "read_result",
            "read_truth",
            "analyse_again",
        ),
    },
)
def submit(body: JobSubmission, service: Service, response: Response, key: IdempotencyKey = None) -> JobView:
    """Queue a job. The same `Idempotency-Key` with the same body gives the job that the first one made."""
    job = service.submit(
        JobRequest(
            body.procedure,
            body.unit,
            body.bench,
            body.parameters,
            body.priority,
            body.labels,
            body.seed,
            body.deadline_at,
            body.retries,
            body.reservation,
        ),
        key,
    )
    response.headers["Location"] = f"/api/v1/jobs/{job.id}"
    return _view(service, job)


def _view(service: BenchService, job: Job) -> JobView:
    return JobView.of(job, service.queues.standing([job])[job.id])


@router.get("", responses=problems())
def list_jobs(
    service: Service,
    state: JobState | None = None,
    procedure: Annotated[str | None, Query(max_length=100)] = None,
    unit: Annotated[str | None, Query(max_length=100)] = None,
    after: After = None,
    limit: Limit = 50,
) -> JobPage:
    """Jobs, newest first."""
    page = service.stores.jobs.list(state=state, procedure=procedure, unit=unit, after=after, limit=limit)
    standing = service.queues.standing(page.items)
    return JobPage(items=[JobView.of(job, standing[job.id]) for job in page.items], next=page.next)


@router.get("/{job_id}", responses=problems(404))
def read_job(job_id: str, service: Service) -> JobView:
    """One job: everything that is known of it, its place in the queue and why it waits."""
    return _view(service, service.stores.jobs.get(job_id))


@router.patch("/{job_id}", responses=problems(404, 409, 507))
def change_job(job_id: str, body: JobChange, service: Service) -> JobView:
    """Change the priority of a queued job, and with it its place in the queue."""
    return _view(service, service.set_priority(job_id, body.priority))


@router.post("/{job_id}/cancel", status_code=202, responses=problems(404, 409))
def cancel(job_id: str, service: Service) -> JobView:
    """End a job: a queued one at once, a running one as soon as its bench is safe. Its recordings are kept."""
    return _view(service, service.cancel(job_id))


@router.post("/{job_id}/pause", status_code=202, responses=problems(404, 409))
def pause(job_id: str, service: Service) -> JobView:
    """Put a job aside: a queued one at once, a running one before its next station. The bench is then safe and free."""
    return _view(service, service.pause(job_id))


@router.post("/{job_id}/resume", status_code=202, responses=problems(404, 409))
def resume(job_id: str, service: Service) -> JobView:
    """Queue a paused, interrupted or resumable failed job again; it goes on with the stations that remain."""
    return _view(service, service.resume(job_id))


@router.get("/{job_id}/events", response_class=StreamingResponse, responses={**problems(404), **EVENT_STREAM})
async def events(
    job_id: str,
    request: Request,
    service: Service,
    last_event_id: Annotated[int, Header(alias="Last-Event-ID", ge=0, le=2**31)] = 0,
) -> StreamingResponse:
    """Everything that happens to the job as server-sent events, from after `Last-Event-ID`, until it has ended."""
    await run_in_threadpool(service.stores.jobs.get, job_id)
    return StreamingResponse(_watch(job_id, request, service, last_event_id), media_type="text/event-stream")


async def _watch(job_id: str, request: Request, service: BenchService, after: int) -> AsyncIterator[str]:
    quiet_s = 0.0
    while not await request.is_disconnected():
        job = await run_in_threadpool(service.stores.jobs.get, job_id)
        fresh = await run_in_threadpool(service.stores.jobs.events, job_id, after)
        for event in fresh:
            after = event.sequence
            yield f"id: {event.sequence}\nevent: {event.kind}\ndata: {EventView.of(event).model_dump_json()}\n\n"
        if not fresh and (job.state in FINAL or job.state is JobState.INTERRUPTED):
            return
        quiet_s = 0.0 if fresh else quiet_s + WATCH_S
        if quiet_s >= HEARTBEAT_S:
            quiet_s = 0.0
            yield ": still here\n\n"
        await pause_async(WATCH_S)


@router.get("/{job_id}/result", responses={**problems(404), 304: {"description": "Not modified"}})
def read_result(
    job_id: str,
    service: Service,
    response: Response,
    if_none_match: Annotated[str | None, Header(max_length=200)] = None,
) -> ResultView:
    """The result that gave the job its verdict. It never changes, so an ETag saves reading it twice."""
    result = service.result_of(job_id)
    etag = f'"{result.id}"'
    if if_none_match == etag:
        return Response(status_code=304, headers={"ETag": etag})  # pyright: ignore[reportReturnType]
    response.headers["ETag"] = etag
    return ResultView.of(result)


@router.get("/{job_id}/truth", responses=problems(404))
def read_truth(job_id: str, service: Service) -> Truth:
    """What the simulated unit really was in this job; 404 on a real bench."""
    return Truth(job=job_id, triads=list(service.truth(job_id)))


@router.post("/{job_id}/analyses", status_code=201, responses=problems(404, 409, 507))
def analyse_again(
    job_id: str, body: Reanalysis, service: Service, response: Response, key: IdempotencyKey = None
) -> ResultView:
    """Analyse the job's recordings with other parameters. No bench is needed; the first result stays."""
    result = service.analyses.analyse_again(job_id, body.parameters, key)
    response.headers["Location"] = f"/api/v1/results/{result.id}"
    return ResultView.of(result)


@router.get("/{job_id}/analyses", responses=problems(404))
def list_analyses(job_id: str, service: Service, after: After = None, limit: Limit = 50) -> ResultPage:
    """Every result of the job's recordings taken as a whole, newest first."""
    service.stores.jobs.get(job_id)
    page = service.stores.results.list(job_id=job_id, after=after, limit=limit)
    return ResultPage(items=[ResultView.of(result) for result in page.items], next=page.next)
