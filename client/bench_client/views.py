"""Answers of the service as objects. Fields that a later service adds are kept, and do no harm."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any, Generic, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

JobState = Literal["queued", "running", "paused", "interrupted", "succeeded", "failed", "cancelled"]
Verdict = Literal["pass", "fail", "error"]
ENDED = ("succeeded", "failed", "cancelled", "interrupted")
"""States in which a job does nothing more by itself."""
T = TypeVar("T")


class View(BaseModel):
    """Base of the answers: not to be changed, and open for fields of a later service."""

    model_config = ConfigDict(extra="allow", frozen=True)


class FieldError(View):
    """A faulty field of a request: its path, what is wrong with the allowed range, and what was given."""

    field: str
    message: str
    value: Any = None


class Problem(View):
    """Problem document of a refusal (RFC 9457): status, kind, sentence, faulty fields."""

    status: int
    title: str = ""
    type: str = ""
    detail: str = ""
    errors: tuple[FieldError, ...] = ()
    lost: tuple[str, ...] = ()


class Failure(View):
    """Reason for which a job failed: a short kind, and a sentence for a person."""

    kind: str
    message: str


class Progress(View):
    """Progress of a job in stations and time; `eta_s` is bench time by the plan, `eta_wall_s` real time [s]."""

    station: int
    stations: int
    fraction: float
    eta_s: float | None = None
    eta_wall_s: float | None = None
    label: str | None = None


class Job(View):
    """A job with its state, parameters and progress."""

    id: str
    procedure: str
    procedure_version: str
    unit: str
    bench: str
    state: JobState
    verdict: Verdict | None
    progress: Progress
    priority: int
    waiting: str | None
    prompt: dict[str, Any] | None
    labels: dict[str, str]
    parameters: dict[str, Any]
    simulated: bool
    seed: int | None
    created_at: datetime
    finished_at: datetime | None
    error: Failure | None
    result: str | None
    resumable: bool

    @property
    def ended(self) -> bool:
        """True if the job does nothing more by itself."""
        return self.state in ENDED


class Channel(View):
    """Channel of a recording: ``scale·(raw − offset)`` is in `unit`, an increment over one sample period."""

    name: str
    quantity: str
    unit: str
    scale: float = 1.0
    offset: float = 0.0


class RecordingView(View):
    """A recording without its samples."""

    id: str
    unit: str
    job: str | None
    bench: str | None
    station: dict[str, Any] | None
    state: str
    channels: tuple[Channel, ...]
    rate_hz: float
    count: int
    duration_s: float
    start_s: float
    content_hash: str
    simulated: bool
    created_at: datetime
    source: dict[str, Any]
    warnings: tuple[str, ...]


class Uncertainty(View):
    """Standard uncertainty that a plan is expected to have of one quantity, and its contributions."""

    name: str
    unit: str
    standard_uncertainty: float
    from_noise: float
    from_table: float


class Preview(View):
    """Preview of a plan before anything moves: stations, duration, uncertainties, warnings, violations."""

    procedure: str
    unit: str
    bench: str
    parameters: dict[str, Any]
    stations: tuple[dict[str, Any], ...]
    duration_s: float
    data_bytes: int
    predicted_uncertainties: tuple[Uncertainty, ...]
    basis: str
    warnings: tuple[str, ...]
    violations: tuple[str, ...]


class Event(View):
    """An event of a job. One with the kind "live" has no sequence: the bench's present activity, which is not kept."""

    kind: str
    sequence: int | None = None
    at: datetime | None = None
    data: dict[str, Any] = Field(default_factory=dict[str, Any])


class Page(BaseModel, Generic[T]):
    """One page of a list, newest first; `next` is the cursor of the page behind."""

    items: tuple[T, ...]
    next: str | None = None


def sent(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a query or a body without its fields that are None, with moments in ISO 8601."""
    plain = {name: value.isoformat() if isinstance(value, datetime) else value for name, value in values.items()}
    return {name: value for name, value in plain.items() if value is not None}
