"""Routes of batches of analyses: progress, tasks, cancel and retry. They are submitted over `POST /api/v1/analyses`."""

import json
from collections.abc import AsyncIterator
from datetime import datetime
from typing import Annotated, Any

from anyio import sleep, to_thread
from fastapi import Query
from fastapi.responses import StreamingResponse
from pydantic import AwareDatetime, BaseModel, Field

from bench_service.api.http.dependencies import After, ClientName, Limit, ProvenName, Service
from bench_service.api.http.errors import problems
from bench_service.api.http.fields import Request
from bench_service.api.http.queries import LABEL
from bench_service.api.jobs import event_stream
from bench_service.mapping import copied
from bench_service.model.batches import AnalysisBatch, AnalysisTask, BatchState, Grouping, Selection, TaskState
from bench_service.model.job import Failure
from bench_service.model.search import LabelSought, Search
from bench_service.routing import Routes
from bench_service.service import BenchService
from procedures.core.limits import Verdict

router = Routes(prefix="/api/v1/analyses/batches", tags=["analyses"])
LOOK_S = 0.5
"""Interval at which a stream of a batch looks for progress [s]."""
QUIET_LOOKS = 20
"""Number of looks without a change after which a comment is sent, to show that the connection is alive."""


class RecordingSelection(Request):
    """A query over complete recordings; all conditions that are given must hold."""

    unit: str | None = Field(None, max_length=100)
    procedure: str | None = Field(None, max_length=100, description="Procedure of the job that recorded")
    job: str | None = Field(None, max_length=100, description="Only recordings of this job, by id or number")
    simulated: bool | None = None
    verdict: Verdict | None = Field(None, description="Verdict of the job that recorded")
    since: AwareDatetime | None = Field(None, description="Created at this time or later, with time zone")
    until: AwareDatetime | None = Field(None, description="Created before this time, with time zone")
    labels: list[LABEL] = Field(
        default_factory=list[str], max_length=20, description="`name` or `name=value` of the job; all must hold"
    )
    text: str | None = Field(None, min_length=1, max_length=200)
    ids: list[str] = Field(default_factory=list[str], max_length=20_000, description="Only these recordings")

    def query(self) -> Selection:
        """Return the conditions in the form that the stores take."""
        labels = tuple(map(LabelSought.parse, self.labels))
        return copied(Selection, self, search=copied(Search, self, labels=labels), ids=tuple(self.ids))


class BatchView(BaseModel):
    """A batch of analyses: its method over a selection of recordings, and how far it is."""

    id: str
    state: BatchState
    method: str
    version: str
    parameters: dict[str, Any]
    calibrations: list[str]
    selection: dict[str, Any] = Field(description="The query as it was submitted; its recordings were fixed then")
    each: Grouping
    priority: int = Field(description="Order among batches, smaller first; jobs on benches go before every batch")
    requested_by: str
    created_at: datetime
    ended_at: datetime | None
    cancelled_at: datetime | None
    cancelled_by: str
    total: int = Field(description="Number of tasks, one for each group of recordings")
    counts: dict[TaskState, int] = Field(description="Tasks by state; `reused`: a stored result of the same content")

    @classmethod
    def of(cls, batch: AnalysisBatch) -> "BatchView":
        """Convert a batch to its HTTP view."""
        counts = {state: batch.counts.get(state, 0) for state in TaskState}
        selection = _as_submitted(batch.selection)
        return copied(cls, batch, counts=counts, calibrations=list(batch.calibrations), selection=selection)


def _as_submitted(stored: dict[str, Any]) -> dict[str, Any]:
    """Return a stored selection as its request had it: the conditions that it names, labels as `name=value`."""
    flat = {key: value for key, value in stored.items() if key != "search"} | (stored.get("search") or {})
    labels = [
        one["name"] if one["value"] is None else f"{one['name']}={one['value']}" for one in flat.pop("labels", ())
    ]
    return {key: value for key, value in (flat | {"labels": labels}).items() if value not in (None, [], ())}


class BatchPage(BaseModel):
    """One page of batches, newest first."""

    items: list[BatchView]
    next: str | None


