"""HTTP schemas of benches: their state, safety, queue and stops."""

from datetime import datetime

from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import By
from bench_service.api.http.fields import Request
from bench_service.bench.devices import DeviceState
from bench_service.bench.live.values import BenchLive
from bench_service.bench.safety import Safety
from bench_service.jobs.queue import Place, QueueEntry
from bench_service.mapping import copied
from bench_service.model.records import BenchStop
from procedures.bench import BenchDescription


class StopRequest(Request):
    """Request to stop a bench, with reason and author."""

    reason: str = Field("stopped by an operator", min_length=1, max_length=500)
    wait: bool = Field(
        True,
        description="Answer once the devices are safe and the stop is stored, at most a second later; false: at once",
    )
    by: By | None = None


class ReleaseRequest(Request):
    """Request to release a stop, with author and remark."""

    remark: str = Field(min_length=1, max_length=500, description="What was checked before the bench was released")
    by: By | None = None


class StopView(BaseModel):
    """A stop of a bench. It stands until a person releases it; the bench works again once no stop stands."""

    id: str
    bench: str
    at: datetime
    by: str = Field(description="Person or process that stopped the bench, as far as known")
    reason: str
    safe_at: datetime | None = Field(
        description="When the bench's own host confirmed it safe after the stop; null: not confirmed"
    )
    safe_by: str = Field(description="Process that had last commanded the devices then")
    released_at: datetime | None = Field(description="Time of the release; null: the stop is in force")
    released_by: str
    remark: str = Field(description="Remark of the person who released it")
    entered_at: datetime | None = Field(description="When it was stored; later than `at` if the database was away")

    @classmethod
    def of(cls, stop: BenchStop) -> "StopView":
        """Convert a stop to its HTTP view."""
        return cls(**vars(stop))


class StopPage(BaseModel):
    """One page of a bench's stops, newest first, with those that were released."""

    items: list[StopView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


class Releasing(BaseModel):
    """The answer to a release: the released stop, and those that still stand."""

    stop: StopView = Field(description="The stop that was released")
    standing: list[StopView] = Field(description="Stops still in force, oldest first")


class DevicesView(BaseModel):
    """The last state that a bench's devices reported, as the bench's own host has it."""

    at: datetime | None = Field(description="When the devices were last commanded; null: never")
    by: str = Field(description="Process that last commanded the devices")
    job: str | None = Field(description="Job for which the devices were last commanded")
    table: str = Field(description='"at rest", or "moving": a demand has not ended, from any process')
    angles_deg: tuple[float, float, float] | None = Field(
        description="Outer, middle, inner axis where the table last came to rest; null: not known"
    )
    powered: bool = Field(description="Whether the unit has power")
    chamber_target_c: float | None = Field(description="Target of the chamber [°C]; null: no target, or no chamber")
    unsafe: list[str] = Field(description="Conditions that are not safe for an unattended bench")

    @classmethod
    def of(cls, state: DeviceState | None) -> "DevicesView | None":
        """Convert the devices' state to its HTTP view; None where this host does not know it."""
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
    """The known safety of a bench. Software is not the emergency stop: that is a separate circuit at the table."""

    safe: bool | None = Field(description="Table at rest, unit off, chamber commanded to ambient; null: not known here")
    explanation: str = Field(description="State of the devices as a sentence, with the process that handles it")
    devices: DevicesView | None = Field(description="null: they are on another host")
    worker: str | None = Field(description="The process of this host that drives the bench")
    supervisor: str | None = Field(
        description="The process of this host that makes the bench safe if the worker cannot"
    )
    silent_supervisor: str | None = Field(
        description="A supervisor of this host without a heartbeat, which hangs or is suspended: nobody watches"
    )

    @classmethod
    def of(cls, safety: Safety) -> "SafetyView":
        """Convert a safety state to its HTTP view."""
        return cls(
            safe=safety.safe,
            explanation=safety.explanation,
            devices=DevicesView.of(safety.devices),
            worker=None if safety.worker is None else str(safety.worker),
            supervisor=None if safety.supervisor is None else str(safety.supervisor),
            silent_supervisor=None if safety.silent_supervisor is None else str(safety.silent_supervisor),
        )


class ReservedView(BaseModel):
    """The reservation that a bench is under: who has it, and until when."""

    holder: str
    until: datetime
    note: str


class BenchView(BaseModel):
    """A bench: its declared description and its current activity."""

    id: str
    description: BenchDescription
    state: str = Field(description='"idle", "busy" with a job, in "manual" mode, or "stopped" until it is released')
    stopped: str | None = Field(description="Reasons of the stops in force")
    stops: list[StopView] = Field(description="Stops in force, oldest first; each is released by its id")
    job: str | None = Field(description="Job that drives the bench")
    units: list[str] = Field(description="Serials of the units that it can test")
    live: BenchLive | None = Field(description="Last live state from the driver; null: it never had a driver")
    driver_seen_at: datetime | None = Field(description="Time of `live`")
    driver_there: bool = Field(description="Whether a driver is active now, judged by its heartbeat")
    safety: SafetyView
    driven_by: str | None = Field(description="Worker process that drives it now; null: none, its jobs wait")
    queued: int = Field(description="How many jobs wait in its queue")
    reserved: ReservedView | None = Field(description="Its reservation now; null: anybody's jobs may start")


class QueueEntryView(BaseModel):
    """A job in a queue, and why it waits."""

    job: str
    number: int = Field(description="The job's short number")
    position: int = Field(description="From 1, in the order of the queue")
    ahead: int = Field(description="Number of jobs ahead of it now, the running one included")
    waiting: str = Field(description="Reason why it does not run yet")
    priority: int
    unit: str
    queued_at: datetime
    not_before: datetime | None = Field(description="Earliest time of the next attempt")
    reservation: str | None

    @classmethod
    def of(cls, entry: QueueEntry, place: Place, number: int) -> "QueueEntryView":
        """Convert a queue entry, its place and its job's number to their HTTP view."""
        return copied(cls, entry, place, job=entry.id, number=number)


class QueueView(BaseModel):
    """A bench's queue, in the order in which its jobs start."""

    bench: str
    running: str | None = Field(description="The job that drives the bench")
    running_number: int | None = Field(description="Its short number")
    driven_by: str | None
    entries: list[QueueEntryView]


class Stopping(BaseModel):
    """The answer to a stop request. Software is not the emergency stop: that is a hardware circuit at the table."""

    bench: str
    stop: str = Field(description="Id of this stop: a release names it")
    job: str | None = Field(description="The job that was running, which is being cancelled")
    safety: SafetyView = Field(description="State within a second of the stop; the bench has the later state")
    books: str | None = Field(description="Why this stop is not stored yet; null: it is stored")
    note: str = "This is a software stop. The emergency stop is a hardware circuit beside the table."
