"""Routes and schemas of schedules: campaigns that start by themselves."""

from typing import Annotated

from fastapi import Response
from pydantic import AwareDatetime, Field

from bench_service.api.access.teams import TeamOfSchedule
from bench_service.api.campaigns.schemas import SchedulePage, ScheduleView
from bench_service.api.http.dependencies import After, IdempotencyKey, Limit, Me, Service
from bench_service.api.http.errors import made, problems
from bench_service.api.http.fields import NAME, Labels, Request
from bench_service.campaigns.schedule import Missed, Overlap
from bench_service.campaigns.scheduler import ScheduleRequest
from bench_service.mapping import copied
from bench_service.routing import Routes

router = Routes(prefix="/api/v1/schedules", tags=["campaigns"])
OF_A_SCHEDULE = ("read_schedule", "change_schedule", "remove_schedule")


class ScheduleSubmission(Request):
    """Request to run a campaign on a unit at repeated times (`cron` with `time_zone`), or exactly once (`at`)."""

    cron: str | None = Field(
        None,
        min_length=1,
        max_length=200,
        pattern=r"^[^\x00-\x1f]+$",
        description="minute, hour, day of month, month, day of week",
    )
    time_zone: str | None = Field(
        None,
        min_length=1,
        max_length=100,
        pattern=r"^[^\x00-\x1f]+$",
        description="IANA name of the expression's zone, such as Europe/Kyiv",
    )
    at: AwareDatetime | None = Field(
        None, description="The only start, with its zone, in place of cron and time_zone; then the schedule is off"
    )
    campaign: str = NAME
    unit: str = NAME
    bench: Annotated[str, NAME] | None = None
    missed: Missed = Field(
        Missed.RUN_ONCE,
        description="Missed starts: run_once makes up for all by one run, skip leaves them out",
    )
    start_within_s: float = Field(
        300.0, ge=1.0, le=604_800.0, allow_inf_nan=False, description="Delay after which a start counts as missed [s]"
    )
    overlap: Overlap = Field(Overlap.SKIP, description="Start while the previous run is open: skip or queue")
    enabled: bool = True
    labels: Labels = Field(default_factory=Labels, max_length=20)


class ScheduleChange(Request):
    """A change of a schedule: put it in force or suspend it."""

    enabled: bool


@router.get("", responses=problems())
def list_schedules(service: Service, after: After = None, limit: Limit = 50) -> SchedulePage:
    """List the schedules, newest first."""
    page = service.campaigns.schedules.list(after, limit)
    return SchedulePage(items=[ScheduleView.of(schedule) for schedule in page.items], next=page.next)


@router.post(
    "", status_code=201, responses={**problems(404, 409, 413, 507), **made(201, "schedule_id", *OF_A_SCHEDULE)}
)
def add_schedule(
    body: ScheduleSubmission, service: Service, response: Response, me: Me, key: IdempotencyKey = None
) -> ScheduleView:
    """Schedule a campaign at given times, for the team of the account or token that asks.

    A time that never comes is refused, and a run that could not begin now.
    """
    request = copied(ScheduleRequest, body)
    schedule = service.campaigns.schedules.add(request, key, me.team)
    response.headers["Location"] = f"/api/v1/schedules/{schedule.id}"
    return ScheduleView.of(schedule)


@router.get("/{schedule_id}", responses=problems(404))
def read_schedule(schedule_id: str, service: Service) -> ScheduleView:
    """Read one schedule: its next start, and the outcome of its last start."""
    return ScheduleView.of(service.campaigns.schedules.get(schedule_id))


@router.patch("/{schedule_id}", responses=problems(404, 409, 413, 507), dependencies=[TeamOfSchedule])
def change_schedule(schedule_id: str, body: ScheduleChange, service: Service) -> ScheduleView:
    """Switch a schedule off or on; starts that pass while it is off are not made up, a single one is not repeated."""
    return ScheduleView.of(service.campaigns.schedules.enable(schedule_id, body.enabled))


@router.delete(
    "/{schedule_id}", status_code=204, response_model=None, responses=problems(404, 507), dependencies=[TeamOfSchedule]
)
def remove_schedule(schedule_id: str, service: Service) -> None:
    """Delete one schedule; its runs are kept."""
    service.campaigns.schedules.remove(schedule_id)
