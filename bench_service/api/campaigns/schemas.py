"""HTTP schemas of campaigns, their runs and schedules."""

from datetime import datetime

from pydantic import BaseModel, Field

from bench_service.api.http.fields import Labels
from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.examination import Examination, StepPlan
from bench_service.campaigns.lineage import StepLineage
from bench_service.campaigns.run import CampaignRun, StepState
from bench_service.campaigns.schedule import Missed, Overlap, Schedule
from bench_service.campaigns.shipped import shipped
from bench_service.evidence.trend import Trend, TrendPoint
from bench_service.mapping import copied
from bench_service.model.job import JobState
from procedures.analysis.control_chart import ControlLimits, Signal
from procedures.core.limits import Check, Verdict


class CampaignView(BaseModel):
    """A stored campaign with its name."""

    name: str
    campaign: Campaign
    shipped: bool = Field(description="Whether it is part of the service, and cannot be changed")

    @classmethod
    def of(cls, campaign: Campaign) -> "CampaignView":
        return cls(name=campaign.name, campaign=campaign, shipped=campaign.name in shipped())


class CampaignPage(BaseModel):
    """One page of campaigns, sorted by name."""

    items: list[CampaignView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


class CampaignMade(BaseModel):
    """A stored campaign, and the warnings before it runs."""

    name: str
    campaign: Campaign
    shipped: bool = False
    duration_s: float = Field(description="Bench time by the plans [s]")
    warnings: list[str] = Field(description="Steps left out, limits out of reach")

    @classmethod
    def of(cls, campaign: Campaign, examination: Examination) -> "CampaignMade":
        return copied(cls, examination, name=campaign.name, campaign=campaign)


class CampaignPreview(BaseModel):
    """Preview of a campaign on a unit."""

    campaign: str
    unit: str
    steps: list[StepPlan]
    duration_s: float = Field(description="Bench time by the plans [s]")
    data_bytes: int
    warnings: list[str]
    decision: str = Field(description="Decision rule for values and limits")
    false_alarm: float = Field(
        description="Probability that the unit as recorded fails a limit of known false alarm, were they independent"
    )


class StepRunView(BaseModel):
    """One step of a campaign run."""

    name: str
    does: str = Field(description="Procedure or method of the step")
    state: StepState
    attempt: int = Field(description="0 before the first")
    job: str | None
    result: str | None
    earlier_jobs: list[str] = Field(description="Jobs of attempts that ended in error")
    seed: int | None
    verdict: Verdict | None
    checks: list[Check] = Field(description="Checks of the procedure, of the campaign's limits and of its trends")
    warnings: list[str]
    reason: str = Field(description="Why it failed, was cancelled or skipped")
    started_at: datetime | None
    finished_at: datetime | None


class CampaignRunView(BaseModel):
    """One run of a campaign."""

    id: str
    campaign: str
    unit: str
    bench: str
    state: JobState
    verdict: Verdict | None
    steps: list[StepRunView]
    cancel_requested: bool
    waiting: str = Field(description="What the run waits for, other than its own job; else empty")
    reason: str = Field(description="Reason of the end, where no step gives it")
    warnings: list[str]
    simulated: bool
    seed: int | None = Field(description="Base: a step's seed is the base + its number + 1000 a retry")
    labels: Labels
    team: str = Field(description="Team whose members act on it and on its jobs; empty: everybody")
    duration_s: float = Field(description="Bench time by the plans [s]")
    deadline_at: datetime | None = Field(description="Latest end of the run: no step begins later")
    schedule: str | None
    planned_at: datetime | None
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    page: str = Field(description="Path of the page in the browser")

    @classmethod
    def of(cls, run: CampaignRun) -> "CampaignRunView":
        steps = [copied(StepRunView, step, job=step.job_id, result=step.result_id) for step in run.steps]
        given = {"campaign": run.campaign.name, "schedule": run.schedule_id, "page": f"/campaign-runs/{run.id}"}
        return copied(cls, run, steps=steps, **given)


class CampaignRunPage(BaseModel):
    """One page of campaign runs, newest first."""

    items: list[CampaignRunView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


class CampaignReport(BaseModel):
    """Outcome of a run with everything that made it."""

    run: CampaignRunView
    campaign: Campaign = Field(description="Campaign as it was at the request")
    lineage: list[StepLineage] = Field(description="Lineage of every attempt of a step with a job or a result")
    code_versions: list[str]

    @classmethod
    def of(cls, run: CampaignRun, lineage: tuple[StepLineage, ...]) -> "CampaignReport":
        versions = list(dict.fromkeys(one.code_version for one in lineage))
        return cls(run=CampaignRunView.of(run), campaign=run.campaign, lineage=list(lineage), code_versions=versions)


class ScheduleView(BaseModel):
    """A schedule: the times at which a campaign starts by itself."""

    id: str
    cron: str | None = Field(description="Minute, hour, day of month, month, day of week; null for a single start")
    time_zone: str | None
    at: datetime | None = Field(description="The only start, UTC; null for repeated ones")
    campaign: str
    unit: str
    bench: str | None
    enabled: bool
    missed: Missed
    start_within_s: float
    overlap: Overlap
    labels: Labels
    team: str = Field(description="Team whose members change it and act on its runs; empty: everybody")
    created_at: datetime
    next_at: datetime | None = Field(description="UTC; null while disabled")
    last_at: datetime | None = Field(description="The last planned start that was seen")
    last_run: str | None
    last_outcome: str = Field(description="Outcome of that start")

    @classmethod
    def of(cls, schedule: Schedule) -> "ScheduleView":
        return copied(cls, schedule)


class SchedulePage(BaseModel):
    """One page of schedules, newest first."""

    items: list[ScheduleView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


class TrendView(BaseModel):
    """A quantity over a unit's results, on an individuals control chart."""

    serial: str
    procedure: str
    quantity: str
    unit: str = Field(description="Unit of the values; empty where the result does not state it")
    points: list[TrendPoint] = Field(description="Oldest first")
    limits: ControlLimits | None = Field(description="Null with fewer than two points")
    signals: list[Signal] = Field(description="Points at which a Western Electric rule is broken")
    without: int = Field(description="Results that lack the quantity")

    @classmethod
    def of(cls, trend: Trend) -> "TrendView":
        return copied(cls, trend, serial=trend.unit_serial)
