"""One execution of a campaign on one unit: a value that says how far it is, and why it is not further."""

from dataclasses import dataclass, field
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Any

from bench_service.campaigns.campaign import Campaign, Step
from bench_service.model.job import FINAL, JobState
from procedures.core.limits import Check, Verdict


class StepState(StrEnum):
    """Where a step is: its job's state, or skipped."""

    QUEUED = "queued"
    RUNNING = "running"
    PAUSED = "paused"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    SKIPPED = "skipped"


ENDED = frozenset({StepState.SUCCEEDED, StepState.FAILED, StepState.CANCELLED, StepState.SKIPPED})


@dataclass(frozen=True)
class RunRequest:
    """A run as a client asks for it."""

    campaign: str
    unit: str
    bench: str | None = None
    seed: int | None = None
    """Base of the steps' seeds on a simulated bench; None: by the campaign's rule."""
    labels: dict[str, str] = field(default_factory=dict[str, str])
    parameters: dict[str, dict[str, Any]] = field(default_factory=dict[str, dict[str, Any]])
    """Step -> parameters of its procedure that are other than the campaign's."""


@dataclass(frozen=True)
class StepRun:
    """One step of a run."""

    name: str
    does: str
    """Its procedure or method."""
    state: StepState = StepState.QUEUED
    attempt: int = 0
    """0 before the first."""
    decided: bool = False
    """The present attempt is decided on, so its job may be there even where `job_id` does not know it yet."""
    job_id: str | None = None
    result_id: str | None = None
    earlier_jobs: tuple[str, ...] = ()
    """Of attempts that ended in error."""
    seed: int | None = None
    verdict: Verdict | None = None
    checks: tuple[Check, ...] = ()
    """The procedure's own, then the campaign's limits, then its trends."""
    warnings: tuple[str, ...] = ()
    reason: str = ""
    """Why it failed, was cancelled or skipped."""
    started_at: datetime | None = None
    finished_at: datetime | None = None


@dataclass(frozen=True)
class CampaignRun:
    """One execution, with the campaign as it was when it was asked for."""

    id: str
    campaign: Campaign
    unit: str
    bench: str
    state: JobState
    created_at: datetime
    steps: tuple[StepRun, ...]
    revision: int = 1
    """Counts its changes: who saves says which one was read."""
    simulated: bool = False
    seed: int | None = None
    labels: dict[str, str] = field(default_factory=dict[str, str])
    verdict: Verdict | None = None
    cancel_requested: bool = False
    waiting: str = ""
    """What it waits for, where that is not its own job's work."""
    reason: str = ""
    """Why it ended as it did, where no step says it."""
    warnings: tuple[str, ...] = ()
    """What was known before it began: steps left out, limits out of reach."""
    duration_s: float = 0.0
    """Predicted bench time."""
    schedule_id: str | None = None
    planned_at: datetime | None = None
    """Of a scheduled run: when it should have begun."""
    started_at: datetime | None = None
    finished_at: datetime | None = None

    @property
    def open(self) -> bool:
        return self.state not in FINAL

    @property
    def deadline_at(self) -> datetime | None:
        """When its window closes; None before it began."""
        window = self.campaign.window_h
        return None if window is None or self.started_at is None else self.started_at + timedelta(hours=window)

    @property
    def current(self) -> int | None:
        """Index of the step that is to be worked on; None where all have ended."""
        return next((i for i, step in enumerate(self.steps) if step.state not in ENDED), None)

    def step_of(self, index: int) -> Step:
        """What the campaign says of a step."""
        return self.campaign.steps[index]


def verdict_of(run: CampaignRun) -> Verdict:
    """Error where a step gave none or nothing was judged, fail where one failed, else pass."""
    verdicts = [step.verdict for step in run.steps if step.state is not StepState.SKIPPED]
    if not verdicts or any(v is None or v is Verdict.ERROR for v in verdicts):
        return Verdict.ERROR
    return Verdict.FAIL if Verdict.FAIL in verdicts else Verdict.PASS
