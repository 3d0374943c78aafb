"""HTTP schemas of a job: its state, its progress and its events."""

from datetime import datetime
from typing import Any

from pydantic import AwareDatetime, BaseModel, Field

from bench_service.api.http.dependencies import By
from bench_service.api.http.fields import NAME, Labels, Request
from bench_service.api.procedures import PreviewRequest
from bench_service.bench.driver import TrueTriad
from bench_service.bench.live.values import LiveJob
from bench_service.jobs.queue_service import Standing
from bench_service.mapping import copied
from bench_service.model.job import Event, Failure, Job, JobState
from procedures.core.limits import Verdict

NO_NUL = r"^[^\x00]*$"


class JobSubmission(PreviewRequest):
    """Request for a new job: procedure, unit and parameters."""

    procedure: str = NAME
    priority: int = Field(10, ge=1, le=1000, description="Smaller runs first")
    labels: Labels = Field(default_factory=Labels, max_length=50)
    seed: int | None = Field(None, ge=0, lt=2**48, description="Seed of a simulated bench: same seed, same bytes")
    retries: int = Field(0, ge=0, le=5, description="Number of retries after a fault of the bench")
    reservation: str | None = Field(None, max_length=100, description="The reservation under which it runs")
    mounting: str | None = Field(
        None, max_length=100, description="Id of the unit's mounting; null: the one that stands on its bench, if any"
    )
    not_before: AwareDatetime | None = Field(None, description="Earliest start; until then it waits in the queue")
    deadline_at: AwareDatetime | None = Field(None, description="No station begins later; the job then fails")


class JobChange(Request):
    """A change of a job while it is queued."""

    priority: int = Field(ge=1, le=1000, description="Smaller runs first")


class PromptAnswer(Request):
    """The answer of the person at the bench to a job's prompt."""

    prompt: str = Field(max_length=100, description="Id of the prompt that is answered: an older one's is refused")
    done: bool = Field(description="true: it is done; false: it will not be done, and the job ends cancelled")
    remark: str = Field("", max_length=500, pattern=NO_NUL)


class CancelRequest(Request):
    """Request to cancel a job, with author and reason."""

    reason: str = Field("", max_length=500, pattern=NO_NUL)
    by: By | None = None


class NoteRequest(Request):
    """A remark of a person about a job."""

    text: str = Field(min_length=1, max_length=2000, pattern=NO_NUL)
    by: By | None = None


class Reanalysis(Request):
    """Other parameters for a job's recordings; those left out stay as they were requested."""

    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])


class Truth(BaseModel):
    """True values of a simulated unit in a job."""

    job: str
    triads: list[TrueTriad]


class Progress(BaseModel):
    """Progress of a job in stations and time."""

    station: int = Field(description="Stations finished")
    stations: int
    fraction: float
    eta_s: float | None = Field(description="Bench time left, by the plan [s]")
    eta_wall_s: float | None = Field(
        description="Real time left at the rate so far, without the analysis; null where it does not run, or its "
        "driver is silent"
    )
    bench_time_s: float | None = Field(description="The bench's clock while the job runs, else null")
    label: str | None = Field(description="The station that it works on while it runs, else null")


class PlaceView(BaseModel):
    """Place of a queued job in its bench's queue."""

    position: int = Field(description="From 1, in the order of its bench's queue")
    ahead: int = Field(description="Number of jobs ahead of it now, the running one included")


class PromptView(BaseModel):
    """A prompt for a person at the bench; the job waits for the answer."""

    id: str = Field("", description="Id of the prompt, which the answer names")
    text: str
    asked_at: datetime
    angles_deg: tuple[float, float, float] | None = Field(
        None, description="Table angles of the wanted attitude: outer, middle, inner; null: it is about no attitude"
    )


class JobView(BaseModel):
    """A job with its state, parameters and progress."""

    id: str
    number: int = Field(description="Short number in this database; 123 and #123 stand for the id in every address")
    procedure: str
    procedure_version: str
    unit: str
    bench: str
    state: JobState
    verdict: Verdict | None
    progress: Progress
    priority: int
    attempt: int = Field(description="How often it was queued: once, and again at each resume")
    prompt: PromptView | None = Field(description="Open prompt for a person at the bench; see `answer`")
    pause_requested: bool = Field(description="Whether it pauses before its next station")
    queue: PlaceView | None = Field(description="Its place while it is queued")
    waiting: str | None = Field(description="Reason why it does not run now, as a sentence")
    resumable: bool = Field(description="Whether it can be queued again to continue where it ended")
    retries: int = Field(description="Number of retries after a fault of the bench")
    retries_left: int
    not_before: datetime | None = Field(description="Earliest time of the next attempt")
    reservation: str | None = Field(description="The reservation under which it runs")
    mounting: str | None = Field(description="The unit's mounting whose azimuth counts; null: the bench's declared one")
    queued_at: datetime | None = Field(description="When it entered the queue of its bench")
    deadline_at: datetime | None = Field(description="No station begins later")
    labels: Labels
    requested_by: str = Field(description="Name of the person who submitted it, as far as the client gave it")
    team: str = Field(description="Team of its campaign run, whose members act on it; empty: its reservation's counts")
    requested_parameters: dict[str, Any]
    parameters: dict[str, Any]
    simulated: bool
    seed: int | None
    code_version: str
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    duration_s: float = Field(description="Predicted bench time [s]")
    error: Failure | None
    result: str | None = Field(description="Id of the result that gave the verdict")
    page: str = Field(description="Path of the page in the browser")

    @classmethod
    def of(cls, job: Job, standing: Standing | None = None, live: LiveJob | None = None) -> "JobView":
        """Convert a job to its HTTP view; `standing` where it was asked for, `live` its bench's state while it runs."""
        place = None if standing is None else standing.place
        stations = len(job.stations)
        open_state = job.state in (JobState.QUEUED, JobState.RUNNING, JobState.PAUSED)
        fraction = 1.0 if job.state is JobState.SUCCEEDED else job.stations_done / stations if stations else 0.0
        eta_s = job.duration_s * (1 - fraction) if open_state else None
        if live is not None:
            fraction, eta_s = max(fraction, live.fraction), live.eta_s
        return copied(
            cls,
            job,
            progress=Progress(
                station=job.stations_done,
                stations=stations,
                fraction=fraction,
                eta_s=eta_s,
                eta_wall_s=None if live is None else live.eta_wall_s,
                bench_time_s=None if live is None else live.bench_time_s,
                label=None if live is None else live.label,
            ),
            queue=None if place is None else copied(PlaceView, place),
            waiting=None if standing is None else standing.waiting,
            error=job.failure,
            result=job.result_id,
            page=f"/jobs/{job.id}",
        )


class JobPage(BaseModel):
    """One page of jobs, newest first. Jobs that this version does not understand are left out and named in its log."""

    items: list[JobView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


class ForeignJob(BaseModel):
    """A job stored by a version whose terms this one does not understand."""

    id: str
    state: JobState
    waiting: str = Field(description="What this service does not understand, as a sentence")


class EventView(BaseModel):
    """One event of a job: the `data` of a server-sent event."""

    sequence: int
    at: datetime
    kind: str
    data: dict[str, Any]

    @classmethod
    def of(cls, event: Event) -> "EventView":
        return copied(cls, event)
