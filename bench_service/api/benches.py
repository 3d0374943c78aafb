"""Benches: what they are, what they are doing, and the software stop."""

from datetime import datetime

from fastapi import APIRouter
from pydantic import BaseModel, Field

from bench_service.api.dependencies import Service
from bench_service.api.errors import problems
from bench_service.api.requests import StopRequest
from bench_service.jobs.errors import NotFound
from bench_service.jobs.live import BenchLive
from bench_service.jobs.service import BenchService
from bench_service.wall_clock import now
from procedures.bench import BenchDescription

router = APIRouter(prefix="/api/v1/benches", tags=["benches"])


class BenchView(BaseModel):
    """A bench: what is declared of it, and what it is doing."""

    id: str
    description: BenchDescription
    state: str = Field(description='"idle", "busy", or "stopped" until it is released')
    stopped: str | None = Field(description="Why it is stopped")
    job: str | None = Field(description="The job that drives it")
    units: list[str] = Field(description="Units that it can test")
    live: BenchLive | None = Field(description="The last that its driver said; null: it never had one")
    driver_seen_at: datetime | None = Field(description="When that was")
    driver_there: bool = Field(description="Whether a driver is there now, as far as can be known from here")


class Stopping(BaseModel):
    """The answer to a stop. Software is not the emergency stop: that is a hardware circuit beside the table."""

    bench: str
    job: str | None = Field(description="The job that was running; its bench is safe once it is cancelled")
    note: str = "This is a software stop. The emergency stop is a hardware circuit beside the table."


def _view(service: BenchService) -> BenchView:
    running = service.running_job()
    live = service.live.of_bench(service.driver.description.id)
    stop = service.stores.units.bench_stop(service.driver.description.id)
    return BenchView(
        id=service.driver.description.id,
        description=service.driver.description,
        state="stopped" if stop else "idle" if running is None else "busy",
        stopped=None if stop is None else f"{stop.at.isoformat()}: {stop.reason}",
        job=None if running is None else running.id,
        units=[unit.serial for unit in service.driver.mounted()],
        live=live,
        driver_seen_at=None if live is None else live.at,
        driver_there=live is not None and live.there(now()),
    )


@router.get("")
def list_benches(service: Service) -> list[BenchView]:
    """Every bench of this service: one so far."""
    return [_view(service)]


@router.get("/{bench_id}", responses=problems(404))
def read_bench(bench_id: str, service: Service) -> BenchView:
    """Live state, limits, declared accuracy, and the job that drives it."""
    if bench_id != service.driver.description.id:
        raise NotFound("bench", bench_id)
    return _view(service)


@router.post("/{bench_id}/stop", status_code=202, responses=problems(404, 507))
def stop(bench_id: str, service: Service, body: StopRequest | None = None) -> Stopping:
    """Software stop: end the running job, stop the table, switch the unit off; until the bench is released."""
    job = service.stop_bench(bench_id, (body or StopRequest.model_validate({})).reason)
    return Stopping(bench=bench_id, job=None if job is None else job.id)


@router.post("/{bench_id}/release", responses=problems(404, 507))
def release(bench_id: str, service: Service) -> BenchView:
    """Let a stopped bench work again: the jobs that wait in its queue go on."""
    service.release_bench(bench_id)
    return _view(service)
