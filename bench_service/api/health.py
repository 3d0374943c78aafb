"""Is it alive, is it ready, and the counts that a monitor reads."""

from fastapi import APIRouter, Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Gauge, generate_latest
from pydantic import BaseModel, Field

from bench_service.api.dependencies import Service
from bench_service.api.errors import problems

router = APIRouter(tags=["health"])


class Health(BaseModel):
    """The service answers; `code_version` is what would make a number now."""

    status: str = "ok"
    code_version: str
    notes: list[str] = Field(default_factory=list[str], description="What a person should know: a stopped bench")


@router.get("/healthz")
def healthz(service: Service) -> Health:
    """The process answers."""
    return Health(code_version=service.code_version)


@router.get("/readyz", responses=problems())
def readyz(service: Service) -> Health:
    """A job could start here: the database answers, its disk has room, the engine runs, the lease is held.

    Waits for the engine after a start. 503 names every reason. A stopped bench refuses by a person's will: a note.
    """
    return Health(code_version=service.code_version, notes=list(service.ready()))


@router.get(
    "/metrics",
    response_class=Response,
    responses={**problems(), 200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
def metrics(service: Service) -> Response:
    """Jobs by state and whether the bench is busy, in Prometheus text format."""
    registry = CollectorRegistry()
    jobs = Gauge("bench_jobs", "Jobs by state", ["state"], registry=registry)
    for state, count in service.stores.jobs.counts().items():
        jobs.labels(state.value).set(count)
    busy = Gauge("bench_busy", "1 while a job drives the bench", ["bench"], registry=registry)
    for bench in service.benches.ids():
        busy.labels(bench).set(service.running_job(bench) is not None)
    return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)
