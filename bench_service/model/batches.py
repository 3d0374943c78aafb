"""Batches of analyses: one method over many recordings, cut into tasks that worker processes claim one by one."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any

from bench_service.model.job import Failure
from bench_service.model.search import EVERYTHING, Search


class Grouping(StrEnum):
    """Rule for which recordings one task of a batch analyses together."""

    RECORDING = "recording"
    JOB = "job"
    UNIT = "unit"


class TaskState(StrEnum):
    """State of a task. `reused`: a stored result of the same content was taken, and nothing was computed."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    REUSED = "reused"
    FAILED = "failed"
    CANCELLED = "cancelled"


class BatchState(StrEnum):
    """State of a batch, derived from its tasks."""

    WAITING = "waiting"
    RUNNING = "running"
    CANCELLING = "cancelling"
    """Cancelled, while a task that was begun before still runs."""
    CANCELLED = "cancelled"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    """Ended, and at least one task failed."""


@dataclass(frozen=True)
class Selection:
    """A query over complete recordings; conditions that are None or empty do not restrict it."""

    search: Search = EVERYTHING
    unit: str | None = None
    procedure: str | None = None
    """Procedure of the job that recorded."""
    job: str | None = None
    simulated: bool | None = None
    ids: tuple[str, ...] = ()
    """Only these recordings."""


@dataclass(frozen=True, kw_only=True)
class BatchTerms:
    """The terms of a batch that its request and its record have in common. A batch inherits these fields."""

    method: str
    parameters: dict[str, Any] = field(default_factory=dict[str, Any])
    calibrations: tuple[str, ...] = ()
    """Calibrations that every task uses."""
    each: Grouping = Grouping.RECORDING
    priority: int = 10
    """Priority among batches: smaller runs first. Every batch gives way to jobs on benches."""


@dataclass(frozen=True, kw_only=True)
class BatchRequest(BatchTerms):
    """A client's request for a batch of analyses: a selection of recordings, and the terms of the analysis."""

    selection: Selection


@dataclass(frozen=True, kw_only=True)
class AnalysisBatch(BatchTerms):
    """A stored batch of analyses, with the number of its tasks in each state."""

    id: str
    version: str
    """Version of the method when the batch was submitted."""
    selection: dict[str, Any]
    """The query as it was requested."""
    requested_by: str
    created_at: datetime
    total: int
    counts: Mapping[TaskState, int] = field(default_factory=dict[TaskState, int])
    cancelled_at: datetime | None = None
    cancelled_by: str = ""
    ended_at: datetime | None = None

    @property
    def state(self) -> BatchState:
        """State of the batch that follows from the states of its tasks."""
        running, waiting = self.counts.get(TaskState.RUNNING, 0), self.counts.get(TaskState.WAITING, 0)
        if self.cancelled_at is not None:
            return BatchState.CANCELLING if running else BatchState.CANCELLED
        if running + waiting == 0:
            return BatchState.FAILED if self.counts.get(TaskState.FAILED) else BatchState.SUCCEEDED
        return BatchState.WAITING if waiting == self.total else BatchState.RUNNING


@dataclass(frozen=True)
class AnalysisTask:
    """One task of a batch: a run of the method over the recordings of one group."""

    batch: str
    number: int
    """Number within the batch, from 0."""
    state: TaskState
    attempt: int
    """Number of times that a worker has claimed it."""
    recordings: tuple[str, ...] = ()
    worker: str = ""
    """Name of the worker that claimed it last."""
    claimed_at: datetime | None = None
    ended_at: datetime | None = None
    not_before: datetime | None = None
    result: str | None = None
    failure: Failure | None = None


@dataclass(frozen=True)
class ClaimedTask:
    """A task that a worker has claimed, with everything that it needs to run."""

    batch: str
    number: int
    attempt: int
    method: str
    parameters: dict[str, Any]
    calibrations: tuple[str, ...]
    recordings: tuple[str, ...]