class TaskView(BaseModel):
    """A task of a batch: one analysis, and its result or the reason why there is none."""

    number: int
    state: TaskState
    attempt: int
    recordings: list[str]
    worker: str
    claimed_at: datetime | None
    ended_at: datetime | None
    not_before: datetime | None = Field(description="Earliest next attempt, after a failure that may pass")
    result: str | None
    failure: Failure | None

    @classmethod
    def of(cls, task: AnalysisTask) -> "TaskView":
        """Convert a task to its HTTP view."""
        return copied(cls, task, recordings=list(task.recordings))


class TaskPage(BaseModel):
    """One page of a batch's tasks, in the order of their numbers."""

    items: list[TaskView]
    next: int | None = Field(description="Number after which the next page begins")


@router.get("", responses=problems())
def list_batches(service: Service, after: After = None, limit: Limit = 50) -> BatchPage:
    """List the batches of analyses, newest first."""
    page = service.stores.batches.list(after=after, limit=limit)
    return BatchPage(items=[BatchView.of(batch) for batch in page.items], next=page.next)


@router.get("/{batch_id}", responses=problems(404))
def read_batch(batch_id: str, service: Service) -> BatchView:
    """Read a batch of analyses with its progress."""
    return BatchView.of(service.stores.batches.get(batch_id))


@router.get("/{batch_id}/tasks", responses=problems(404))
def list_tasks(
    batch_id: str,
    service: Service,
    state: TaskState | None = None,
    after: Annotated[int | None, Query(ge=0, description="Number of a task: `next` of the page before")] = None,
    limit: Limit = 50,
) -> TaskPage:
    """List the tasks of a batch, each with its recordings, its result or its failure."""
    found = service.stores.batches.tasks(batch_id, state=state, after=after, limit=limit + 1)
    more = found[limit - 1].number if len(found) > limit else None
    return TaskPage(items=[TaskView.of(task) for task in found[:limit]], next=more)


@router.post("/{batch_id}/cancel", status_code=202, responses=problems(404, 409, 507))
def cancel_batch(batch_id: str, service: Service, client: ClientName, proven: ProvenName) -> BatchView:
    """Cancel a batch: tasks that wait at once, those that run end by themselves and keep their results."""
    return BatchView.of(service.batches.cancel(batch_id, proven or client))


@router.post("/{batch_id}/retry", status_code=202, responses=problems(404, 409, 507))
def retry_batch(batch_id: str, service: Service) -> BatchView:
    """Queue the failed and cancelled tasks of a batch that has ended again; results that there are stay."""
    return BatchView.of(service.batches.retry(batch_id))


@router.get(
    "/{batch_id}/events",
    response_class=StreamingResponse,
    responses={
        **problems(404),
        200: {
            "description": "Server-sent events: `event: progress` with a BatchView, once now and at each change, and "
            "`event: end` with the last one",
            "content": {"text/event-stream": {"schema": {"type": "string"}}},
        },
    },
)
async def batch_events(batch_id: str, service: Service) -> StreamingResponse:
    """Stream a batch's progress as server-sent events until it has ended."""
    await to_thread.run_sync(service.stores.batches.get, batch_id)
    stream = _progress(service, batch_id)
    return StreamingResponse(stream, media_type="text/event-stream", headers=event_stream.HEADERS)


async def _progress(service: BenchService, batch_id: str) -> AsyncIterator[bytes]:
    yield event_stream.HEAD
    last, quiet = "", 0
    while True:
        batch = await to_thread.run_sync(service.stores.batches.get, batch_id)
        said = json.dumps(BatchView.of(batch).model_dump(mode="json"))
        if said != last:
            yield f"event: progress\ndata: {said}\n\n".encode()
            last, quiet = said, 0
        if batch.ended_at is not None:
            yield f"event: end\ndata: {said}\n\n".encode()
            return
        quiet += 1
        if quiet % QUIET_LOOKS == 0:
            yield event_stream.ServerSentEvents.quiet
        await sleep(LOOK_S)
