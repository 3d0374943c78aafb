"""A job, one execution of a procedure on one unit on one bench, and its possible states."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Any

from bench_service.model.request import JobTerms
from procedures.bench.errors import (
    BenchError,
    DeviceBusy,
    DeviceFault,
    Disconnected,
    NotPowered,
    NotSettled,
    SoakNotReached,
)
from procedures.core.limits import Verdict
from procedures.core.recording import Station


class JobState(StrEnum):
    """The state of a job. One that succeeded, failed or was cancelled has ended.

    A paused or interrupted job may be queued again. A paused job holds no bench: the bench is safe, and others may use
    it until the job is resumed.
    """

    QUEUED = "queued"
    RUNNING = "running"
    PAUSED = "paused"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    INTERRUPTED = "interrupted"


FINAL = frozenset({JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELLED})

LEGAL: dict[JobState, frozenset[JobState]] = {
    JobState.QUEUED: frozenset(
        {JobState.RUNNING, JobState.PAUSED, JobState.CANCELLED, JobState.FAILED, JobState.INTERRUPTED}
    ),
    JobState.RUNNING: frozenset(
        {
            JobState.QUEUED,
            JobState.PAUSED,
            JobState.SUCCEEDED,
            JobState.FAILED,
            JobState.CANCELLED,
            JobState.INTERRUPTED,
        }
    ),
    JobState.PAUSED: frozenset({JobState.QUEUED, JobState.CANCELLED}),
    JobState.INTERRUPTED: frozenset({JobState.QUEUED, JobState.CANCELLED}),
    JobState.SUCCEEDED: frozenset(),
    JobState.FAILED: frozenset({JobState.QUEUED}),
    JobState.CANCELLED: frozenset(),
}
"""From each state, the states that may follow. From failed to queued only where `Job.resumable` allows it."""

FAULTS = (BenchError, NotSettled, SoakNotReached, NotPowered, DeviceFault, DeviceBusy, Disconnected)
NUMBER_DIGITS = 9
"""Digits of the largest number of a job."""
BENCH_FAULTS = frozenset(fault.__name__ for fault in FAULTS)
"""Kinds of transient failure of the bench, which a retry may cure; a demand out of range is not one."""

RESUMABLE = BENCH_FAULTS | {"NotSafe", "DeadlinePassed", "LeaseLost", "StorageFull", "StorageFailure", "OtherVersion"}
"""Kinds of failure after which the stations that remain, or the analysis, can still be done: after `OtherVersion` by
the service that began the job."""


@dataclass(frozen=True)
class Failure:
    """The reason why a job did not end well: a short kind ("NotSettled"), and a sentence for a person."""

    kind: str
    message: str
    station: int | None = None


@dataclass(frozen=True)
class JobHeading:
    """Number and procedure of a job: as much as a list of its recordings shows of it."""

    number: int
    procedure: str


@dataclass(frozen=True, kw_only=True)
class Job(JobTerms):
    """One job as it is stored. Times are UTC; `stations_done` counts recordings sealed so far."""

    id: str
    procedure_version: str
    bench: str
    state: JobState
    created_at: datetime
    requested_parameters: dict[str, Any]
    """Parameters as the client sent them."""
    parameters: dict[str, Any]
    """Complete parameters: every default filled, from the unit and the bench too."""
    context: dict[str, Any]
    """Known data of unit and bench (JSON of `procedures.procedure.Context`): at submission, then at the start."""
    stations: tuple[Station, ...]
    duration_s: float
    """Predicted bench time [s]."""
    code_version: str
    simulated: bool
    verdict: Verdict | None = None
    stations_done: int = 0
    cancel_requested: bool = False
    pause_requested: bool = False
    attempt: int = 1
    """Number of times that it was queued: once, and again at each resume."""
    queued_at: datetime | None = None
    """Time when it last entered its bench's queue."""
    not_before: datetime | None = None
    """Earliest start from the queue: the pause before an automatic retry."""
    retries_left: int = 0
    requested_by: str = ""
    """Person who requested it, as given by the client; may be empty."""
    team: str = ""
    """Team of the campaign run to which it belongs: its members act on the job; empty: see its reservation."""
    prompt: dict[str, Any] | None = None
    """Open request to the person at the bench: {"text", "asked_at"}; None: none is open."""
    started_at: datetime | None = None
    finished_at: datetime | None = None
    result_id: str | None = None
    failure: Failure | None = None
    number: int = 0
    """Short number for people, counted from 1 in each database; 0 before the job is stored."""

    @property
    def resumable(self) -> bool:
        """True where the job can be queued again to continue where it ended."""
        if self.state is JobState.FAILED:
            return self.failure is not None and self.failure.kind in RESUMABLE
        return self.state in (JobState.PAUSED, JobState.INTERRUPTED)


def job_number(text: str) -> int | None:
    """Return a job's number from text as people write it, 123 or #123; None for any other text."""
    digits = text.removeprefix("#")
    return int(digits) if digits.isascii() and digits.isdigit() and len(digits) <= NUMBER_DIGITS else None


@dataclass(frozen=True)
class Event:
    """An entry in a job's history, with its kind and data; `sequence` counts from 1 within the job."""

    job_id: str
    sequence: int
    at: datetime
    kind: str
    """Kind of event: "state", "station" or "note"."""
    data: dict[str, Any]
