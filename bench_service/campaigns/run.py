"""One execution of a campaign on one unit: a value with its progress, and the reason why it waits."""

from dataclasses import dataclass, field
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Any

from bench_service.campaigns.campaign import Campaign, Step
from bench_service.model.job import FINAL, JobState
from procedures.core.limits import Check, Verdict


class StepState(StrEnum):
    """The state of a step: its job's state, or skipped."""

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
    """A client's request for a campaign run: campaign, unit, bench, seed, labels, parameters of steps."""

    campaign: str
    unit: str
    bench: str | None = None
    seed: int | None = None
    """Base of the steps' seeds on a simulated bench; None: by the campaign's rule."""
    labels: dict[str, str] = field(default_factory=dict[str, str])
    parameters: dict[str, dict[str, Any]] = field(default_factory=dict[str, dict[str, Any]])
    """Step -> parameters of its procedure that override the campaign's."""


@dataclass(frozen=True)
class StepRun:
    """Progress of one step of a run: state, attempt, job, result, verdict, checks, times."""

    name: str
    does: str
    """Name of its procedure or method."""
    state: StepState = StepState.QUEUED
    attempt: int = 0
    """Number of the present attempt; 0 before the first."""
    decided: bool = False
    """True once the present attempt is decided: its job may exist even where `job_id` is not set yet."""
    job_id: str | None = None
    result_id: str | None = None
    earlier_jobs: tuple[str, ...] = ()
    """Jobs of attempts that ended in error."""
    seed: int | None = None
    verdict: Verdict | None = None
    checks: tuple[Check, ...] = ()
    """The procedure's own checks, then the campaign's limits, then its trends."""
    warnings: tuple[str, ...] = ()
    reason: str = ""
    """The reason why it failed, was cancelled or skipped."""
    started_at: datetime | None = None
    finished_at: datetime | None = None


@dataclass(frozen=True)
class CampaignRun:
    """One execution of a campaign on a unit: its progress, with the campaign as it was at the time of the request. A
    value; `transitions` makes the next one.
    """

    id: str
    campaign: Campaign
    unit: str
    bench: str
    state: JobState
    created_at: datetime
    steps: tuple[StepRun, ...]
    revision: int = 1
    """Number of its changes; a save names the revision that was read."""
    simulated: bool = False
    seed: int | None = None
    labels: dict[str, str] = field(default_factory=dict[str, str])
    team: str = ""
    """Team whose members act on the run and its jobs: of the person or program that started it, or of its schedule."""
    verdict: Verdict | None = None
    cancel_requested: bool = False
    waiting: str = ""
    """The reason for waiting, other than its own job's work."""
    reason: str = ""
    """The reason for its end, where no step gives it."""
    warnings: tuple[str, ...] = ()
    """Warnings known before it began: steps left out, limits out of reach."""
    duration_s: float = 0.0
    """Predicted bench time [s]."""
    schedule_id: str | None = None
    planned_at: datetime | None = None
    """Planned start of a scheduled run."""
    started_at: datetime | None = None
    finished_at: datetime | None = None

    @property
    def open(self) -> bool:
        return self.state not in FINAL

    @property
    def deadline_at(self) -> datetime | None:
        """Time when the campaign's window closes; None without a window, and before the run began."""
        window = self.campaign.window_h
        return None if window is None or self.started_at is None else self.started_at + timedelta(hours=window)

    @property
    def current(self) -> int | None:
        """Index (from 0) of the first step that has not ended; None where all have."""
        return next((i for i, step in enumerate(self.steps) if step.state not in ENDED), None)

    def step_of(self, index: int) -> Step:
        """Return the campaign's definition of the step with this index."""
        return self.campaign.steps[index]


def verdict_of(run: CampaignRun) -> Verdict:
    """Return the run's verdict: fail where any step failed, else error where a step gave none or nothing was judged,
    else pass.

    A step that was not judged, or whose checks are inconclusive, takes nothing back of what another step has found.
    """
    verdicts = [step.verdict for step in run.steps if step.state is not StepState.SKIPPED]
    if Verdict.FAIL in verdicts:
        return Verdict.FAIL
    if not verdicts or any(v is None or v is Verdict.ERROR for v in verdicts):
        return Verdict.ERROR
    return Verdict.PASS
