"""Benches: what they are, what they are doing, and the software stop."""

from datetime import datetime

from fastapi import APIRouter
from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import problems
from bench_service.api.http.fields import Request
from bench_service.bench.devices import DeviceState
from bench_service.bench.live.values import BenchLive
from bench_service.bench.safety import Safety
from bench_service.jobs.queue import Place, QueueEntry
from bench_service.service import BenchService
from bench_service.wall_clock import now
from procedures.bench import BenchDescription

router = APIRouter(prefix="/api/v1/benches", tags=["benches"])


class StopRequest(Request):
    """Why a bench is stopped."""

    reason: str = Field("stopped by an operator", min_length=1, max_length=500)


class DevicesView(BaseModel):
    """What a bench's devices last said of themselves, as the bench's own host has it."""

    at: datetime | None = Field(description="When something was last asked of them; null: nothing ever was")
    by: str = Field(description="Who asked")
    job: str | None = Field(description="The job for which it was asked")
    table: str = Field(description='"at rest", or "moving": a demand has not ended, whoever sent it')
    angles_deg: tuple[float, float, float] | None = Field(
        description="Outer, middle, inner axis where the table last came to rest; null: not known"
    )
    powered: bool = Field(description="Whether the unit has power")
    chamber_target_c: float | None = Field(description="Where the chamber goes; null: nowhere, or there is none")
    unsafe: list[str] = Field(description="What is not as it must be on a bench that is left alone")

    @classmethod
    def of(cls, state: DeviceState | None) -> "DevicesView | None":
        """None where this host does not know."""
        if state is None:
            return None
        return cls(
            at=state.at,
            by=state.by,
            job=state.job,
            table=state.table,
            angles_deg=state.angles_deg,
            powered=state.powered,
            chamber_target_c=state.chamber_target_c,
            unsafe=list(state.unsafe),
        )


class SafetyView(BaseModel):
    """What is known of a bench's safety. Software is not the emergency stop: that is a circuit beside the table."""

    safe: bool | None = Field(description="Table at rest, unit off, chamber led to ambient; null: not known here")
    explanation: str = Field(description="What is known, and who sees to it")
    devices: DevicesView | None = Field(description="null: they are on another host")
    worker: str | None = Field(description="The process of this host that drives the bench")
    supervisor: str | None = Field(description="The process of this host that makes it safe where the worker cannot")

    @classmethod
    def of(cls, safety: Safety) -> "SafetyView":
        """As HTTP says it."""
        return cls(
            safe=safety.safe,
            explanation=safety.explanation,
            devices=DevicesView.of(safety.devices),
            worker=None if safety.worker is None else str(safety.worker),
            supervisor=None if safety.supervisor is None else str(safety.supervisor),
        )


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
    safety: SafetyView
    driven_by: str | None = Field(description="Who drives it now: a worker's process; null: nobody, its jobs wait")
    queued: int = Field(description="How many jobs wait in its queue")


class QueueEntryView(BaseModel):
    """A job in a queue, and why it waits."""

    job: str
    position: int = Field(description="From 1, in the order of the queue")
    ahead: int = Field(description="Jobs that go before it as things stand, the running one included")
    waiting: str = Field(description="Why it does not run yet")
    priority: int
    unit: str
    queued_at: datetime
    not_before: datetime | None = Field(description="It is not tried before this moment")
    reservation: str | None

    @classmethod
    def of(cls, entry: QueueEntry, place: Place) -> "QueueEntryView":
        """As HTTP says it."""
        return cls(
            job=entry.job,
            position=place.position,
            ahead=place.ahead,
            waiting=place.waiting,
            priority=entry.priority,
            unit=entry.unit,
            queued_at=entry.queued_at,
            not_before=entry.not_before,
            reservation=entry.reservation,
        )


class QueueView(BaseModel):
    """A bench's queue, in the order in which its jobs start."""

    bench: str
    running: str | None = Field(description="The job that drives the bench")
    driven_by: str | None
    entries: list[QueueEntryView]


class Stopping(BaseModel):
    """The answer to a stop. Software is not the emergency stop: that is a hardware circuit beside the table."""

    bench: str
    job: str | None = Field(description="The job that was running, which is being cancelled")
    safety: SafetyView = Field(description="What was known within a second of the stop; ask the bench for later")
    note: str = "This is a software stop. The emergency stop is a hardware circuit beside the table."


def _view(service: BenchService, bench_id: str) -> BenchView:
    description = service.benches.description(bench_id)
    running = service.jobs.driving_job(bench_id)
    live = service.live.of_bench(bench_id)
    stop = service.stores.benches.bench_stop(bench_id)
    return BenchView(
        id=bench_id,
        description=description,
        state="stopped" if stop else "idle" if running is None else "busy",
        stopped=None if stop is None else f"{stop.at.isoformat()}: {stop.reason}",
        job=running,
        units=[unit.serial for unit in service.benches.mounted(bench_id)],
        live=live,
        driver_seen_at=None if live is None else live.at,
        driver_there=live is not None and live.there(now()),
        safety=SafetyView.of(service.safety.known(bench_id)),
        driven_by=service.benches.holder(bench_id),
        queued=service.stores.queue.lengths().get(bench_id, 0),
    )


@router.get("", responses=problems())
def list_benches(service: Service) -> list[BenchView]:
    """Every bench that a worker of this database has registered."""
    return [_view(service, bench_id) for bench_id in service.benches.ids()]


@router.get("/{bench_id}", responses=problems(404))
def read_bench(bench_id: str, service: Service) -> BenchView:
    """Live state, limits, declared accuracy, and the job that drives it."""
    return _view(service, bench_id)


@router.get("/{bench_id}/queue", responses=problems(404))
def read_queue(bench_id: str, service: Service) -> QueueView:
    """The jobs that wait for a bench, in the order in which they start, and why each of them waits."""
    queue = service.queues.queue(bench_id)
    holder = service.benches.holder(bench_id)
    places = queue.places(holder is not None)
    entries = [QueueEntryView.of(entry, places[entry.job]) for entry in queue.entries]
    return QueueView(bench=queue.bench, running=queue.running, driven_by=holder, entries=entries)


@router.post("/{bench_id}/stop", status_code=202, responses=problems(404, 413, 507))
def stop(bench_id: str, service: Service, body: StopRequest | None = None) -> Stopping:
    """Software stop: end the running job, stop the table, switch the unit off; until the bench is released.

    It is noted first, so it holds whoever is alive: a worker sees it, and in its place the bench's supervisor.
    """
    job, safety = service.stops.stop(bench_id, (body or StopRequest.model_validate({})).reason)
    return Stopping(bench=bench_id, job=job, safety=SafetyView.of(safety))


@router.post("/{bench_id}/release", responses=problems(404, 409, 507))
def release(bench_id: str, service: Service) -> BenchView:
    """Let a stopped bench work again, once it is known to be safe: the jobs that wait in its queue go on."""
    service.stops.release(bench_id)
    return _view(service, bench_id)
